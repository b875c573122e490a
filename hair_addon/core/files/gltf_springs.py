# SPDX-License-Identifier: GPL-3.0-or-later
"""Springs of bone chains in glTF files, as the extension VRMC_springBone 1.0 [VRM22]."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from . import glb

NAME = "VRMC_springBone"


@dataclass(frozen=True)
class Springs:
    """Chains of bones that swing below the root bone of an armature, and spheres that the chains avoid.

    chains: [[bone name from root to tip]]; centers (K, 3), in the scene's axes in glTF, Y up, and radii (K,) of spheres
    [m]; hit_radius: of each joint [m]; stiffness: force towards the rest shape; drag: fraction of the motion that is
    lost in each step.
    """

    armature: str
    root: str
    chains: list[list[str]]
    centers: np.ndarray
    radii: np.ndarray
    hit_radius: float
    stiffness: float = 0.6
    drag: float = 0.4


def add(path: Path, springs: list[Springs]) -> None:
    """Add springs to a .glb file that Blender's exporter has written.

    Springs of armatures that the file lacks are left out. A file to which the exporter's hooks have already added
    springs is unchanged.
    """
    described, chunks = glb.read(path)
    found = extension(described["nodes"], springs)
    if not found or NAME in described.get("extensions", {}):
        return
    glb.add_extension(described, NAME, found)
    glb.write(path, described, chunks)


def extension(nodes: list[dict], springs: list[Springs]) -> dict:
    """Return the extension for the nodes of a glTF file, {} if none of the armatures is among the nodes.

    Missing values of nodes may be None.
    """
    written = {"specVersion": "1.0", "colliders": [], "colliderGroups": [], "springs": []}
    to_scene = matrices(nodes)
    for its in springs:
        armature = next((index for index, node in enumerate(nodes) if node.get("name") == its.armature), None)
        if armature is None:
            continue
        known = {nodes[index]["name"]: index for index in below(nodes, armature)}
        if not {its.root, *(name for chain in its.chains for name in chain)} <= known.keys():
            continue
        root = known[its.root]
        first = len(written["colliders"])
        to_root = np.linalg.inv(to_scene[root])
        for center, radius in zip(its.centers, its.radii, strict=True):
            offset = (to_root @ [*center, 1.0])[:3]
            sphere = {"offset": [float(value) for value in offset], "radius": float(radius)}
            written["colliders"].append({"node": root, "shape": {"sphere": sphere}})
        groups = []
        if len(its.radii):
            groups = [len(written["colliderGroups"])]
            numbers = list(range(first, len(written["colliders"])))
            written["colliderGroups"].append({"name": its.root, "colliders": numbers})
        for chain in its.chains:
            joints = [{"node": known[name], **_joint(its)} for name in chain]
            written["springs"].append({"name": chain[0], "joints": joints, "colliderGroups": groups})
    return {key: value for key, value in written.items() if value} if written["springs"] else {}


def _joint(springs):
    # Without gravity: the rest shape of hair already hangs.
    return {
        "hitRadius": springs.hit_radius,
        "stiffness": springs.stiffness,
        "gravityPower": 0.0,
        "gravityDir": [0.0, -1.0, 0.0],
        "dragForce": springs.drag,
    }


def below(nodes: list[dict], root: int) -> list[int]:
    """Return the indices of all nodes below a node of a glTF file."""
    found = list(nodes[root].get("children") or [])
    for index in found:
        found += nodes[index].get("children") or []
    return found


def matrices(nodes: list[dict]) -> list[np.ndarray]:
    """Return the matrix (4, 4) from each node of a glTF file to the scene."""
    parents = {child: index for index, node in enumerate(nodes) for child in (node.get("children") or [])}

    def matrix(index):
        own = _own_matrix(nodes[index])
        return matrix(parents[index]) @ own if index in parents else own

    return [matrix(index) for index in range(len(nodes))]


def _own_matrix(node):
    if node.get("matrix"):
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    x, y, z, w = node.get("rotation") or (0.0, 0.0, 0.0, 1.0)
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    found = np.eye(4)
    found[:3, :3] = turn * np.array(node.get("scale") or (1.0, 1.0, 1.0))
    found[:3, 3] = node.get("translation") or (0.0, 0.0, 0.0)
    return found
