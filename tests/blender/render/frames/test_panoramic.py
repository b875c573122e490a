# SPDX-License-Identifier: GPL-3.0-or-later
"""Panoramic cameras show the silhouettes and distances of Cycles, also for regions and in stereo."""

import math

import bpy
import numpy as np
import pytest

from tests.support.pairs import share_of
from tests.support.pictures.rendering import light_up, rendered

WIDTH, HEIGHT = 72, 48

KINDS = {
    "EQUIRECTANGULAR": {},
    "EQUIRECTANGULAR, part": {"latitude_min": -0.7, "latitude_max": 1.2, "longitude_min": -1.0, "longitude_max": 2.0},
    "EQUIANGULAR_CUBEMAP_FACE": {},
    "MIRRORBALL": {},
    "FISHEYE_EQUIDISTANT": {"fisheye_fov": 3.5, "shift_x": 0.05, "shift_y": -0.1},
    "FISHEYE_EQUISOLID": {"fisheye_fov": 3.0, "sensor_fit": "VERTICAL"},
    "FISHEYE_LENS_POLYNOMIAL": {"fisheye_fov": 3.0},
    "CENTRAL_CYLINDRICAL": {"central_cylindrical_radius": 1.5, "central_cylindrical_range_u_max": 2.0},
}


@pytest.fixture
def inside(lit):
    """Return a camera near the hairy sphere, seen obliquely, with cubes all around."""
    scene = bpy.context.scene
    lit.data.vellus.hair.radius = 0.02
    scene.camera.location, scene.camera.rotation_euler = (0.3, -1.9, 0.2), (math.pi / 2, 0.2, 0.7)
    scene.camera.data.type, scene.camera.data.clip_start = "PANO", 0.01
    for place in ((0.0, -4.0, 0.0), (-2.0, -2.0, 1.0), (2.0, -2.0, 2.0), (0.5, -2.0, -2.0), (0.0, -2.0, 3.0)):
        bpy.ops.mesh.primitive_cube_add(size=0.8, location=place)
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.max_bounces = 16, False, 0
    scene.cycles.pixel_filter_type = "BOX"
    bpy.context.view_layer.use_pass_z = True
    return scene


def choose(scene, kind):
    scene.camera.data.panorama_type = kind.split(",")[0]
    for name, value in KINDS[kind].items():
        setattr(scene.camera.data, name, value)


def passes(folder, **settings):
    shape = {"resolution_x": WIDTH, "resolution_y": HEIGHT, "film_transparent": True, "sample_count": 16}
    return rendered(folder, **shape | settings)


@pytest.mark.parametrize("kind", share_of(KINDS, 2))
def test_silhouettes_and_distances_are_those_of_cycles(inside, tmp_path, kind):
    choose(inside, kind)
    ours, theirs = passes(tmp_path), passes(tmp_path, engine="CYCLES")
    mine, other = (found["Combined"][..., 3] > 0.5 for found in (ours, theirs))
    assert 0.03 < other.mean() < 0.97
    assert (mine & other).sum() > 0.95 * (mine | other).sum()
    both = mine & other & (theirs["Depth"] < 1e9) & (ours["Depth"] < 1e9)
    # A pixel has the nearest distance of all that it shows, and in ours the middle's.
    assert np.median(ours["Depth"][both] / theirs["Depth"][both]) == pytest.approx(1.0, abs=0.03)
    is_empty = (theirs["Depth"] > 1e9) & (ours["Depth"] > 1e9)
    np.testing.assert_array_equal(ours["Depth"][is_empty], theirs["Depth"][is_empty])


def test_a_border_is_rendered_as_in_the_whole_picture(inside, tmp_path):
    choose(inside, "EQUIRECTANGULAR")
    whole = passes(tmp_path)["Combined"]
    border = {"border_min_x": 0.25, "border_max_x": 0.75, "border_min_y": 0.25, "border_max_y": 0.75}
    part = passes(tmp_path, use_border=True, use_crop_to_border=True, **border)["Combined"]
    assert part.shape == (24, 36, 4)
    # Of a part the size of the pixels, and with it that of the faces, is another.
    assert np.abs(part - whole[12:36, 18:54]).mean() < 0.02


def test_the_world_is_the_background_without_seams(inside, tmp_path):
    light_up((0.2, 0.3, 0.4))
    for mesh_object in [o for o in inside.objects if o.type == "MESH"]:
        mesh_object.hide_render = True
    bpy.data.objects["Hair"].hide_render = True
    choose(inside, "EQUIRECTANGULAR")
    combined = passes(tmp_path, film_transparent=False)["Combined"]
    np.testing.assert_allclose(combined, np.broadcast_to((0.2, 0.3, 0.4, 1.0), combined.shape), atol=1e-3)


def test_other_passes_are_resampled_too(inside, tmp_path):
    """Other passes are resampled too: the lobes add up to the hair's light, and coverage is at most one."""
    choose(inside, "FISHEYE_EQUIDISTANT")
    layer = bpy.context.view_layer.vellus
    layer.has_hair_mask = layer.has_hair_shadow = layer.has_lobes = True
    bpy.data.objects["Sphere"].hide_render = True
    for cube in [o for o in inside.objects if o.name.startswith("Cube")]:
        cube.hide_render = True
    found = passes(tmp_path, sample_count=4)
    lobes = sum(pixels for name, pixels in found.items() if name.startswith("Hair ") and pixels.ndim == 3)
    lobes -= found["Hair Shadow"]
    np.testing.assert_allclose(lobes, found["Combined"][..., :3], atol=2e-3)
    around = ~np.isclose(found["Combined"][..., 3], found["Hair Mask"], atol=2e-3)
    assert found["Hair Mask"].max() > 0.5 and (found["Combined"][around, :3] < 0.5).all()
    np.testing.assert_allclose(found["Hair Shadow"], 1.0, atol=1e-5)


def test_hair_only_leaves_the_outside_to_the_other_picture(inside, tmp_path):
    """Hair Only leaves the outside of a fisheye's circle to the other picture."""
    choose(inside, "FISHEYE_EQUIDISTANT")
    found = passes(tmp_path, is_hair_only=True)
    assert found["Combined"][0, 0, 3] == 0.0 and found["Combined"][..., 3].max() > 0.9
