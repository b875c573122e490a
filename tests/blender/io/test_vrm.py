# SPDX-License-Identifier: GPL-3.0-or-later
"""A .vrm of cards is an avatar: the humanoid's bones, its meshes and the hair with springs."""

import bpy
import pytest

from hair_addon import api
from hair_addon.blender.io import mesh_export
from hair_addon.core.errors import HairError
from hair_addon.core.files import glb
from tests.support.dynamics.following import update

# Head, tail and parent of bones of a small humanoid, whose head is the sphere around the origin; the left side.
MIDDLE = {
    "hips": ((0, 0, -3), (0, 0, -2.5), None),
    "spine": ((0, 0, -2.5), (0, 0, -1), "hips"),
    "head": ((0, 0, -1), (0, 0, 1), "spine"),
}
SIDE = {
    "UpperLeg": ((0.4, 0, -3), (0.4, 0, -4), "hips"),
    "LowerLeg": ((0.4, 0, -4), (0.4, 0, -5), "leftUpperLeg"),
    "Foot": ((0.4, 0, -5), (0.4, -0.3, -5.2), "leftLowerLeg"),
    "UpperArm": ((0.5, 0, -1.2), (1.2, 0, -1.2), "spine"),
    "LowerArm": ((1.2, 0, -1.2), (1.9, 0, -1.2), "leftUpperArm"),
    "Hand": ((1.9, 0, -1.2), (2.2, 0, -1.2), "leftLowerArm"),
}


def humanoid(sphere, without=()):
    """Return an armature that moves a sphere by its head."""
    armature = bpy.data.objects.new("Body Rig", bpy.data.armatures.new("Rig"))
    bpy.context.scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    wanted = dict(MIDDLE)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        for name, (head, tail, parent) in SIDE.items():
            ends = [(sign * place[0], *place[1:]) for place in (head, tail)]
            wanted[side + name] = (*ends, parent.replace("left", side))
    for name, (head, tail, parent) in wanted.items():
        if name not in without:
            bone = armature.data.edit_bones.new(name)
            bone.head, bone.tail, bone.parent = head, tail, armature.data.edit_bones.get(parent or "")
    bpy.ops.object.mode_set(mode="OBJECT")
    sphere.vertex_groups.new(name="head").add(range(len(sphere.data.vertices)), 1.0, "REPLACE")
    sphere.modifiers.new("Armature", "ARMATURE").object = armature
    update()
    return armature


@pytest.mark.parametrize("chain_count", [0, 3])
def test_an_avatar_has_the_humanoid_its_meshes_and_springs(hair, tmp_path, chain_count):
    humanoid(bpy.data.objects["Sphere"])
    made = api.make_hair_cards(
        hair, card_count=8, segment_count=2, level_count=2, texture_size=128, chain_count=chain_count
    )
    mesh_export.write(tmp_path / "avatar.vrm", made)
    described, _chunks = glb.read(tmp_path / "avatar.vrm")
    nodes, found = described["nodes"], described["extensions"]["VRMC_vrm"]
    bones = {name: nodes[bone["node"]]["name"] for name, bone in found["humanoid"]["humanBones"].items()}
    assert bones == {name: name for name in bones} and len(bones) == 15
    assert found["specVersion"] == "1.0" and found["meta"]["name"] == "avatar" and found["meta"]["authors"]
    assert {node["name"] for node in nodes if "mesh" in node} == {"Sphere", "Hair Cards LOD0"}
    used = {"VRMC_vrm"} | ({"VRMC_springBone"} if chain_count else set())
    assert used == {name for name in described["extensionsUsed"] if name.startswith("VRMC")}
    assert [path.name for path in tmp_path.iterdir()] == ["avatar.vrm"]


def test_bones_of_a_generated_rig_are_those_that_deform(hair, tmp_path):
    """Controls that have usual names, as in rigs that Rigify generates, are not bones of the humanoid."""
    armature = humanoid(bpy.data.objects["Sphere"])
    for bone in armature.data.bones:
        bone.name = f"DEF-{bone.name}"
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for name in ("head", "hips"):
        bone = armature.data.edit_bones.new(name)
        bone.head, bone.tail, bone.use_deform = (0, 2, 0), (0, 3, 0), False
    bpy.ops.object.mode_set(mode="OBJECT")
    update()
    made = api.make_hair_cards(hair, card_count=4, segment_count=1, texture_size=128)
    mesh_export.write(tmp_path / "avatar.vrm", made)
    described, _chunks = glb.read(tmp_path / "avatar.vrm")
    bones = described["extensions"]["VRMC_vrm"]["humanoid"]["humanBones"]
    named = {bone: described["nodes"][node["node"]]["name"] for bone, node in bones.items()}
    assert named == {bone: f"DEF-{bone}" for bone in named} and len(named) == 15


def test_other_armatures_are_refused_and_leave_no_file(hair, tmp_path):
    made = api.make_hair_cards(hair, card_count=4, segment_count=1, texture_size=128)
    with pytest.raises(HairError, match="missing: hips, spine"):
        mesh_export.write(tmp_path / "avatar.vrm", made)
    humanoid(bpy.data.objects["Sphere"], without=("leftHand",))
    made = api.make_hair_cards(hair, card_count=4, segment_count=1, texture_size=128)
    with pytest.raises(HairError, match="missing: leftHand"):
        mesh_export.write(tmp_path / "avatar.vrm", made)
    assert [*tmp_path.iterdir()] == []
