# SPDX-License-Identifier: GPL-3.0-or-later
"""Bones of humanoids are found by the names of VRM, Mixamo, Rigify and Unreal; missing bones are named."""

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.files import gltf_springs, vrm

LIMBS = ("UpperLeg", "LowerLeg", "Foot", "UpperArm", "LowerArm", "Hand")
REQUIRED = {"hips", "spine", "head"} | {side + limb for side in ("left", "right") for limb in LIMBS}


def of_sides(names, left, right):
    return [name.format(side) for name in names for side in (left, right)]


RIGS = {
    "VRM": sorted(REQUIRED),
    "Mixamo": [
        *("mixamorig:Hips", "mixamorig:Spine", "mixamorig:Spine1", "mixamorig:Neck", "mixamorig:Head"),
        *of_sides([f"mixamorig:{{}}{one}" for one in ("UpLeg", "Leg", "Foot", "ToeBase")], "Left", "Right"),
        *of_sides([f"mixamorig:{{}}{one}" for one in ("Shoulder", "Arm", "ForeArm", "Hand")], "Left", "Right"),
    ],
    "Rigify": [
        *("spine", *(f"spine.{number:03}" for number in range(1, 7))),
        *of_sides(("thigh.{}", "shin.{}", "foot.{}", "toe.{}"), "L", "R"),
        *of_sides(("shoulder.{}", "upper_arm.{}", "forearm.{}", "hand.{}"), "L", "R"),
    ],
    "Unreal": [
        *("root", "pelvis", "spine_01", "spine_02", "neck_01", "head"),
        *of_sides(("thigh_{}", "calf_{}", "foot_{}", "ball_{}"), "l", "r"),
        *of_sides(("clavicle_{}", "upperarm_{}", "lowerarm_{}", "hand_{}"), "l", "r"),
    ],
}
EXAMPLES = {
    "VRM": {"hips": "hips", "leftUpperLeg": "leftUpperLeg"},
    "Mixamo": {"hips": "mixamorig:Hips", "chest": "mixamorig:Spine1", "leftLowerLeg": "mixamorig:LeftLeg"},
    "Rigify": {"hips": "spine", "spine": "spine.001", "head": "spine.006", "rightUpperArm": "upper_arm.R"},
    "Unreal": {"hips": "pelvis", "spine": "spine_01", "leftLowerLeg": "calf_l", "rightShoulder": "clavicle_r"},
}


@pytest.mark.parametrize("rig", RIGS)
def test_usual_names_are_found(rig):
    found = vrm.humanoid_bones(RIGS[rig])
    assert found.keys() >= REQUIRED and len(set(found.values())) == len(found)
    assert found | EXAMPLES[rig] == found
    assert all(name.startswith("left") == bone.startswith("left") for bone, name in found.items() if rig == "VRM")


def test_missing_bones_are_named():
    names = [name for name in RIGS["Unreal"] if name not in ("hand_l", "head")]
    with pytest.raises(HairError, match="missing: head, leftHand"):
        vrm.humanoid_bones(names)
    with pytest.raises(HairError, match="hips, spine, head"):
        vrm.humanoid_bones(["Bone"])


def test_nodes_of_bones_are_moved_below_their_parents_and_stay_in_place():
    """A leg below a control moves below the hips, with its children and the same matrices; its animation is removed."""
    turn = [0.0, 0.6, 0.0, 0.8]
    nodes = [
        {"name": "root", "children": [1, 2], "scale": [0.01, 0.01, 0.01]},
        {"name": "DEF-spine", "translation": [0.0, 100.0, 2.0], "rotation": turn},
        {"name": "control", "children": [3], "translation": [0.0, 90.0, 0.0]},
        {"name": "DEF-thigh.L", "children": [4], "translation": [10.0, 5.0, 0.0], "rotation": turn},
        {"name": "DEF-shin.L", "translation": [0.0, -40.0, 0.0]},
    ]
    channels = [{"sampler": 0, "target": {"node": node, "path": "rotation"}} for node in (1, 3)]
    described = {"nodes": nodes, "animations": [{"channels": channels, "samplers": [{}]}]}
    before = gltf_springs.matrices(nodes)
    vrm.connect(described, {"hips": 1, "leftUpperLeg": 3, "leftLowerLeg": 4})
    assert gltf_springs.below(nodes, 1) == [3, 4] and "children" not in nodes[2]
    np.testing.assert_allclose(gltf_springs.matrices(nodes), before, atol=1e-12)
    assert [one["target"]["node"] for one in described["animations"][0]["channels"]] == [1]
    unchanged = [dict(node) for node in nodes]
    vrm.connect(described, {"hips": 1, "leftUpperLeg": 3, "leftLowerLeg": 4})
    assert nodes == unchanged


def test_bones_without_a_parent_are_below_the_next_bone():
    nodes = [{"children": [1, 2]}, {"translation": [0.0, 1.0, 0.0]}, {}]
    vrm.connect({"nodes": nodes}, {"hips": 1, "rightShoulder": 2})
    assert gltf_springs.below(nodes, 1) == [2]
