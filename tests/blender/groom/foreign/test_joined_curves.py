# SPDX-License-Identifier: GPL-3.0-or-later
"""Several selected curve objects become one hair system by Use as Guides and by Use as Hair."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom.foreign import kept_hair
from hair_addon.core.errors import HairError
from tests.support import placed_hair
from tests.support.interface.layout import draw
from tests.support.reading import snapshot


def directions(count, rng):
    """Return (count, 3) unit vectors to the upper half."""
    ways = rng.normal(size=(count, 3))
    ways[:, 2] = abs(ways[:, 2])
    return ways / np.linalg.norm(ways, axis=1)[:, None]


@pytest.fixture
def curves_around(sphere, rng):
    """Return (three objects around the sphere, (20, 2, 3) ends of curves in the world, (20,) radii at roots).

    The objects are Curves, moved and twice as large, with radii; legacy curves as thick as their bevel; and curves
    without radii.
    """
    ways = directions(20, rng)
    ends = ways[:, None] * np.linspace(1.0, 1.5, 2)[:, None]
    made = []
    for name, part in (("Thick", slice(0, 8)), ("Bare", slice(15, 20))):
        datablock = bpy.data.hair_curves.new(name)
        datablock.add_curves([5] * len(ends[part]))
        datablock.set_types(type="POLY")
        made.append(bpy.data.objects.new(name, datablock))
        if name == "Thick":
            made[0].location, made[0].scale = (0.3, 0.2, 0.1), (2.0, 2.0, 2.0)
            datablock.attributes.new("radius", "FLOAT", "POINT").data.foreach_set(
                "value", np.full(40, 0.004, np.float32)
            )
        bpy.context.scene.collection.objects.link(made[-1])
        bpy.context.view_layer.update()
        along = np.linspace(ends[part][:, 0], ends[part][:, 1], 5, axis=1)
        matrix = np.linalg.inv(np.array(made[-1].matrix_world))
        local = np.float32(along @ matrix[:3, :3].T + matrix[:3, 3])
        datablock.attributes["position"].data.foreach_set("vector", local.ravel())
    legacy = bpy.data.curves.new("Legacy", "CURVE")
    legacy.dimensions, legacy.bevel_depth = "3D", 0.01
    for start, end in ends[8:15]:
        spline = legacy.splines.new("POLY")
        spline.points.add(1)
        for point, place in zip(spline.points, (end, start), strict=True):  # from tip to root
            point.co = (*place, 1.0)
    made.insert(1, bpy.data.objects.new("Legacy", legacy))
    bpy.context.scene.collection.objects.link(made[1])
    bpy.context.view_layer.update()
    radii = np.repeat([0.008, 0.01, 0.005], [8, 7, 5])
    for one in (*made, sphere):
        one.select_set(True)
    bpy.context.view_layer.objects.active = made[0]
    return made, ends, radii


def ends_and_radii(curves_object):
    """Return ((C, 2, 3) ends of curves, (C,) radii at their roots), both in the world."""
    datablock, found, radii = curves_object.data, [], []
    size = placed_hair.world_scale(curves_object)
    for curve in datablock.curves:
        for place in (curve.first_point_index, curve.first_point_index + curve.points_length - 1):
            found.append(curves_object.matrix_world @ datablock.points[place].position)
        radii.append(size * datablock.attributes["radius"].data[curve.first_point_index].value)
    return np.array(found).reshape(-1, 2, 3), np.array(radii)


@pytest.mark.parametrize(
    ("name", "place"), [("use_as_guides", "small"), ("use_as_hair", "uneven"), ("use_as_hair", "mirrored")]
)
def test_all_selected_objects_become_one_system(curves_around, sphere, name, place):
    """All selected objects become one system, with their points and widths in the world."""
    _made, ends, radii = curves_around
    placed_hair.PLACES[place](sphere)
    bpy.context.view_layer.update()
    sphere.data.transform(sphere.matrix_world.inverted())  # the sphere stays where the curves are
    assert "The 3 selected objects become one." in " ".join(draw(bpy.types.VELLUS_PT_surface).texts)
    options = {"strand_count": 50} if name == "use_as_guides" else {}
    assert getattr(bpy.ops.vellus, name)(**options) == {"FINISHED"}
    used = bpy.data.objects["Thick"]
    assert used.data.vellus.kind == ("GUIDES" if name == "use_as_guides" else "HAIR")
    assert used.data.name == "Thick" and not {"Legacy", "Bare", "Thick.001"} & set(bpy.data.objects.keys())
    assert [c.name for c in bpy.data.curves] == [] and len(bpy.data.hair_curves) == 2
    found, found_radii = ends_and_radii(used)
    order = [np.linalg.norm(found - pair, axis=(1, 2)).argmin() for pair in ends]
    assert sorted(order) == list(range(20))
    np.testing.assert_allclose(found[order], ends, atol=1e-5)
    np.testing.assert_allclose(found_radii[order], radii, rtol=1e-3)


def refuse(*_arguments, **_options):
    raise HairError("Not now.")


def test_where_it_is_refused_all_stay_as_they_are(curves_around, monkeypatch):
    before = snapshot()
    monkeypatch.setattr(kept_hair, "using_as_hair", refuse)
    with pytest.raises(RuntimeError, match="Not now"):
        bpy.ops.vellus.use_as_hair()
    assert snapshot() == before
    curves_around[0][2].keyframe_insert("location", frame=1)
    with pytest.raises(RuntimeError, match='"Bare" is animated'):
        bpy.ops.vellus.use_as_hair()
    assert snapshot() == before
