# SPDX-License-Identifier: GPL-3.0-or-later
"""In Cycles each strand has the same absorption along its length as in the viewport."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.maps import strand_maps
from hair_addon.blender.data.strands import attributes
from hair_addon.blender.materials import strand_nodes
from hair_addon.core.shading import appearance, strand_looks
from hair_addon.core.shading.appearance import Appearance
from hair_addon.core.shading.fibre import strand_variation

# Curves of evenly spaced points, side by side, upright in front of a camera that sees as many columns of pixels.
STRAND_COUNT, POINT_COUNT, HEIGHT = 12, 9, 24

LOOKS = {
    "dyed": {"melanin": 0.3, "tip_absorption": 0.4, "tip_tint": (0.8, 0.1, 0.4), "gradient_start": 0.2},
    "random": {"melanin": 0.6, "redness": 0.3, "random_color": 1.0, "tint": (0.9, 0.6, 0.7)},
    "black": {"melanin": 1.0, "random_color": 0.5},
    "no melanin": {"parametrization": "COLOR", "color": (0.5, 0.3, 0.2), "random_color": 0.7, "tip_absorption": 3.0},
    "step": {"tip_absorption": 5.0, "gradient_start": 0.5, "gradient_end": 0.5},
}


@pytest.fixture
def patch(scene):
    """Return a Curves object of flat strands with random numbers, its camera, and Cycles."""
    curves = bpy.data.hair_curves.new("Patch")
    curves.add_curves([POINT_COUNT] * STRAND_COUNT)
    curves.set_types(type="POLY")
    x, z = np.meshgrid(np.arange(STRAND_COUNT) + 0.5, np.linspace(0.0, HEIGHT, POINT_COUNT), indexing="ij")
    places = np.stack([x, np.zeros_like(x), z], axis=-1).astype(np.float32)
    curves.attributes["position"].data.foreach_set("vector", places.ravel())
    radius = curves.attributes.new("radius", "FLOAT", "POINT")
    radius.data.foreach_set("value", np.full(x.size, 0.5, np.float32))
    number = curves.attributes.new("strand_random", "FLOAT", "CURVE")
    number.data.foreach_set("value", np.linspace(0.0, 1.0, STRAND_COUNT, dtype=np.float32))
    strands = bpy.data.objects.new("Patch", curves)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", HEIGHT
    camera.location, camera.rotation_euler = (STRAND_COUNT / 2, -5.0, HEIGHT / 2), (np.pi / 2, 0.0, 0.0)
    for new in (strands, camera):
        scene.collection.objects.link(new)
    scene.camera = camera
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 64, False
    scene.cycles_curves.shape, scene.cycles.pixel_filter_type = "RIBBONS", "BOX"
    scene.render.resolution_x, scene.render.resolution_y = STRAND_COUNT, HEIGHT
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    return strands


def emission_of(material):
    """Replace a material's hair by an emission, and return the emission's color socket."""
    tree = material.node_tree
    emission = tree.nodes.new("ShaderNodeEmission")
    output = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeOutputMaterial" and node.target == "ALL")
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    return emission.inputs["Color"]


def render(tmp_path):
    """Return (HEIGHT, STRAND_COUNT, 3) linear values, rows from the roots up."""
    scene = bpy.context.scene
    scene.render.filepath = str(tmp_path / "patch.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath, check_existing=False)
    pixels = np.empty(HEIGHT * STRAND_COUNT * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(HEIGHT, STRAND_COUNT, 4)[..., :3]


def varied_material(look):
    material = bpy.data.materials.new("Varied")
    material.node_tree.nodes.clear()
    node = material.node_tree.nodes.new("ShaderNodeBsdfHairPrincipled")
    node.model, node.parametrization = "CHIANG", "ABSORPTION"
    output = material.node_tree.nodes.new("ShaderNodeOutputMaterial")
    material.node_tree.links.new(node.outputs[0], output.inputs["Surface"])
    falloff = appearance.kajiya_kay_strand_settings(look).falloff
    strand_nodes.write(material.node_tree, node, appearance.strand_settings(look), falloff)
    return material, node


@pytest.mark.parametrize("name", LOOKS)
def test_nodes_compute_the_strands_absorption(patch, tmp_path, name):
    """Cycles shows the values at the absorption socket for every strand and height."""
    look = Appearance(**LOOKS[name])
    material, node = varied_material(look)
    patch.data.materials.append(material)
    source = node.inputs["Absorption Coefficient"].links[0].from_socket
    material.node_tree.links.new(source, emission_of(material))
    found = render(tmp_path)
    random = np.linspace(0.0, 1.0, STRAND_COUNT)
    position = (np.arange(16 * HEIGHT) + 0.5) / (16 * HEIGHT)
    expected = strand_variation.strand_sigma_a(appearance.strand_settings(look), random, position[:, None])
    expected = expected.reshape(HEIGHT, 16, STRAND_COUNT, 3).mean(axis=1)  # over each pixel's height
    np.testing.assert_allclose(found, expected, rtol=5e-3, atol=2e-3 * expected.max())


def test_nodes_compute_the_looks_of_maps(patch, tmp_path):
    """Cycles shows the absorption that maps give each strand, from root to tip, and its roughness; EEVEE its color."""
    look = Appearance(tip_absorption=0.4, random_color=0.5, gradient_start=0.2, roughness=0.4)
    random = np.linspace(0.0, 1.0, STRAND_COUNT)
    varied = {"melanin": np.linspace(0.1, 0.9, STRAND_COUNT), "roughness": np.linspace(0.1, 0.9, STRAND_COUNT)}
    varied["radial_roughness"] = np.linspace(0.9, 0.1, STRAND_COUNT)
    looks = strand_looks.strand_looks(look, varied, random)
    kinds = ("FLOAT_VECTOR", "FLOAT_VECTOR", "FLOAT", "FLOAT")
    names = (strand_maps.ROOT, strand_maps.TIP, strand_maps.ROUGHNESS, strand_maps.RADIAL)
    every = looks.root, looks.tip, looks.roughness, looks.radial
    for name, kind, values in zip(names, kinds, every, strict=True):
        attributes.write(patch.data, name, kind, "CURVE", values)
    assert strand_maps.read_looks(patch.data).is_same(looks)
    material, node = varied_material(look)
    node.inputs["Roughness"].default_value = look.roughness
    variation, falloff = appearance.strand_settings(look), appearance.kajiya_kay_strand_settings(look).falloff
    color = strand_nodes.write(material.node_tree, node, variation, falloff, is_mapped=True, is_radial=True)
    patch.data.materials.append(material)
    socket = emission_of(material)
    position = (np.arange(16 * HEIGHT) + 0.5) / (16 * HEIGHT)
    sigma_a = looks.sigma_a(strand_looks.gradient_of(look, position)[None]).transpose(1, 0, 2)
    expected = sigma_a.reshape(HEIGHT, 16, STRAND_COUNT, 3).mean(axis=1)
    rough = varied["roughness"][None, :, None]
    radial = varied["radial_roughness"][None, :, None]
    colors = strand_looks.colors_of(look, looks, looks.sigma_a(strand_looks.gradient_of(look, position)[None]))
    colors = colors.transpose(1, 0, 2).reshape(HEIGHT, 16, STRAND_COUNT, 3).mean(axis=1)
    sources = [node.inputs[name].links[0].from_socket for name in ("Absorption Coefficient", "Roughness")]
    sources += [node.inputs["Radial Roughness"].links[0].from_socket, color]
    for source, wanted in zip(sources, (expected, rough, radial, colors), strict=True):
        material.node_tree.links.new(source, socket)
        found = render(tmp_path)
        np.testing.assert_allclose(found, np.broadcast_to(wanted, found.shape), rtol=5e-3, atol=2e-3 * wanted.max())


def test_a_dyed_part_looks_as_a_plain_node_of_that_absorption(patch, tmp_path):
    """In path-traced pictures, dyed tips look like a plain hair node with the same absorption."""
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("World")
    background = next(node for node in scene.world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    look = Appearance(melanin=0.3, tip_absorption=2.0, tip_tint=(0.9, 0.05, 0.2), gradient_end=0.5)
    material, node = varied_material(look)
    patch.data.materials.append(material)
    varied = render(tmp_path)
    strand_nodes.remove(material.node_tree)
    assert not node.inputs["Absorption Coefficient"].is_linked
    variation = appearance.strand_settings(look)
    for rows, position in ((slice(0, 4), 0.0), (slice(16, 24), 1.0)):
        node.inputs["Absorption Coefficient"].default_value = strand_variation.strand_sigma_a(variation, 0.5, position)
        plain = render(tmp_path)[rows]
        np.testing.assert_allclose(varied[rows].mean(axis=(0, 1)), plain.mean(axis=(0, 1)), rtol=0.03, atol=0.003)


# Ours and an artist's


def tree_of(hair):
    return hair.data.materials[0].node_tree


def hair_node(hair):
    return next(node for node in tree_of(hair).nodes if node.bl_idname == "ShaderNodeBsdfHairPrincipled")


def set_look(hair, **changes):
    for name, value in changes.items():
        setattr(hair.data.vellus.appearance, name, value)
    bpy.context.view_layer.update()


def is_linked(hair):
    return hair_node(hair).inputs["Absorption Coefficient"].is_linked


def test_even_hair_keeps_the_plain_node(hair):
    plain = len(tree_of(hair).nodes)
    for changes in ({"random_color": 0.3}, {"tip_absorption": 0.5}, {"random_roughness": 0.2}):
        set_look(hair, **changes)
        assert is_linked(hair) and len(tree_of(hair).nodes) > plain
        set_look(hair, random_color=0.0, tip_absorption=1.0, random_roughness=0.0)
        assert not is_linked(hair) and len(tree_of(hair).nodes) == plain


def test_a_changed_look_fills_the_nodes_that_are_there(hair):
    set_look(hair, random_color=0.3)
    before = set(tree_of(hair).nodes)
    set_look(hair, tip_absorption=0.25, melanin=0.5)
    assert set(tree_of(hair).nodes) == before
    assert tree_of(hair).nodes["Vellus Tip"].inputs[1].default_value == -0.75


def test_damaged_nodes_are_built_again(hair):
    set_look(hair, random_color=0.3)
    count = len(tree_of(hair).nodes)
    tree_of(hair).nodes.remove(tree_of(hair).nodes["Vellus Absorption"])
    set_look(hair, random_color=0.4)
    assert len(tree_of(hair).nodes) == count and is_linked(hair)


def test_an_artist_s_own_material_is_left_alone(hair):
    material = bpy.data.materials.new("Own")
    material.node_tree.nodes.clear()
    node = material.node_tree.nodes.new("ShaderNodeBsdfHairPrincipled")
    hair.data.materials[0] = material
    set_look(hair, random_color=0.5, roughness=0.7)
    assert node.inputs["Roughness"].default_value == pytest.approx(0.3)
    assert len(material.node_tree.nodes) == 1


def test_an_artist_s_own_link_is_left_alone(hair):
    texture = tree_of(hair).nodes.new("ShaderNodeTexNoise")
    tree_of(hair).links.new(texture.outputs["Color"], hair_node(hair).inputs["Absorption Coefficient"])
    set_look(hair, random_color=0.5)
    assert hair_node(hair).inputs["Absorption Coefficient"].links[0].from_node == texture
    assert hair_node(hair).inputs["Random"].links[0].from_node.name == "Vellus Random"


def test_strands_without_numbers_get_them_with_a_look_that_needs_them(hair):
    hair.data.attributes.remove(hair.data.attributes["strand_random"])
    set_look(hair, random_color=0.5)
    numbers = np.array([value.value for value in hair.data.attributes["strand_random"].data])
    assert len(np.unique(numbers)) > 0.9 * len(numbers)
    assert 0.0 <= numbers.min() < 0.1 and 0.9 < numbers.max() < 1.0
