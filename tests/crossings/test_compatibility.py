# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's own tools accept our Curves: Sculpt Mode, Cycles and EEVEE."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.scene import read_camera
from tests.support.reading import evaluated_points, points

PIXELS = 96


@pytest.mark.parametrize("kind", ["guides", "hair"])
def test_sculpt_mode_opens(kind, request):
    made = request.getfixturevalue(kind)
    bpy.context.view_layer.objects.active = made
    before = points(made)
    assert bpy.ops.object.mode_set(mode="SCULPT_CURVES") == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.array_equal(points(made), before)


@pytest.mark.farm
@pytest.mark.parametrize("engine", ["CYCLES", "BLENDER_EEVEE"])
def test_blender_renders_the_hair(lit, engine, tmp_path):
    """Blender renders the hair: strands cover the pixels that they cross on a twisted surface, and are lit; guides
    are invisible.
    """
    scene, surface = bpy.context.scene, bpy.data.objects["Sphere"]
    lit.data.vellus.hair.radius, lit.data.vellus.hair.tip_taper = 0.03, 1.0
    twist = surface.modifiers.new("Twist", "SIMPLE_DEFORM")
    twist.deform_method, twist.angle = "TWIST", 1.0
    surface.hide_render = True
    guides = bpy.data.objects["Guides"].data
    guides.attributes["radius"].data.foreach_set("value", np.full(len(guides.points), 0.2, np.float32))
    bpy.context.view_layer.update()
    scene.render.engine = engine
    scene.render.resolution_x = scene.render.resolution_y = PIXELS
    scene.render.film_transparent, scene.view_settings.view_transform = True, "Standard"
    scene.cycles.samples, scene.eevee.taa_render_samples = 8, 4
    scene.eevee.use_shadows = False  # shadows take half of its time
    scene.render.filepath = str(tmp_path / "hair.png")
    bpy.ops.render.render(write_still=True)
    picture = np.array(bpy.data.images.load(scene.render.filepath).pixels).reshape(PIXELS, PIXELS, 4)
    rows, columns = pixels_of(evaluated_points(lit).reshape(-1, 3))
    covered = picture[..., 3] > 0.1
    assert covered[rows, columns].mean() > 0.97
    reference = np.zeros_like(covered)
    reference[rows, columns] = True
    assert not (covered & ~grown(reference)).any()
    assert 0.1 < covered.mean() < 0.9
    assert np.median(picture[covered][:, :3].max(axis=1)) > 0.05


def pixels_of(places):
    """Return rows, from the bottom, and columns of places (N, 3) in the scene's square picture."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    world_to_view, view_to_clip = read_camera(bpy.context.scene, depsgraph, PIXELS, PIXELS)
    clip = np.c_[places, np.ones(len(places))] @ (view_to_clip @ world_to_view).T
    pixels = ((0.5 * clip[:, :2] / clip[:, 3:] + 0.5) * PIXELS).astype(int)
    return pixels[:, 1], pixels[:, 0]


def grown(mask):
    """Return a mask with two more pixels on every side, for strands of two pixels and blurred edges."""
    padded = np.pad(mask, 2)
    shifts = [(y, x) for y in range(5) for x in range(5)]
    return np.any([padded[y : y + PIXELS, x : x + PIXELS] for y, x in shifts], axis=0)
