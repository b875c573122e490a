# SPDX-License-Identifier: GPL-3.0-or-later
"""Exported cards are read back with the same faces, UV coordinates, pictures and armature."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.io import mesh_export
from hair_addon.blender.settings import map_items
from hair_addon.core.cards import tubes
from hair_addon.core.maps.map_settings import MapSettings
from tests.support.dynamics.following import update

READERS = {".glb": ("import_scene", "gltf"), ".fbx": ("import_scene", "fbx"), ".usdc": ("wm", "usd_import")}


@pytest.fixture
def cards(hair, tmp_path):
    """Return cards of hair on a sphere with an armature of one bone; their textures are in a folder."""
    sphere, data = bpy.data.objects["Sphere"], bpy.data.armatures.new("Rig")
    rig = bpy.data.objects.new("Rig", data)
    bpy.context.scene.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    bone = data.edit_bones.new("head")
    bone.tail = (0.0, 0.0, 1.0)
    bpy.ops.object.mode_set(mode="OBJECT")
    sphere.vertex_groups.new(name="head").add(list(range(len(sphere.data.vertices))), 1.0, "REPLACE")
    sphere.modifiers.new("Armature", "ARMATURE").object = rig
    update()
    (made,) = api.make_hair_cards(hair, card_count=12, segment_count=3, texture_size=128, folder=tmp_path / "textures")
    update()
    return made


def layout(mesh_object):
    """Return the number of triangles of a mesh and the sorted UV coordinates of its corners, which all importers
    keep.
    """
    mesh = mesh_object.data
    mesh.calc_loop_triangles()
    uvs = np.empty((len(mesh.loops), 2), np.float32)
    mesh.uv_layers[0].uv.foreach_get("vector", uvs.ravel())
    corners = np.array([triangle.loops[:] for triangle in mesh.loop_triangles])
    return len(corners), np.sort(uvs[corners].reshape(-1, 2), axis=0)


@pytest.mark.filterwarnings("ignore:Setting the shape:DeprecationWarning")  # of Blender's exporter of FBX
@pytest.mark.parametrize("ending", READERS)
def test_files_have_faces_coordinates_pictures_and_the_armature(cards, tmp_path, ending):
    count, uvs = layout(cards)
    path = tmp_path / f"cards{ending}"
    mesh_export.write(path, [cards])
    before = set(bpy.data.objects), set(bpy.data.images)
    module, name = READERS[ending]
    getattr(getattr(bpy.ops, module), name)(filepath=str(path))
    made = set(bpy.data.objects) - before[0]
    (found,) = [one for one in made if one.type == "MESH" and "Cards" in one.name]
    its_count, its_uvs = layout(found)
    assert its_count == count == 12 * 3 * 2
    np.testing.assert_allclose(its_uvs, uvs, atol=1e-5)
    nodes = [node for slot in found.material_slots for node in slot.material.node_tree.nodes]
    pictures = {node.image.name.rsplit(".", 1)[0] for node in nodes if node.bl_idname == "ShaderNodeTexImage"}
    assert any("color" in picture for picture in pictures) and any("normal" in picture for picture in pictures)
    assert [one for one in made if one.type == "ARMATURE"]
    assert [group.name for group in found.vertex_groups] == ["head"]


def test_files_have_the_roughness_of_strands(hair, tmp_path):
    """Roughness by a map is in the green channel of a texture, as glTF has it, and in the file."""
    look = hair.data.vellus.appearance
    look.roughness = 0.4
    map_items.keep(hair.data.vellus, MapSettings(setting="look.roughness", kind="STRAND", low=0.25))
    update()
    (made,) = api.make_hair_cards(
        hair, card_count=12, segment_count=3, texture_size=128, texture_layout="UNREAL_COMPACT", folder=tmp_path
    )
    texels, packed = (
        _pixels(bpy.data.images[f"{made.name} {name}"]) for name in ("roughness", "unreal_ColorRoughness")
    )
    rough = texels[..., 1]
    assert np.ptp(rough) > 0.15
    assert np.sqrt(0.25 * 0.4) - 0.005 <= rough.min() and rough.max() <= np.sqrt(0.4) + 0.005
    np.testing.assert_allclose(rough**2, packed[..., 3], atol=0.005)
    np.testing.assert_array_equal(texels[..., 2], 0.0)
    path = tmp_path / "cards.glb"
    mesh_export.write(path, [made])
    before = set(bpy.data.materials)
    bpy.ops.import_scene.gltf(filepath=str(path))
    (material,) = (one for one in set(bpy.data.materials) - before if "Cards" in one.name)
    (shader,) = (node for node in material.node_tree.nodes if node.bl_idname == "ShaderNodeBsdfPrincipled")
    (link,) = shader.inputs["Roughness"].links
    assert link.from_socket.name == "Green"
    (of_image,) = link.from_node.inputs[0].links
    np.testing.assert_allclose(_pixels(of_image.from_node.image)[..., 1], rough, atol=0.002)


def _pixels(image):
    width, height = image.size
    values = np.empty((height, width, 4), np.float32)
    image.pixels.foreach_get(values.ravel())
    return values


def test_tubes_have_the_colors_of_their_strands(hair, tmp_path, rng):
    """Colors by a map are colors of vertices, also in a file; without maps there are none."""
    curves, settings = hair.data, {"tube_count": 12, "side_count": 3, "point_count": 4}
    assert not len(api.make_hair_tubes(hair, **settings).data.color_attributes)
    colors = rng.uniform(0.05, 0.6, (len(curves.curves), 3)).astype(np.float32)
    curves.attributes.new("own", "FLOAT_VECTOR", "CURVE").data.foreach_set("vector", colors.ravel())
    look = curves.vellus.appearance
    look.parametrization, look.random_color, look.tip_absorption = "COLOR", 0.0, 1.0
    map_items.keep(curves.vellus, MapSettings(setting="look.color", kind="CURVES", source="own"))
    curves.update_tag()
    update()
    wanted = colors[tubes.chosen_strands(len(colors), 12)]
    made = api.make_hair_tubes(hair, **settings)
    np.testing.assert_allclose(_colors(made), np.repeat(wanted, 12, axis=0), atol=1e-3)
    mesh_export.write(tmp_path / "tubes.glb", [made])
    before = set(bpy.data.objects)
    bpy.ops.import_scene.gltf(filepath=str(tmp_path / "tubes.glb"))
    (found,) = (one for one in set(bpy.data.objects) - before if one.type == "MESH")
    distances = np.abs(_colors(found)[:, None] - wanted).max(axis=2)
    assert distances.min(axis=1).max() < 0.005 and distances.min(axis=0).max() < 0.005


def _colors(mesh_object):
    (attribute,) = mesh_object.data.color_attributes
    values = np.empty((len(attribute.data), 4), np.float32)
    attribute.data.foreach_get("color", values.ravel())
    return values[:, :3]
