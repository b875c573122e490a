# SPDX-License-Identifier: GPL-3.0-or-later
"""The material of partly wet hair mixes two looks by each strand's wetness; other hair has one look."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.strands import attributes, curves
from hair_addon.blender.materials import materials, wet_nodes
from hair_addon.blender.settings import style_items
from hair_addon.core.shading import appearance
from hair_addon.core.shading.appearance import Appearance
from hair_addon.core.styling import wet

WATER = ("Roughness", "Coat", "IOR", "Offset")


def nodes_of(hair):
    """Return (hair node of the driest look, of the wettest look, the mix), None where there is no node."""
    nodes = [*hair.data.materials[0].node_tree.nodes]
    of_hair = [node for node in nodes if node.bl_idname == materials.HAIR_NODE]
    driest, *wettest = sorted(of_hair, key=wet_nodes.is_ours)
    mixes = [node for node in nodes if node.bl_idname == "ShaderNodeMixShader"]
    assert len(wettest) == len(mixes) < 2
    return driest, *(wettest or [None]), *(mixes or [None])


def sockets(node):
    found = {socket.identifier: socket.default_value for socket in node.inputs}
    return [found[name] for name in WATER]


def sockets_of(look):
    found = appearance.principled_sockets(look)
    return [found[name] for name in WATER]


def source(socket):
    return socket.links[0].from_node


def soak(hair, *styles):
    style_items.assign(hair.data.vellus, [wet.Settings(**{"lock": 0.3} | style) for style in styles])
    bpy.context.view_layer.update()


def test_two_looks_are_mixed_by_the_attribute(hair):
    hair.data.vellus.appearance.wetness = 0.25
    soak(hair, {"amount": 0.75, "mask": "top"})
    driest, wettest, mix = nodes_of(hair)
    np.testing.assert_allclose(sockets(driest), sockets_of(Appearance(wetness=0.25)), rtol=1e-6)
    np.testing.assert_allclose(sockets(wettest), sockets_of(Appearance(wetness=0.75)), rtol=1e-6)
    share, low, high = mix.inputs
    assert (source(low), source(high)) == (driest, wettest)
    output = next(n for n in hair.data.materials[0].node_tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    assert source(output.inputs["Surface"]) == mix
    ranges = source(share)
    assert (ranges.inputs["From Min"].default_value, ranges.inputs["From Max"].default_value) == (0.25, 0.75)
    assert source(ranges.inputs["Value"]).attribute_name == "wetness"
    assert hair.data.attributes["wetness"].domain == "CURVE"


def test_the_second_look_goes_with_the_mask(hair):
    """Without the mask, the nodes of the material are as before, even if an artist has inserted a node."""
    tree = hair.data.materials[0].node_tree
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    own = tree.nodes.new("ShaderNodeMixShader")
    own.name = "Own"
    tree.links.new(nodes_of_own(tree).outputs["BSDF"], own.inputs[1])
    tree.links.new(own.outputs[0], output.inputs["Surface"])
    before, count = links(tree), len(tree.nodes)
    soak(hair, {"vary": 0.5})
    assert source(own.inputs[1]).bl_idname == "ShaderNodeMixShader" and len(tree.nodes) == count + 4
    soak(hair, {"vary": 0.5}, {"amount": 1.0, "seed": 1})
    assert links(tree) == before
    soak(hair)
    assert links(tree) == before


def nodes_of_own(tree):
    return next(n for n in tree.nodes if n.bl_idname == materials.HAIR_NODE)


def links(tree):
    return {(link.from_node.name, link.to_node.name, link.to_socket.identifier) for link in tree.links}


def test_both_looks_vary_between_strands(hair):
    hair.data.vellus.appearance.random_color = 0.4
    soak(hair, {"mask": "top"})
    for node in nodes_of(hair)[:2]:
        found = {socket.identifier: socket for socket in node.inputs}
        assert found["Absorption Coefficient"].is_linked and found["Random"].is_linked


def test_keyed_water_is_mixed_in_each_frame(hair):
    soak(hair, {"mask": "top"})
    for frame, amount in ((1, 0.0), (11, 1.0)):
        hair.data.vellus.styles[0].wet.amount = amount
        hair.data.keyframe_insert("vellus.styles[0].wet.amount", frame=frame)
    for frame in (1, 5, 11, 1):
        bpy.context.scene.frame_set(frame)
        amount = hair.data.vellus.styles[0].wet.amount
        driest, wettest, _mix = nodes_of(hair)
        np.testing.assert_allclose(sockets(driest), sockets_of(Appearance()), rtol=1e-6)
        assert (wettest is not None) == (amount > 0.0) == curves.has_wetness(hair.data)
        if wettest is not None:
            np.testing.assert_allclose(sockets(wettest), sockets_of(Appearance(wetness=amount)), rtol=1e-5)
            assert curves.read_wetness(hair.data).max() == pytest.approx(amount, rel=1e-6)


def test_hair_that_shares_a_material_gets_its_own_where_it_is_wet(hair):
    copy = hair.copy()
    copy.data = hair.data.copy()
    bpy.context.scene.collection.objects.link(copy)
    soak(copy, {"mask": "top"})
    assert nodes_of(copy)[1] is not None and nodes_of(hair)[1] is None


def test_the_wet_side_is_darker_in_cycles(lit, tmp_path):
    """The dry side equals dry hair, the wet side equals completely soaked hair."""
    soak(lit, {"mask": "top"})
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 24, False
    scene.render.resolution_x = scene.render.resolution_y = 32
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    bpy.data.objects["Sphere"].is_holdout = True
    is_right = curves.first_points(lit.data)[:, 0] > 0.0
    dry, half, soaked = (
        rendered_light(lit, tmp_path, part) for part in (0.0 * is_right, 1.0 * is_right, 1.0 + 0.0 * is_right)
    )
    left, right = slice(0, 13), slice(19, 32)
    assert half[:, right].mean() < 0.9 * dry[:, right].mean()
    assert half[:, left].mean() == pytest.approx(dry[:, left].mean(), rel=0.05)
    assert half[:, right].mean() == pytest.approx(soaked[:, right].mean(), rel=0.05)


def rendered_light(hair, folder, wetness):
    """Return (32, 32) light of still hair with wetness (S,)."""
    attributes.write(hair.data, "wetness", "FLOAT", "CURVE", wetness)
    hair.data.update_tag()
    path = str(folder / "wet.exr")
    bpy.context.scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(path, check_existing=False)
    pixels = np.empty(32 * 32 * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(32, 32, 4)[..., :3].mean(axis=2)
