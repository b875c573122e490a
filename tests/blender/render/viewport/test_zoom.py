# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair seen from increasing distances keeps its brightness and density from the first pass on."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data import scene
from hair_addon.blender.render import drawn_scene
from hair_addon.blender.render.viewport import hair_picture, picture_detail
from tests.support.scenes import even_guides

SIZE = (160, 120)


@pytest.fixture
def locks(lit):
    """Return locks of strands that are thinner than a pixel and hide each other."""
    bpy.context.view_layer.objects.active = bpy.data.objects["Guides"]
    lit.data.vellus.hair.strand_count, lit.data.vellus.hair.radius = 3000, 0.002
    api.set_styles(lit.data, [api.Clump(size=0.15, amount=1.0)])
    bpy.context.view_layer.update()
    return drawn_scene.read(bpy.context.scene, bpy.context.view_layer, bpy.context.evaluated_depsgraph_get())


def seen_from(distances):
    """Return (world to view, view to clip) of an orthographic camera that shows hair as small as from a multiple of
    the distance.
    """
    camera = bpy.context.scene.camera
    camera.data.type, camera.data.ortho_scale = "ORTHO", 4.0 * distances
    bpy.context.view_layer.update()
    return scene.read_camera(bpy.context.scene, bpy.context.evaluated_depsgraph_get(), *SIZE)


def summed(light):
    """Return red, green, blue and coverage, summed over all pixels."""
    return light.sum(axis=(0, 1))


def fine(picture, drawn, camera):
    """Return the mean sums of all passes of pictures with sixteen passes in all, and of sixteen first passes."""
    picture.restart()
    firsts, lasts = [], []
    for _ in range(16):
        picture.add_pass(drawn, *camera)
        firsts.append(summed(picture.read()))
        picture.restart(is_moved=True)  # the next one has other samples
    count = 0
    while count < 16:
        if lasts:
            picture.restart(is_moved=True)
        while not picture.is_fine:
            picture.add_pass(drawn, *camera)
        lasts.append(summed(picture.read()))
        count += picture.pass_count
    return np.mean(lasts, axis=0), np.mean(firsts, axis=0)


@even_guides
def test_small_hair_is_as_bright_and_covers_as_much(locks):
    """Small hair is as bright and covers as much as near hair, in the first and in the last pass, with one sample
    per pixel.
    """
    picture, near = hair_picture.HairPicture(SIZE, 1), None
    for distances in (1.0, 7.5):
        last, first = fine(picture, locks, seen_from(distances))
        near = last if near is None else near
        np.testing.assert_allclose(first, last, rtol=0.02)
        np.testing.assert_allclose(last * distances**2, near, rtol=0.03)


@pytest.mark.long
def test_a_finer_part_of_a_picture_shows_what_the_whole_does(locks, monkeypatch):
    """A finer part of a picture shows the same hair system at each pixel as the whole picture, and nothing beside
    it.
    """
    camera = seen_from(5.0)
    finer = hair_picture.HairPicture(SIZE, 1)
    fine(finer, locks, camera)
    monkeypatch.setattr(picture_detail, "of_hair", lambda *given: picture_detail.whole(*given[2:4]))
    plain = hair_picture.HairPicture(SIZE, 1)
    fine(plain, locks, camera)
    covered = [picture.read()[..., 3] for picture in (finer, plain)]
    assert covered[0].sum() > 20.0
    for axis in (0, 1):
        middles = [np.average(np.arange(SIZE[1 - axis]), weights=of.sum(axis=1 - axis)) for of in covered]
        assert middles[0] == pytest.approx(middles[1], abs=0.5)
    y, x = np.unravel_index(np.argmax(covered[0]), covered[0].shape)
    assert finer.hair_at(int(x), int(y)) == 0
    assert finer.hair_at(3, 3) is None and finer.hair_at(SIZE[0] - 1, SIZE[1] - 1) is None
