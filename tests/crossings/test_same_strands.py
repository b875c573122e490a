# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel, scripts and command line give the same strands, bit by bit, for the same settings."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from tests.support.commands import load, run, run_here
from tests.support.reading import points

GUIDES = {"guide_count": 40, "seed": 7, "length": 0.3, "gravity": 0.4}
HAIR = {"strand_count": 600, "neighbour_limit": 5, "radius": 0.001, "influence_distance": 0.3}
SEED = 7

# How an object stands in the world; rounding differs in each.
POSES = {
    "plain": {},
    "moved": {"location": (3.0, -2.0, 0.7)},
    "turned": {"rotation_euler": (0.3, -0.8, 2.1)},
    "scaled": {"scale": (1.7, 1.7, 1.7), "rotation_euler": (0.1, 0.2, 0.3)},
    "stretched": {"scale": (0.5, 1.3, 2.1), "rotation_euler": (0.1, 0.2, 0.3)},
    "mirrored": {"scale": (-1.0, 1.0, 1.0), "location": (0.1, 0.2, 0.3)},
}


# The others are those two in part.
@pytest.fixture(
    params=[pytest.param(name, marks=() if name in {"stretched", "mirrored"} else pytest.mark.long) for name in POSES]
)
def surface(request, sphere):
    """Return the sphere with one of several transforms."""
    for name, value in POSES[request.param].items():
        setattr(sphere, name, value)
    bpy.context.view_layer.update()
    return sphere


def test_all_ways_make_the_same_strands(surface, tmp_path):
    blend = tmp_path / "surface.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    made = {}

    def keep(way, guides, hair):
        made[way] = points(guides), points(hair)

    bpy.ops.vellus.add_hair(**GUIDES, **HAIR)
    keep("add hair", bpy.data.objects["Hair Guides"], bpy.data.objects["Hair"])

    _open(blend)
    bpy.ops.vellus.distribute_guides(**GUIDES)
    bpy.ops.vellus.interpolate_hair(**HAIR, seed=SEED)
    keep("one after the other", bpy.data.objects["Guides"], bpy.data.objects["Hair"])

    surface = _open(blend)
    api.distribute_guides(surface, **GUIDES)
    api.interpolate_hair(bpy.data.objects["Guides"], **HAIR, seed=SEED)
    keep("script", bpy.data.objects["Guides"], bpy.data.objects["Hair"])
    arrays = [api.points(bpy.data.objects[name]) for name in ("Guides", "Hair")]

    surface = _open(blend)
    settings = api.GroomSettings(api.GuideSettings(**GUIDES), api.HairSettings(**HAIR, seed=SEED))
    api.add_hair(surface, settings)
    keep("script, in one step", bpy.data.objects["Guides"], bpy.data.objects["Hair"])

    out, files = tmp_path / "groom.blend", tmp_path / "groom.npz"
    api.save_settings(tmp_path / "groom.json", settings)
    other = run if surface.matrix_world.is_identity else run_here  # a separate process once is enough
    for target, call in ((out, run_here), (files, other)):
        groom = ("groom", blend, "--settings", tmp_path / "groom.json", "--out", target)
        assert call(*groom).status == 0
    _open(out)
    keep("command line", bpy.data.objects["Guides"], bpy.data.objects["Hair"])

    first = made["add hair"]
    assert (len(first[0]), len(first[1])) == (40, 600)
    for way, found in made.items():
        for kind, expected, came in zip(("guides", "hair"), first, found, strict=True):
            assert np.array_equal(expected, came), f"{kind}: {way}"
    stored = load(files)
    for name, expected in zip(("guide_points", "strand_points"), arrays, strict=True):
        assert np.array_equal(stored[name], expected)


def _open(blend):
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    surface = bpy.data.objects["Sphere"]
    bpy.context.view_layer.objects.active = surface
    return surface


def test_arrays_make_what_an_object_of_them_does(sphere):
    """Arrays give the strands of an object whose local coordinates are the world's."""
    mesh = sphere.data
    mesh.calc_loop_triangles()
    triangles = np.array([triangle.vertices[:] for triangle in mesh.loop_triangles], np.int32)
    vertices = np.array([vertex.co for vertex in mesh.vertices], np.float32)
    guides = api.distribute_guides((vertices, triangles), **GUIDES)
    hair = api.interpolate_hair(guides, mesh=(vertices, triangles), **HAIR, seed=SEED)
    bpy.ops.vellus.add_hair(**GUIDES, **HAIR)
    assert np.array_equal(api.points(guides), points(bpy.data.objects["Hair Guides"]))
    assert np.array_equal(api.points(hair), points(bpy.data.objects["Hair"]))


def test_settings_given_to_hair_that_is_there_make_the_same(surface):
    """Settings given to existing hair give the same strands as hair grown with these settings."""
    bpy.ops.vellus.add_hair(guide_count=25, strand_count=100)
    settings = api.GroomSettings(api.GuideSettings(**GUIDES), api.HairSettings(**HAIR, seed=SEED))
    hair = bpy.data.objects["Hair"]
    api.apply_settings(hair, settings)
    bpy.context.view_layer.update()
    changed = points(hair)
    assert api.settings_of(hair) == settings
    bpy.context.view_layer.objects.active = surface
    _guides, grown = api.add_hair(surface, settings)
    assert np.array_equal(changed, points(next(o for o in bpy.data.objects if o.data == grown)))
