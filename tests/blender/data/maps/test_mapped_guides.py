# SPDX-License-Identifier: GPL-3.0-or-later
"""Each guide grows with the settings that maps give its root."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data.strands import curves
from hair_addon.blender.settings import map_items
from hair_addon.core.errors import HairError
from hair_addon.core.geometry.strands import lengths
from hair_addon.core.maps.map_settings import MapSettings
from tests.support.reading import points, write_points


@pytest.fixture
def grown(hair):
    """Return guides and hair; the vertex group `top` has the upper half of the sphere."""
    settings = hair.data.vellus.guide_curves.vellus.guides
    settings.gravity, settings.tilt, settings.length_variation, settings.drape = 0.6, 0.3, 0.3, False
    bpy.context.view_layer.update()
    return hair


def shapes():
    """Return (G, P, 3) points of guides."""
    return points(bpy.data.objects["Guides"]).copy()


def on_halves():
    """Return two (G,) bool arrays: guides rooted well inside the upper half, and guides rooted well inside the lower
    half.
    """
    heights = shapes()[:, 0, 2]
    return heights > 0.3, heights < -0.3


VALUES = {"length": 0.25, "tilt": 0.9, "gravity": 0.1}


@pytest.mark.parametrize("setting", VALUES)
def test_a_constant_map_is_the_constant(grown, setting):
    """A map of ones gives the guides of the setting, bit for bit."""
    before = shapes()
    api.set_map(grown, f"guides.{setting}", "strand", low=1.0, high=1.0)
    bpy.context.view_layer.update()
    assert not bpy.data.objects["Guides"].data.vellus.is_stale
    np.testing.assert_array_equal(shapes(), before)


@pytest.mark.parametrize("setting", VALUES)
def test_two_halves_are_the_two_grooms(grown, setting):
    """Guides on each half of a painted mesh have, bit for bit, the shape of the groom with the value of this half."""
    settings = bpy.data.objects["Guides"].data.vellus.guides
    first = getattr(settings, setting)
    plain = shapes()
    factor = VALUES[setting] / first
    setattr(settings, setting, first * factor)
    bpy.context.view_layer.update()
    other = shapes()
    setattr(settings, setting, first)
    bpy.context.view_layer.update()
    api.set_map(grown, f"guides.{setting}", "group:top", low=1.0, high=factor)
    bpy.context.view_layer.update()
    up, down = on_halves()
    np.testing.assert_allclose(shapes()[up], other[up], atol=1e-6)
    np.testing.assert_array_equal(shapes()[down], plain[down])
    assert up.sum() > 5 and down.sum() > 5 and not np.allclose(other[up], plain[up], atol=1e-3)
    assert api.clear_map(grown, f"guides.{setting}")
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(shapes(), plain)


def test_no_guide_loses_its_length_and_hair_follows(grown):
    """Guides keep a thousandth of the length where a map is black, hair between them is as short, and a ramp
    applies.
    """
    hair = lengths(points(grown)).max()
    api.set_map(grown, "guides.length", "group:top", ramp="0:0 1:0")
    bpy.context.view_layer.update()
    long = lengths(shapes())
    assert (long > 0.0).all() and np.isfinite(shapes()).all()
    np.testing.assert_allclose(long.max(), 0.5e-3, rtol=0.4)
    assert lengths(points(grown)).max() < 0.01 * hair


def test_combed_guides_do_not_change(grown):
    """A map of combed guides leaves them and their status as they are, also when its group is painted."""
    combed = shapes()
    combed[:, -1] += np.float32([0.0, 0.1, 0.2])
    write_points(bpy.data.objects["Guides"], combed)
    guides = bpy.data.objects["Guides"].data
    api.apply_settings(grown, with_map(api.settings_of(grown), "guides.length"))
    bpy.context.view_layer.update()
    assert [one.setting for one in api.maps_of(grown)] == ["guides.length"]
    assert guides.vellus.status == ""
    sphere = bpy.data.objects["Sphere"]
    sphere.vertex_groups["top"].add([0, 1, 2], 0.3, "REPLACE")
    sphere.data.update_tag()
    bpy.context.view_layer.update()
    assert guides.vellus.status == "" and curves.is_combed(guides)
    np.testing.assert_allclose(shapes(), combed, atol=1e-6)


def with_map(settings, setting):
    return api.GroomSettings(
        **{name: getattr(settings, name) for name in ("guides", "hair", "appearance", "tables", "styles", "dynamics")},
        maps=(MapSettings(setting=setting, kind="GROUP", source="top", low=0.5),),
    )


def test_files_panels_and_refusals(grown, tmp_path):
    """Settings files and buttons of the panel set maps of guides, and an unsupported source is a status with a
    sentence.
    """
    wanted = api.set_map(grown, "guides.lift", "strand", low=0.5)
    api.save_settings(tmp_path / "lift.json", api.settings_of(grown))
    bpy.context.view_layer.objects.active = bpy.data.objects["Guides"]
    assert bpy.ops.vellus.remove_map(setting="guides.lift") == {"FINISHED"}
    assert api.maps_of(grown) == ()
    api.apply_settings(grown, api.load_settings(tmp_path / "lift.json"))
    assert api.maps_of(grown) == (wanted,)
    guides = bpy.data.objects["Guides"].data
    assert bpy.ops.vellus.edit_map(setting="guides.tilt") == {"FINISHED"}
    assert map_items.item_of(guides.vellus, "guides.tilt") is not None
    assert map_items.item_of(grown.data.vellus, "guides.tilt") is None
    before = shapes()
    for source, word in (("clump", "random numbers"), ("group:lost", "lost"), ("curves:own", "random numbers")):
        api.set_map(grown, "guides.tilt", source)
        bpy.context.view_layer.update()
        assert word in guides.vellus.status
        np.testing.assert_array_equal(shapes(), before)
    api.clear_map(grown, "guides.tilt")
    bpy.context.view_layer.update()
    assert guides.vellus.status == ""
    with pytest.raises(HairError, match="No map can vary"):
        api.set_map(grown, "guides.seed", "strand")
