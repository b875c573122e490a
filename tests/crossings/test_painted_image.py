# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides follow a painted image when painting is finished."""

import bpy
import numpy as np
import pytest

from tests.support.reading import points

SIDE = 16


@pytest.fixture
def image(sphere):
    """Return a white image that a material of the sphere shows."""
    image = bpy.data.images.new("Density", SIDE, SIDE)
    paint(image, slice(None))
    material = bpy.data.materials.new("Painted")
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    sphere.data.materials.append(material)
    return image


@pytest.fixture
def masked(image):
    """Return guides on the white part of the image; not named `guides`, which would load a file with guides."""
    bpy.ops.vellus.distribute_guides(guide_count=60, length=0.5, density_image="Density")
    bpy.context.view_layer.update()
    return bpy.data.objects["Guides"]


def paint(image, columns, is_reported=True):
    """Paint white columns on black; is_reported: as a stroke or an undo reports the image."""
    pixels = np.zeros((SIDE, SIDE, 4), np.float32)
    pixels[:, columns] = 1.0
    image.pixels.foreach_set(pixels.ravel())
    if is_reported:
        image.update_tag()


def test_guides_leave_what_was_painted_black(masked, image):
    before = points(masked)
    paint(image, slice(0, SIDE // 2))
    bpy.context.view_layer.update()
    after = points(masked)
    assert len(after) == 60 and not np.array_equal(after, before)
    paint(image, slice(None))
    bpy.context.view_layer.update()
    assert np.array_equal(points(masked), before)


@pytest.mark.parametrize("in_viewport", [False, True])
def test_an_image_is_followed_in_a_file_that_was_opened(masked, image, tmp_path, in_viewport):
    image.pack()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "painted.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "painted.blend"))
    masked, image = bpy.data.objects["Guides"], bpy.data.images["Density"]
    before = points(masked)
    bpy.context.view_layer.objects.active = bpy.data.objects["Sphere"]
    if in_viewport:
        bpy.ops.object.mode_set(mode="TEXTURE_PAINT")
    paint(image, slice(0, SIDE // 2), is_reported=not in_viewport)
    if in_viewport:
        bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()
    after = points(masked)
    assert len(after) == 60 and not np.array_equal(after, before)


def test_an_unchanged_image_moves_no_guide(masked, image):
    before, key = points(masked), masked.data.vellus.root_key
    image.update_tag()
    bpy.context.view_layer.update()
    assert np.array_equal(points(masked), before)
    assert masked.data.vellus.root_key == key


def test_guides_wait_until_painting_is_left(masked, image, sphere):
    """Guides wait until painting is left, as Blender need not report an image when a stroke ends in the viewport."""
    before = points(masked)
    bpy.context.view_layer.objects.active = sphere
    bpy.ops.object.mode_set(mode="TEXTURE_PAINT")
    bpy.context.view_layer.update()
    paint(image, slice(0, SIDE // 2), is_reported=False)
    bpy.context.view_layer.update()
    assert np.array_equal(points(masked), before)
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()
    assert not np.array_equal(points(masked), before)


def test_guides_without_auto_update_stay(masked, image):
    masked.data.vellus.is_live = False
    before = points(masked)
    paint(image, slice(0, SIDE // 2))
    bpy.context.view_layer.update()
    assert np.array_equal(points(masked), before)


def test_an_image_painted_black_is_reported_until_it_is_painted_again(masked, image):
    """An image painted black is reported until it is painted again, also for bound hair, which loses no strands."""
    bpy.ops.vellus.interpolate_hair(strand_count=40)
    hair = next(o for o in bpy.data.objects if o.type == "CURVES" and o.data.vellus.kind == "HAIR")
    hair.data.vellus.hair.density_image = "Density"
    bpy.context.view_layer.update()
    before = points(hair)
    assert not hair.data.vellus.status
    for columns, sentence in ((slice(0), "is black"), (slice(None), ""), (slice(0), "is black")):
        paint(image, columns)
        bpy.context.view_layer.update()
        status = hair.data.vellus.status
        assert sentence in status if sentence else not status
        assert np.array_equal(points(hair), before)
