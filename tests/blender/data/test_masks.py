# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands use the mask of their guides unless they have their own; changes are followed live."""

import hashlib

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.groom import staleness
from hair_addon.blender.live import stale_marks
from hair_addon.core.grooming import groom
from tests.support.reading import points, vertex_positions, write_points

LOWEST = -0.2  # of roots in the group `top`: a ring of faces below its border, where its weight runs out


@pytest.fixture
def masked(sphere):
    """Return (guides, hair): 40 guides on the upper half of the sphere and 300 strands between them."""
    bpy.ops.vellus.add_hair(guide_count=40, strand_count=300, density_group="top")
    return bpy.data.objects["Hair Guides"], bpy.data.objects["Hair"]


@pytest.fixture
def image(sphere):
    """Return an image that is white in a part of the sphere's UV map: U from an eighth to a half."""
    image = bpy.data.images.new("Mask", 32, 32, float_buffer=True)
    pixels = np.zeros((32, 32, 4), np.float32)
    pixels[:, 4:16] = 1.0
    image.pixels.foreach_set(pixels.ravel())
    material = bpy.data.materials.new("Painted")  # Blender reports changes of images that a material shows
    material.node_tree.nodes.new("ShaderNodeTexImage").image = image
    sphere.data.materials.append(material)
    return image


def lowest(curves_object):
    return points(curves_object)[:, 0, 2].min()


def add_group(name, chosen):
    """Add a vertex group of the vertices of the sphere that chosen(positions) marks."""
    sphere = bpy.data.objects["Sphere"]
    group = sphere.vertex_groups.new(name=name)
    group.add([int(i) for i in np.flatnonzero(chosen(vertex_positions(sphere)))], 1.0, "REPLACE")
    bpy.context.view_layer.update()  # so that what follows from the group does not follow from the edit of the mesh


def set_setting(group, name, value):
    setattr(group, name, value)
    bpy.context.view_layer.update()


WAYS = {
    "operators": lambda: (
        bpy.ops.vellus.distribute_guides(guide_count=40, density_group="top"),
        bpy.ops.vellus.interpolate_hair(strand_count=300),
    ),
    "one operator": lambda: bpy.ops.vellus.add_hair(guide_count=40, strand_count=300, density_group="top"),
    "script": lambda: api.interpolate_hair(
        api.distribute_guides(bpy.context.object, guide_count=40, density_group="top"), strand_count=300
    ),
    "script in one step": lambda: api.add_hair(
        bpy.context.object,
        api.GroomSettings(api.GuideSettings(guide_count=40, density_group="top"), api.HairSettings(strand_count=300)),
    ),
}


@pytest.mark.parametrize("way", WAYS)
def test_no_root_is_outside_the_mask_of_the_guides(sphere, way):
    WAYS[way]()
    hair = bpy.data.objects["Hair"]
    guides = next(o for o in bpy.data.objects if o.data == hair.data.vellus.guide_curves)
    assert lowest(guides) > LOWEST and lowest(hair) > LOWEST
    assert bpy.data.objects["Hair"].data.vellus.hair.density_group == ""


def test_a_group_of_the_strands_alone_wins(masked):
    guides, hair = masked
    add_group("low", lambda positions: positions[:, 2] < -0.3)
    set_setting(hair.data.vellus.hair, "density_group", "low")
    assert points(hair)[:, 0, 2].max() < 0.0 and lowest(guides) > LOWEST
    set_setting(hair.data.vellus.hair, "density_group", "")
    assert lowest(hair) > LOWEST


def test_another_mask_of_the_guides_moves_both(masked):
    guides, _hair = masked
    add_group("right", lambda positions: positions[:, 0] > 0.0)
    set_setting(guides.data.vellus.guides, "density_group", "right")
    for one in masked:
        assert points(one)[:, 0, 0].min() > LOWEST and lowest(one) < -0.5
    set_setting(guides.data.vellus.guides, "density_group", "")
    for one in masked:
        assert points(one)[:, 0, 0].min() < -0.5


def test_strands_follow_the_mask_of_guides_that_were_combed(masked):
    guides, hair = masked
    combed = points(guides)
    combed[:, 1:] += (0.0, 0.0, 0.05)
    write_points(guides, combed)
    add_group("right", lambda positions: positions[:, 0] > 0.0)
    set_setting(guides.data.vellus.guides, "density_group", "right")
    np.testing.assert_array_equal(points(guides), combed)
    assert points(hair)[:, 0, 0].min() > LOWEST and lowest(hair) < -0.5


