# SPDX-License-Identifier: GPL-3.0-or-later
"""Cards and tubes with chains of bones stay in place at rest, move with bones and surfaces, and have springs in .glb
files.
"""

import json
import sys
import types

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix, Vector

from hair_addon import api
from hair_addon.blender.io import gltf_hooks, mesh_export
from hair_addon.core.files import gltf_springs
from tests.support.dynamics.following import update

CHAINS, BONES = 5, 3
PLACES = {
    "origin": Matrix(),
    "uneven": Matrix.Translation((3.0, -54.0, 2.0))
    @ Euler((0.3, 0.2, 0.5)).to_matrix().to_4x4()
    @ Matrix.Diagonal((0.5, 2.0, 1.0, 1.0)),
    "mirrored": Matrix.Translation((0.0, 0.0, 5.0)) @ Matrix.Diagonal((-0.01, 0.01, 0.01, 1.0)),
}


def make(kind, hair, **settings):
    if kind == "cards":
        return api.make_hair_cards(hair, card_count=24, segment_count=3, texture_size=128, **settings)[0]
    return api.make_hair_tubes(hair, tube_count=24, side_count=3, point_count=4, **settings)


def places(mesh_object):
    """Return (V, 3) evaluated vertices in the world."""
    update()
    mesh = mesh_object.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    found = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", found.ravel())
    to_world = np.array(mesh_object.matrix_world)
    return found.astype(np.float64) @ to_world[:3, :3].T + to_world[:3, 3]


def chained(kind, hair):
    return make(kind, hair, chain_count=CHAINS, bone_count=BONES)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("kind", ["cards", "tubes"])
def test_chains_leave_pieces_in_place_and_follow_the_surface(hair, kind, place):
    """Vertices are at the same places with and without bones, on any surface, and move with it."""
    sphere = bpy.data.objects["Sphere"]
    sphere.matrix_world = PLACES[place]
    update()
    expected = places(make(kind, hair))
    made = chained(kind, hair)
    size = np.ptp(expected, axis=0).max()
    np.testing.assert_allclose(places(made), expected, atol=1e-5 * size)
    assert np.allclose(made.matrix_world.to_scale(), 1.0, atol=1e-5)
    move = Matrix.Translation((1.0, 2.0, 3.0)) @ Euler((0.0, 0.4, 0.0)).to_matrix().to_4x4()
    sphere.matrix_world = move @ sphere.matrix_world
    moved = expected @ np.array(move)[:3, :3].T + np.array(move)[:3, 3]
    np.testing.assert_allclose(places(made), moved, atol=1e-4 * max(size, 1.0))


@pytest.mark.parametrize("kind", ["cards", "tubes"])
def test_bones_move_tips_and_leave_roots(hair, kind):
    """Turning a first bone moves the ends of its chain's pieces rigidly, and moves no root."""
    made = chained(kind, hair)
    rest, across = places(made), 2 if kind == "cards" else 3
    bone = made.parent.pose.bones["Hair_001_01"]
    bone.rotation_mode, bone.rotation_euler = "XYZ", (0.6, 0.0, 0.0)
    moved = places(made)
    apart = np.linalg.norm(moved - rest, axis=1).reshape(24, -1, across).max(axis=2)
    assert apart[:, 0].max() < 0.1 * apart.max() and apart.max() > 0.1
    assert 0 < (apart.max(axis=1) > 1e-6).sum() < 24
    turn = np.array(
        made.parent.matrix_world @ bone.matrix @ bone.bone.matrix_local.inverted() @ made.parent.matrix_world.inverted()
    )
    tips = (apart.max(axis=1) > 1e-6).nonzero()[0]
    ends = rest.reshape(24, -1, across, 3)[tips, -1]
    expected = ends @ turn[:3, :3].T + turn[:3, 3]
    lengths = [np.linalg.norm(np.diff(rest.reshape(24, -1, across, 3).mean(axis=2), axis=1), axis=2).sum(axis=1)[tips]]
    is_long = lengths[0] > 0.5 * lengths[0].max()
    np.testing.assert_allclose(moved.reshape(24, -1, across, 3)[tips, -1][is_long], expected[is_long], atol=0.05)


def _described(path):
    """The JSON of a glTF file."""
    content = path.read_bytes()
    return json.loads(
        content if path.suffix == ".gltf" else content[20 : 20 + int.from_bytes(content[12:16], "little")]
    )


def rig(sphere):
    """Return an armature with a bone that moves the lower half and one that moves the rest."""
    armature = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for name, end in (("neck", -1.0), ("head", 1.0)):
        armature.data.edit_bones.new(name).tail = (0.0, 0.0, end)
    bpy.ops.object.mode_set(mode="OBJECT")
    for name, sign in (("neck", -1.0), ("head", 1.0)):
        chosen = [vertex.index for vertex in sphere.data.vertices if sign * (vertex.co.z - 0.3 * sign) >= -0.6]
        sphere.vertex_groups.new(name=name).add(chosen, 0.2 if name == "neck" else 0.8, "REPLACE")
    sphere.modifiers.new("Armature", "ARMATURE").object = armature
    return armature


