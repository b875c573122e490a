# SPDX-License-Identifier: GPL-3.0-or-later
"""Humanoids in glTF files, as the extension VRMC_vrm 1.0 [VRMHumanoid22]."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import HairError
from . import glb
from .gltf_springs import below, matrices

NAME = "VRMC_vrm"
_LICENSE = "https://vrm.dev/licenses/1.0/"

# Bones that a humanoid must have, and their names in rigs of Mixamo, Rigify and Unreal, without sides and separators.
_REQUIRED = {
    "hips": ("hips", "spine", "pelvis"),
    "spine": ("spine", "spine001", "spine01"),
    "head": ("head", "spine006"),
}
_REQUIRED_OF_SIDES = {
    "UpperLeg": ("upperleg", "upleg", "thigh"),
    "LowerLeg": ("lowerleg", "leg", "shin", "calf"),
    "Foot": ("foot",),
    "UpperArm": ("upperarm", "arm"),
    "LowerArm": ("lowerarm", "forearm"),
    "Hand": ("hand",),
}
_OTHERS = {"chest": ("chest", "spine1", "spine002", "spine02"), "neck": ("neck", "neck01", "spine004")}
_OTHERS_OF_SIDES = {
    "Shoulder": ("shoulder", "clavicle"),
    "Toes": ("toes", "toe", "toebase", "ball"),
    "Eye": ("eye",),
}

# The parent of each bone, without sides. If a humanoid lacks the parent, the parent of the parent is used.
_PARENTS = {
    "spine": "hips",
    "chest": "spine",
    "neck": "chest",
    "head": "neck",
    "Eye": "head",
    "Shoulder": "chest",
    "UpperArm": "Shoulder",
    "LowerArm": "UpperArm",
    "Hand": "LowerArm",
    "UpperLeg": "hips",
    "LowerLeg": "UpperLeg",
    "Foot": "LowerLeg",
    "Toes": "Foot",
}


def humanoid_bones(names: Iterable[str]) -> dict[str, str]:
    """Return {bone of VRM: name of a bone} of an armature whose bones have usual names, with all required bones.

    Raises `HairError` that names the missing bones.
    """
    known = {}
    for name in names:
        known.setdefault(_plain(name), name)
    # Rigify calls the hips spine, which is the name of the spine in other rigs.
    has_own_hips = any(("", kind) in known for kind in ("hips", "pelvis"))
    found, missing = {}, []
    for required, kinds in ((True, _REQUIRED), (False, _OTHERS)):
        for bone, usual in kinds.items():
            usual = tuple(one for one in usual if not (bone == "hips" and one == "spine" and has_own_hips))
            _add(found, missing if required else [], bone, [("", one) for one in usual], known)
    for required, kinds in ((True, _REQUIRED_OF_SIDES), (False, _OTHERS_OF_SIDES)):
        for side in ("left", "right"):
            for bone, usual in kinds.items():
                _add(found, missing if required else [], side + bone, [(side, one) for one in usual], known)
    if missing:
        raise HairError(
            "A VRM file needs an armature with the bones of a humanoid; missing: {names}.", names=", ".join(missing)
        )
    return found


def _add(found, missing, bone, keys, known):
    """Add the first known and unused key to the found bones, or the bone to the missing ones."""
    used = set(found.values())
    name = next((known[key] for key in keys if key in known and known[key] not in used), None)
    if name is None:
        missing.append(bone)
    else:
        found[bone] = name


def _plain(name):
    """Return (side: "left", "right" or "", name without side and separators in small letters) of a bone."""
    text = name.rpartition(":")[2].removeprefix("DEF-")  # deforming bones of rigs that Rigify generates
    text = re.sub(r"^J_Bip_([CLR])_", lambda match: {"C": "", "L": "Left", "R": "Right"}[match[1]], text)
    side = ""
    for pattern, found in ((r"^left|[._ -]l$", "left"), (r"^right|[._ -]r$", "right")):
        shorter = re.sub(pattern, "", text, flags=re.IGNORECASE)
        if shorter != text:
            side, text = found, shorter
            break
    return side, re.sub(r"[._ -]", "", text).lower()


def add(path: Path, armature: str, bones: dict[str, str], title: str) -> None:
    """Make a .glb file with an armature a VRM file; bones: of `humanoid_bones`; title: of the avatar.

    The file grants no rights beyond those that VRM's license grants by default. Raises `HairError` if the file lacks
    the armature or one of the bones.
    """
    described, chunks = glb.read(path)
    nodes = described["nodes"]
    root = next((index for index, node in enumerate(nodes) if node.get("name") == armature), None)
    found = {} if root is None else {nodes[index]["name"]: index for index in below(nodes, root)}
    lost = [name for name in bones.values() if name not in found]
    if lost:
        raise HairError("The exporter left out bones of the humanoid: {names}.", names=", ".join(lost))
    places = {bone: found[name] for bone, name in bones.items()}
    connect(described, places)
    glb.add_extension(described, NAME, extension(places, title))
    glb.write(path, described, chunks)


def connect(described: dict[str, Any], bones: dict[str, int]) -> None:
    """Move nodes of bones below those of their parents in a glTF file, in place; bones: {bone of VRM: index of its
    node}.

    VRM requires this order, which deforming bones of a rig with controls may lack. Nodes stay in their places at rest;
    animations of moved nodes are removed, as they are relative to other parents.
    """
    nodes, moved = described["nodes"], set()
    to_scene = matrices(nodes)
    for bone in bones:
        above = _parent_of(bone)
        while above and above not in bones:
            above = _parent_of(above)
        if not above or bones[bone] in below(nodes, bones[above]) or bones[above] in below(nodes, bones[bone]):
            continue
        node, parent = bones[bone], bones[above]
        for one in nodes:
            if node in (one.get("children") or []):
                one["children"].remove(node)
                if not one["children"]:
                    del one["children"]
        nodes[parent].setdefault("children", []).append(node)
        for name in ("translation", "rotation", "scale"):
            nodes[node].pop(name, None)
        nodes[node]["matrix"] = (np.linalg.inv(to_scene[parent]) @ to_scene[node]).T.ravel().tolist()
        moved.add(node)
    for animation in described.get("animations", []):
        animation["channels"] = [one for one in animation["channels"] if one["target"].get("node") not in moved]
    if "animations" in described:
        described["animations"] = [one for one in described["animations"] if one["channels"]]
        if not described["animations"]:
            del described["animations"]


def _parent_of(bone):
    """Return the parent of a bone of VRM, "" for the hips."""
    side = next((side for side in ("left", "right") if bone.startswith(side)), "")
    above = _PARENTS.get(bone.removeprefix(side), "")
    return side + above if above[:1].isupper() else above


def extension(bones: dict[str, int], title: str) -> dict[str, Any]:
    """Return the extension for {bone of VRM: index of its node}."""
    return {
        "specVersion": "1.0",
        "meta": {"name": title, "authors": ["unknown"], "licenseUrl": _LICENSE},
        "humanoid": {"humanBones": {bone: {"node": node} for bone, node in bones.items()}},
    }
