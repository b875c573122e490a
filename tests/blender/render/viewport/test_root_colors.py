# SPDX-License-Identifier: GPL-3.0-or-later
"""With the color types Attribute and Texture, hair has the colors of its surface at the roots."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.pictures import root_colors
from hair_addon.blender.live import events
from hair_addon.blender.render import hair_cache
from tests.blender.render.viewport.test_shading_modes import ball, facing, mean_of, picture_of, read, solid  # noqa: F401

ABOVE, BELOW = (0.8, 0.1, 0.1), (0.1, 0.2, 0.8)


def surface():
    return bpy.data.objects["Hair"].data.surface


def root_positions():
    """Return (S, 3) first points of strands, in the surface's coordinates."""
    strands = hair_cache.strands_on_gpu(bpy.data.objects["Hair"].data)
    return strands.points[:, 0]


def color_attribute(domain, kind="FLOAT_COLOR"):
    """Return a color attribute with one color above the middle of the surface and another below."""
    mesh = surface().data
    attribute = mesh.color_attributes.new("Color", kind, domain)
    vertices = (
        range(len(mesh.vertices)) if domain == "POINT" else [mesh.loops[i].vertex_index for i in range(len(mesh.loops))]
    )
    colors = [(*(ABOVE if mesh.vertices[v].co.z > 0.0 else BELOW), 1.0) for v in vertices]
    attribute.data.foreach_set("color", np.array(colors, np.float32).ravel())
    mesh.color_attributes.active_color = attribute
    mesh.update()
    bpy.context.view_layer.update()