def test_chains_hang_on_the_strongest_bone_and_the_rig_is_as_before(hair):
    """Posing the bone moves pieces with it rigidly; the artist's armature has no other bones."""
    sphere = bpy.data.objects["Sphere"]
    armature = rig(sphere)
    armature.pose.bones["head"].rotation_mode = "XYZ"
    armature.pose.bones["head"].rotation_euler = (0.2, 0.0, 0.0)  # made in a pose
    update()
    expected = places(make("tubes", hair))
    made = chained("tubes", hair)
    assert made.parent.parent_bone == "head" and [bone.name for bone in armature.data.bones] == ["neck", "head"]
    np.testing.assert_allclose(places(made), expected, atol=1e-4)
    before = armature.pose.bones["head"].matrix.copy()
    armature.pose.bones["head"].rotation_euler = (0.2, 0.7, 0.0)
    update()
    turn = np.array(armature.pose.bones["head"].matrix @ before.inverted())
    np.testing.assert_allclose(places(made), expected @ turn[:3, :3].T + turn[:3, 3], atol=1e-4)


@pytest.mark.parametrize("is_rigged", [False, True])
def test_springs_in_files_stand_where_the_chains_stand(hair, tmp_path, is_rigged):
    """Joints in a .glb are where Blender has them, from root to tip, and spheres are clear of all swinging joints."""
    sphere = bpy.data.objects["Sphere"]
    sphere.matrix_world = PLACES["uneven"]
    if is_rigged:
        rig(sphere).location = (1.0, 0.0, 0.0)
    update()
    made = chained("cards", hair)
    made.parent.rotation_euler = (0.3, 0.8, -0.2)  # an artist may turn them
    update()
    to_surface = sphere.matrix_world.inverted() @ Matrix.Translation(sphere.matrix_world.translation)
    to_surface @= made.parent.matrix_world.inverted()
    path = tmp_path / "hair.glb"
    mesh_export.write(path, [made])
    described = _described(path)
    springs, nodes = described["extensions"]["VRMC_springBone"], described["nodes"]
    assert "VRMC_springBone" in described["extensionsUsed"] and len(springs["springs"]) == CHAINS
    to_scene = gltf_springs.matrices(nodes)
    armature = made.parent
    joints = []
    for spring in springs["springs"]:
        names = [nodes[joint["node"]]["name"] for joint in spring["joints"]]
        assert [name.rsplit("_", 1)[1] for name in names] == ["01", "02", "03", "end"]
        for joint, name in zip(spring["joints"], names, strict=True):
            x, y, z = armature.matrix_world @ armature.data.bones[name].head_local
            joints.append(to_scene[joint["node"]][:3, 3])
            np.testing.assert_allclose(joints[-1], (x, z, -y), atol=1e-4)
    joints = np.array(joints).reshape(CHAINS, BONES + 1, 3)
    spheres = [(collider["node"], collider["shape"]["sphere"]) for collider in springs["colliders"]]
    assert spheres and all(group == [0] for group in (spring["colliderGroups"] for spring in springs["springs"]))
    reach = springs["springs"][0]["joints"][0]["hitRadius"]
    for node, its in spheres:
        center = (to_scene[node] @ [*its["offset"], 1.0])[:3]
        local = to_surface @ Vector((center[0], -center[2], center[1]))
        assert local.length < 1.0
        assert (np.linalg.norm(joints[:, 1:] - center, axis=2) >= its["radius"] + reach - 1e-4).all()


@pytest.mark.parametrize(("ending", "kind"), [("glb", "GLB"), ("gltf", "GLTF_SEPARATE")])
def test_blenders_exporter_writes_the_springs_of_what_it_exports(hair, tmp_path, monkeypatch, ending, kind):
    """With the installed extension, files of Blender's exporter have the springs of the exported armature alone."""
    package = types.ModuleType("vellus_installed")  # as the root's __init__.py is in an installed extension
    package.glTF2ExportUserExtension = gltf_hooks.GltfHooks
    monkeypatch.setitem(sys.modules, "vellus_installed", package)
    entry = bpy.context.preferences.addons.new()
    entry.module = "vellus_installed"
    try:
        made, other = chained("tubes", hair), chained("tubes", hair)
        for one in bpy.context.view_layer.objects:
            one.select_set(one in (other, other.parent))
        bpy.ops.export_scene.gltf(filepath=str(tmp_path / f"a.{ending}"), export_format=kind, use_selection=True)
    finally:
        bpy.context.preferences.addons.remove(entry)
    described = _described(tmp_path / f"a.{ending}")
    springs, nodes = described["extensions"]["VRMC_springBone"], described["nodes"]
    assert len(springs["springs"]) == CHAINS and not [node for node in nodes if node["name"] == made.parent.name]
    assert nodes[springs["springs"][0]["joints"][0]["node"]]["name"] == "Hair_001_01"


def test_chains_of_long_names_are_made_while_guides_are_combed(hair, tmp_path):
    """Hair with the longest name has weights on all bones, and the guides stay in Sculpt Mode."""
    hair.name = "Ä" * 31  # 62 bytes
    guides = bpy.data.objects["Guides"]
    bpy.context.view_layer.objects.active = guides
    bpy.ops.object.mode_set(mode="SCULPT_CURVES")
    made = chained("tubes", hair)
    assert guides.mode == "SCULPT_CURVES" and bpy.context.view_layer.objects.active == guides
    bones = {bone.name for bone in made.parent.data.bones if bone.use_deform}
    assert {group.name for group in made.vertex_groups} == bones and len(bones) == CHAINS * BONES + 1
    assert len(bpy.data.scenes) == 1


def test_without_chains_files_have_no_springs(hair, tmp_path):
    path = tmp_path / "hair.glb"
    mesh_export.write(path, [make("cards", hair)])
    assert b"VRMC" not in path.read_bytes()
