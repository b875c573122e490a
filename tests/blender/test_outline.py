# SPDX-License-Identifier: GPL-3.0-or-later
"""The line around selected hair: where coverage falls below a half, around that hair, nowhere else."""

from types import SimpleNamespace

import bpy
import gpu
import numpy as np
import pytest

from hair_addon.blender import drawn_scene, hair_picture, scene, viewport

SIZE = 96
ORANGE = (0.8, 0.3, 0.1)


@pytest.fixture
def pair(lit):
    """(`DrawnScene`, `HairPicture`) of hair and, beside it, the same again."""
    lit.data.vellus.hair.radius = 0.02
    second = lit.copy()
    bpy.context.scene.collection.objects.link(second)
    second.parent, second.location = None, (2.6, 0.0, 0.0)
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    drawn = drawn_scene.read(bpy.context.scene, bpy.context.view_layer, depsgraph)
    picture = hair_picture.HairPicture(SIZE, SIZE)
    for _ in range(8):
        picture.add_pass(drawn, *scene.read_camera(bpy.context.scene, depsgraph, SIZE, SIZE))
    return drawn, picture


def drawn_on_black(draw):
    """(SIZE, SIZE, 3) of what a function draws."""
    color = gpu.types.GPUTexture((SIZE, SIZE), format="RGBA32F")
    depth = gpu.types.GPUTexture((SIZE, SIZE), format="DEPTH_COMPONENT32F")
    target = gpu.types.GPUFrameBuffer(color_slots=color, depth_slot=depth)
    with target.bind():
        target.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
        draw()
        return np.array(target.read_color(0, 0, SIZE, SIZE, 4, 0, "FLOAT"))[..., :3]


def border(picture):
    """(SIZE, SIZE) bool: less than half covered, beside a pixel that is covered more."""
    covered = np.pad(picture.read()[..., 3] >= 0.5, 1)
    beside = covered[1:-1, :-2] | covered[1:-1, 2:] | covered[:-2, 1:-1] | covered[2:, 1:-1]
    return beside & ~covered[1:-1, 1:-1]


def test_each_outline_is_the_border_of_its_hair(pair):
    _drawn, picture = pair
    lines = [drawn_on_black(lambda index=index: picture.show_outline(index, ORANGE)).any(axis=-1) for index in (0, 1)]
    assert all(line.sum() > 50 for line in lines)
    np.testing.assert_array_equal(lines[0] | lines[1], border(picture))
    left, right = sorted(np.nonzero(line)[1].mean() for line in lines)
    assert right - left > 0.25 * SIZE
    assert (lines[0] & lines[1]).sum() < 0.1 * border(picture).sum()  # where one hangs over the other


def test_what_is_selected_has_its_line_in_the_theme_s_colour(pair):
    drawn, picture = pair
    objects = {o.session_uid: o for o in bpy.data.objects}
    first, second = (objects[uid] for uid in drawn.owners)
    theme = bpy.context.preferences.themes[0].view_3d
    for hair_object in (first, second):
        hair_object.select_set(True)
    bpy.context.view_layer.objects.active = second
    shown = drawn_on_black(lambda: viewport._draw_outlines(bpy.context, drawn, picture, "ALWAYS"))
    alone = drawn_on_black(lambda: picture.show_outline(0, ORANGE)).any(axis=-1)
    other = drawn_on_black(lambda: picture.show_outline(1, ORANGE)).any(axis=-1)
    for line, color in ((alone & ~other, theme.object_selected), (other, theme.object_active)):
        np.testing.assert_allclose(shown[line], np.power(color[:], 2.2) * np.ones((line.sum(), 1)), atol=1e-3)
    bpy.ops.object.select_all(action="DESELECT")
    assert not drawn_on_black(lambda: viewport._draw_outlines(bpy.context, drawn, picture, "ALWAYS")).any()


def test_nothing_is_drawn_for_what_is_no_hair_in_this_view(pair):
    drawn, picture = pair
    bpy.ops.object.select_all(action="DESELECT")
    bpy.data.objects["Sphere"].select_set(True)
    nobody = SimpleNamespace(owners=drawn.owners)
    assert not drawn_on_black(lambda: viewport._draw_outlines(bpy.context, nobody, picture, "ALWAYS")).any()