def test_painting_the_mask_of_the_guides_moves_the_strands(masked):
    _guides, hair = masked
    sphere = bpy.data.objects["Sphere"]
    before = points(hair)
    positions = vertex_positions(sphere)
    sphere.vertex_groups["top"].remove([int(i) for i in np.flatnonzero(positions[:, 0] < 0.0)])
    sphere.data.update()
    bpy.context.view_layer.update()
    assert not np.array_equal(points(hair), before)
    for one in masked:
        assert points(one)[:, 0, 0].min() > LOWEST


def test_a_setting_that_is_no_mask_moves_no_root(masked):
    guides, hair = masked
    before = points(hair)[:, 0].copy()
    set_setting(guides.data.vellus.guides, "length", 0.9)
    np.testing.assert_array_equal(points(hair)[:, 0], before)


def test_strands_take_the_image_of_their_guides(masked, image):
    guides, hair = masked
    set_setting(guides.data.vellus.guides, "density_image", "Mask")
    root_uvs = np.empty((300, 2), np.float32)
    hair.data.attributes["surface_uv_coordinate"].data.foreach_get("vector", root_uvs.ravel())
    pixel = 1.0 / 32.0  # it is linear between pixels
    assert ((root_uvs[:, 0] > 0.125 - pixel) & (root_uvs[:, 0] < 0.5 + pixel)).all()
    assert lowest(hair) > LOWEST
    set_setting(hair.data.vellus.hair, "density_group", "top")  # a group of their own stands alone
    hair.data.attributes["surface_uv_coordinate"].data.foreach_get("vector", root_uvs.ravel())
    assert (root_uvs[:, 0] > 0.6).any()


def test_painting_the_image_of_the_guides_moves_the_strands(masked, image):
    guides, hair = masked
    set_setting(guides.data.vellus.guides, "density_image", "Mask")
    before = points(hair)[:, 0].copy()
    assert hair.data.vellus.status == ""
    image.pixels.foreach_set(np.ones(32 * 32 * 4, np.float32))
    image.update_tag()
    bpy.context.view_layer.update()
    assert not np.array_equal(points(hair)[:, 0], before)


def test_guides_without_a_mask_leave_the_whole_surface(sphere):
    bpy.ops.vellus.distribute_guides(guide_count=40)
    bpy.ops.vellus.interpolate_hair(strand_count=300)
    assert lowest(bpy.data.objects["Hair"]) < -0.8


def test_a_missing_mask_is_reported_and_hair_is_kept(masked):
    _guides, hair = masked
    before = points(hair)
    sphere = bpy.data.objects["Sphere"]
    sphere.vertex_groups.remove(sphere.vertex_groups["top"])
    hair.data.vellus.hair.strand_count = 200
    bpy.context.view_layer.update()
    assert "no vertex group" in hair.data.vellus.status
    np.testing.assert_array_equal(points(hair), before)


def root_u(hair):
    """Return (S,) positions of roots along the width of the UV map."""
    uvs = np.empty((len(hair.data.curves), 2), np.float32)
    hair.data.attributes["surface_uv_coordinate"].data.foreach_get("vector", uvs.ravel())
    return uvs[:, 0]


PIXEL = 1.0 / 32.0  # the image is linear between pixels


def is_in_image(hair):
    return (root_u(hair) > 0.125 - PIXEL) & (root_u(hair) < 0.5 + PIXEL)


def test_an_image_of_the_strands_alone_wins(masked, image):
    guides, hair = masked
    before = points(guides)
    set_setting(hair.data.vellus.hair, "density_image", "Mask")
    assert is_in_image(hair).all() and lowest(hair) < -0.5  # the guides' group does not hold
    np.testing.assert_array_equal(points(guides), before)
    set_setting(hair.data.vellus.hair, "density_group", "top")
    assert is_in_image(hair).all() and lowest(hair) > LOWEST
    set_setting(hair.data.vellus.hair, "density_group", "")
    set_setting(hair.data.vellus.hair, "density_image", "")
    assert not is_in_image(hair).all() and lowest(hair) > LOWEST


