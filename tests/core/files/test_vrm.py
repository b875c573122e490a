# SPDX-License-Identifier: GPL-3.0-or-later
"""Bones of humanoids are found by the names of VRM, Mixamo, Rigify and Unreal; missing bones are named."""

import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.files import vrm

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
