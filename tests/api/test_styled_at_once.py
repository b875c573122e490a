# SPDX-License-Identifier: GPL-3.0-or-later
"""New hair with styles is styled when the call returns, and the next update does not style it again."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data.strands import curves
from hair_addon.blender.groom.transfer import groom_settings
from hair_addon.core.files import settings_file
from hair_addon.core.long_work import run_now
from tests.support.counting import counts_of
from tests.support.dynamics.following import update
from tests.support.exchange.imported import curves_object
from tests.support.reading import points, snapshot

STYLES = (
    api.Lean(amount=0.4),
    api.Clump(size=0.3, mask="top"),
    api.Curl(radius=0.1 / 3.0, pitch=0.2),  # no number of single precision
    api.Wet(amount=0.5, lock=0.4, mask="top"),
)
SETTINGS = api.GroomSettings(
    api.GuideSettings(guide_count=30),
    api.HairSettings(strand_count=200, point_count=60),
    styles=STYLES,
    style_names=("", "Locks", "", ""),
)


def hair_object():
    return bpy.data.objects["Hair"]


def by_settings(sphere):
    return api.add_hair(sphere, SETTINGS)[1]


def between_guides(sphere):
    guides = api.distribute_guides(sphere, SETTINGS.guides)
    return api.interpolate_hair(guides, SETTINGS.hair, styles=STYLES)


def from_a_file(sphere, path):
    settings_file.write(path, SETTINGS)
    bpy.context.view_layer.objects.active = sphere
    assert bpy.ops.vellus.load_groom_settings(filepath=str(path)) == {"FINISHED"}
    return hair_object().data


@pytest.mark.parametrize("grow", [by_settings, between_guides, from_a_file])
def test_new_hair_is_styled_when_the_call_returns(sphere, grow, tmp_path, monkeypatch):
    calls = counts_of(monkeypatch)
    hair = grow(sphere, tmp_path / "groom.json") if grow is from_a_file else grow(sphere)
    at_once = points(hair_object())
    writes = calls["writes"]
    assert writes == 2  # guides, and strands once
    assert curves.read_wetness(hair).max() > 0.0
    update()
    assert np.array_equal(points(hair_object()), at_once)
    assert calls["writes"] == writes
    assert not hair.vellus.is_stale and hair.vellus.status == ""
    assert hair.vellus.styles[1].name == ("Clump" if grow is between_guides else "Locks")
    styles = api.styles_of(hair)
    api.set_styles(hair, [])
    update()
    plain = points(hair_object())
    assert plain.shape == at_once.shape and not np.allclose(plain, at_once, atol=0.01)
    api.set_styles(hair, styles)
    update()
    assert np.array_equal(points(hair_object()), at_once)


@pytest.mark.parametrize("grow", [by_settings, between_guides])
def test_a_mask_that_is_missing_leaves_nothing_behind(sphere, grow, monkeypatch):
    sphere.vertex_groups.remove(sphere.vertex_groups["top"])
    guides = {"objects": ["Guides"], "curves": ["Guides"]} if grow is between_guides else {}
    before = snapshot()
    with pytest.raises(api.HairError, match='vertex group or attribute "top"'):
        grow(sphere)
    after = snapshot()
    for name in guides:
        after[name] = [found for found in after[name] if found not in guides[name]]
    assert after == before


def test_hair_between_curves_is_styled_at_once_by_masks_of_these(sphere, rng):
    roots = rng.normal(size=(40, 3))
    roots /= np.linalg.norm(roots, axis=1, keepdims=True)
    drawn = curves_object([root * np.linspace(1.0, 1.5, 8)[:, None] for root in roots])
    drawn.data.attributes.new("ends", "FLOAT", "CURVE").data.foreach_set("value", np.float32(roots[:, 2] > 0.0))
    settings = api.GroomSettings(hair=api.HairSettings(strand_count=300), styles=[api.Trim(factor=0.2, mask="ends")])
    depsgraph = bpy.context.evaluated_depsgraph_get()
    run_now(groom_settings.using_as_guides(drawn, sphere, settings, depsgraph))
    at_once = points(hair_object())
    lengths = np.linalg.norm(np.diff(at_once, axis=1), axis=2).sum(axis=1)
    assert lengths.min() < 0.15 and lengths.max() > 0.4
    update()
    assert np.array_equal(points(hair_object()), at_once)