@pytest.mark.parametrize("is_cached", [True, False])
def test_painting_the_image_of_the_strands_moves_them_when_it_is_left(masked, image, is_cached):
    guides, hair = masked
    sphere = bpy.data.objects["Sphere"]
    set_setting(hair.data.vellus.hair, "density_image", "Mask")
    before, guides_before = points(hair), points(guides)
    bpy.context.view_layer.objects.active = sphere
    bpy.ops.object.mode_set(mode="TEXTURE_PAINT")
    bpy.context.view_layer.update()
    pixels = np.zeros((32, 32, 4), np.float32)
    pixels[:, 20:28] = 1.0
    image.pixels.foreach_set(pixels.ravel())
    if is_cached:  # Blender need not report an image before the mode is left
        image.update_tag()
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(points(hair), before)
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()
    assert (root_u(hair) > 20 * PIXEL - PIXEL).all() and (root_u(hair) < 28 * PIXEL + PIXEL).all()
    np.testing.assert_array_equal(points(guides), guides_before)


@pytest.mark.parametrize("of", ["guides", "hair"])
def test_an_image_that_is_updated_unchanged_moves_no_strand(masked, image, of):
    """An image that is updated with the same pixels moves no strand, also on a surface scaled since hair was made."""
    guides, hair = masked
    masking = guides.data.vellus.guides if of == "guides" else hair.data.vellus.hair
    set_setting(masking, "density_group", "")
    set_setting(masking, "density_image", "Mask")
    bpy.data.objects["Sphere"].scale = (-1.0, -1.0, -0.01)  # undo reports images that it did not change
    bpy.context.view_layer.update()
    before, guides_before = points(hair), points(guides)
    image.update_tag()
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(points(guides), guides_before)
    np.testing.assert_array_equal(points(hair), before)


def test_hand_made_guides_take_the_image_of_their_strands(imported, image):
    sphere = bpy.data.objects["Sphere"]
    bpy.context.view_layer.objects.active = imported
    sphere.select_set(False)
    assert bpy.ops.vellus.use_as_guides(surface="Sphere", strand_count=200, density_image="Mask") == {"FINISHED"}
    hair = next(o for o in bpy.data.objects if o.type == "CURVES" and o.data.vellus.kind == "HAIR")
    assert len(hair.data.curves) == 200 and is_in_image(hair).all()
    assert not sphere.vertex_groups[1:]  # the image is a mask: no group is painted
    before = points(hair)
    bpy.context.view_layer.update()
    set_setting(hair.data.vellus.hair, "keep_length", 0.5)
    np.testing.assert_array_equal(points(hair)[:, 0], before[:, 0])


def test_keys_of_roots_tell_settings_from_what_is_painted():
    """The key of roots changes when the image that masks them is painted, and is unchanged without an image."""
    settings = groom.HairSettings(strand_count=7)
    placing = repr([1, None, None, None, None, None, 7])
    assert staleness.root_key(settings, None) == "".join(
        hashlib.blake2b(data, digest_size=8).hexdigest() for data in (placing.encode(), b"")
    )


@pytest.fixture
def curls(masked, image):
    """Return hair whose curls have a mask image, on a surface that was scaled since."""
    hair = masked[1].data
    api.add_style(hair, "CURL", radius=0.05, mask_image="Mask")
    bpy.context.view_layer.update()
    bpy.data.objects["Sphere"].scale = (-1.0, -1.0, -0.01)
    bpy.context.view_layer.update()
    return masked[1]


def test_an_image_of_a_style_that_is_updated_unchanged_moves_no_strand(curls, image):
    """An image that masks a style moves strands when it is painted, and none when it is updated unchanged."""
    before = points(curls)
    image.update_tag()
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(points(curls), before)
    image.pixels.foreach_set(np.ones(32 * 32 * 4, np.float32))
    image.update()
    image.update_tag()
    bpy.context.view_layer.update()
    assert not np.array_equal(points(curls), before)


def test_images_do_not_mark_hair_whose_status_is_about_maps(masked, image, monkeypatch):
    """A status about a map without a source is no reason to regenerate hair when an image is updated."""
    guides, hair = masked
    set_setting(guides.data.vellus.guides, "density_group", "")
    set_setting(hair.data.vellus.hair, "density_image", "Mask")
    api.set_map(hair, "strands.thickness", "group:lost")
    bpy.context.view_layer.update()
    assert "lost" in hair.data.vellus.status
    stale, follow = [], stale_marks.follow_images
    monkeypatch.setattr(
        stale_marks,
        "follow_images",
        lambda target, depsgraph: (follow(target, depsgraph), stale.append(target.vellus.is_stale)),
    )
    image.update_tag()
    bpy.context.view_layer.update()
    assert stale == [False]
