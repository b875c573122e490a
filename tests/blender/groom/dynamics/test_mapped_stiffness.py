# SPDX-License-Identifier: GPL-3.0-or-later
"""A map of the bend stiffness gives each simulated guide its own stiffness."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.groom.dynamics import frame_folders, guide_baking
from hair_addon.core.dynamics.rod import material
from hair_addon.core.dynamics.rod.settings import DynamicsSettings
from hair_addon.core.errors import HairError
from hair_addon.core.long_work import run_now
from tests.support.dynamics.swung import simulate, swing

SETTING = "dynamics.bend_stiffness"
LAST = 5


@pytest.fixture
def swung(hair, tmp_path):
    """Return guides that swing without touching each other, and hair of these guides."""
    swing(bpy.data.objects["Sphere"])
    guides = bpy.data.objects["Guides"]
    apart = {"hair_friction": 0.0, "hair_pressure": 0.0, "collides_with_surface": False, "sag_free": False}
    simulate(guides, tmp_path, bend_stiffness=1.0, **apart)
    return guides.data, hair.data


def baked(guides):
    """Return (G, P, 3) of the last frame of a new bake."""
    run_now(guide_baking.baking([guides], LAST, bpy.context.scene, True))
    return frame_folders.frames_of(guides).points_at(LAST)


def half_group():
    """Return the name of a vertex group with weight 1 where x > 0, and 0 elsewhere."""
    sphere = bpy.data.objects["Sphere"]
    group = sphere.vertex_groups.new(name="half")
    group.add([v.index for v in sphere.data.vertices if v.co.x > 0.0], 1.0, "REPLACE")
    bpy.context.view_layer.update()
    return group.name


def test_each_half_moves_with_its_stiffness(swung):
    """Guides where the map is 0 and 1 have the bits of guides with the stiffness of From and To everywhere."""
    guides, hair = swung
    soft = baked(guides)
    guides.vellus.dynamics.bend_stiffness = 500.0
    stiff = baked(guides)
    x = np.array([curve.points[0].position.x for curve in guides.curves])
    api.set_map(hair, SETTING, f"group:{half_group()}", low=0.002, high=1.0)
    found = baked(guides)
    np.testing.assert_array_equal(found[x > 0.25], stiff[x > 0.25])
    np.testing.assert_array_equal(found[x < -0.25], soft[x < -0.25])
    assert np.abs(stiff - soft).max(axis=(1, 2)).min() > 1e-4
    assert [one.setting for one in api.maps_of(hair)] == [SETTING]


def test_a_constant_map_is_the_value(swung):
    """A constant map keeps the bits of the value; its factor multiplies the value; frames are outdated by a map."""
    guides, hair = swung
    guides.vellus.dynamics.bend_stiffness = 4.0
    whole, key = baked(guides), guide_baking.key_of(guides, bpy.context.scene)
    api.set_map(hair, SETTING, "strand", low=1.0, high=1.0)
    assert guide_baking.key_of(guides, bpy.context.scene) != key
    np.testing.assert_array_equal(baked(guides), whole)
    api.set_map(hair, SETTING, "strand", low=0.5, high=0.5)
    half = baked(guides)
    api.clear_map(hair, SETTING)
    assert guide_baking.key_of(guides, bpy.context.scene) == key
    guides.vellus.dynamics.bend_stiffness = 2.0
    np.testing.assert_array_equal(baked(guides), half)


@pytest.mark.parametrize(("source", "message"), [("group:lost", '"lost"'), ("clump", "Maps of guides")])
def test_a_map_without_values_is_an_error(swung, source, message):
    """A simulation whose map has a missing source, or of a kind that guides do not have, does not start."""
    guides, hair = swung
    api.set_map(hair, SETTING, source)
    with pytest.raises(HairError, match=message):
        baked(guides)


def test_stiffness_of_another_number_of_strands_is_an_error():
    """A stiffness for each strand needs one value per strand."""
    lengths = np.full((3, 8), 0.01)
    with pytest.raises(HairError, match="stiffnesses"):
        material.material_of(DynamicsSettings(), lengths, stiffness=np.ones(2))