def image_material(size=(8, 8), extension="REPEAT"):
    """Return a material whose active image is red to the right of the middle and blue to the left."""
    image = bpy.data.images.new("Image", *size, float_buffer=True)
    pixels = np.ones((size[1], size[0], 4), np.float32)
    pixels[..., :3] = BELOW
    pixels[:, size[0] // 2 :, :3] = ABOVE
    image.pixels.foreach_set(pixels.ravel())
    material = bpy.data.materials.new("Skin")
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image, node.extension = image, extension
    material.node_tree.nodes.active = node
    surface().data.materials.clear()
    surface().data.materials.append(material)
    return image, material, node


def at_roots(kind):
    hair = bpy.data.objects["Hair"]
    strands = hair_cache.strands_on_gpu(hair.data)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return root_colors.at_roots(hair, depsgraph, kind, hair_cache.places_of(hair.data), strands.points[:, 0])


@pytest.mark.parametrize(
    ("domain", "kind"), [("POINT", "FLOAT_COLOR"), ("CORNER", "FLOAT_COLOR"), ("POINT", "BYTE_COLOR")]
)
def test_a_color_attribute_is_interpolated_at_roots(ball, domain, kind):  # noqa: F811
    color_attribute(domain, kind)
    colors = at_roots("VERTEX")
    height = root_positions()[:, 2]
    atol = 0.01 if kind == "BYTE_COLOR" else 1e-6
    top, bottom = height > 0.5 * height.max(), height < 0.5 * height.min()
    assert top.sum() > 20 and bottom.sum() > 20
    np.testing.assert_allclose(colors[top], np.broadcast_to(ABOVE, (top.sum(), 3)), atol=atol)
    np.testing.assert_allclose(colors[bottom], np.broadcast_to(BELOW, (bottom.sum(), 3)), atol=atol)


def test_an_image_is_looked_up_at_the_uv_of_roots(ball):  # noqa: F811
    """Hair has an image's color at the UV coordinates of roots, interpolated linearly, or of the closest texel with
    Closest.
    """
    _image, _material, node = image_material()
    node.interpolation = "Closest"
    bpy.context.view_layer.update()
    colors = at_roots("TEXTURE")
    uvs = np.empty((len(colors), 2), np.float32)
    bpy.data.objects["Hair"].data.attributes["surface_uv_coordinate"].data.foreach_get("vector", uvs.ravel())
    is_right = uvs[:, 0] % 1.0 > 0.5
    clear = np.abs(uvs[:, 0] % 1.0 - 0.5) > 1e-4
    assert 0.2 < is_right.mean() < 0.8
    expected = np.where(is_right[:, None], ABOVE, BELOW)
    np.testing.assert_allclose(colors[clear], expected[clear], atol=1e-6)


def test_a_changed_node_is_followed_without_a_change_of_its_image(ball):  # noqa: F811
    """A changed interpolation of the image node changes the colors of roots between texels, although the image is
    the same.
    """
    _image, _material, node = image_material()
    colors = []
    for interpolation in ("Linear", "Closest", "Linear"):
        node.interpolation = interpolation
        bpy.context.view_layer.update()
        colors.append(at_roots("TEXTURE"))
    assert np.abs(colors[1] - colors[0]).max() > 0.01
    np.testing.assert_array_equal(colors[2], colors[0])


def test_images_extend_as_their_nodes_say():
    pixels = np.zeros((1, 4, 3), np.float32)
    pixels[0, :, 0] = (1.0, 2.0, 3.0, 4.0)
    uvs = np.stack([(np.arange(-4, 8) + 0.5) / 4.0, np.full(12, 0.5)], axis=1)
    rows = {
        "REPEAT": [1, 2, 3, 4] * 3,
        "EXTEND": [1] * 4 + [1, 2, 3, 4] + [4] * 4,
        "MIRROR": [4, 3, 2, 1, 1, 2, 3, 4, 4, 3, 2, 1],
    }
    for extension, row in rows.items():
        for is_closest in (True, False):
            found = root_colors.look_up(pixels, uvs, extension, is_closest)
            np.testing.assert_allclose(found[:, 0], row, atol=1e-6, err_msg=extension)
    between = root_colors.look_up(pixels, np.array([[0.25, 0.5]]), "EXTEND", False)
    assert between[0, 0] == pytest.approx(1.5)


@pytest.mark.parametrize("kind", ["VERTEX", "TEXTURE"])
def test_hair_shows_the_colors_of_its_surface(ball, kind):  # noqa: F811
    """Uniform colors look as in Single; without attribute or UV map the look is shown; redraws add no texture."""
    camera = facing()
    solid(ball, light="FLAT", color_type="MATERIAL")
    by_look = picture_of(read(ball, camera)[0], camera)
    ball.shading.color_type = kind
    mesh = surface().data
    if kind == "TEXTURE":
        maps = [layer.name for layer in mesh.uv_layers]
        uvs = {name: np.empty(2 * len(mesh.loops), np.float32) for name in maps}
        for name in maps:
            mesh.uv_layers[name].uv.foreach_get("vector", uvs[name])
        for name in maps:
            mesh.uv_layers.remove(mesh.uv_layers[name])
        mesh.update()
        bpy.context.view_layer.update()
        np.testing.assert_array_equal(picture_of(read(ball, camera)[0], camera), by_look)
        for name in maps:
            mesh.uv_layers.new(name=name).uv.foreach_set("vector", uvs[name])
        image, _material, _node = image_material()
        image.pixels.foreach_set(np.tile(np.float32((*ABOVE, 1.0)), 64))
    else:
        np.testing.assert_array_equal(picture_of(read(ball, camera)[0], camera), by_look)
        color_attribute("CORNER")
        mesh.color_attributes["Color"].data.foreach_set("color", np.tile(np.float32((*ABOVE, 1.0)), len(mesh.loops)))
        mesh.update()
    events.image_changed()
    bpy.context.view_layer.update()
    drawn = read(ball, camera)[0]
    shown = picture_of(drawn, camera)
    assert read(ball, camera)[0].hair[0][1] is drawn.hair[0][1]
    ball.shading.color_type, ball.shading.single_color = "SINGLE", ABOVE
    np.testing.assert_allclose(shown, picture_of(read(ball, camera)[0], camera), atol=2e-3)
    np.testing.assert_allclose(
        mean_of(shown), ABOVE, rtol=0.5
    )  # a surface of Workbench in even light has this radiance
