# SPDX-License-Identifier: GPL-3.0-or-later
"""Armatures with chains of bones that swing meshes of hair in game engines.

An armature has a root bone, which moves with the surface, and chains below it. Each chain ends with a short bone that
deforms nothing: engines need it as the end of the last one.
"""

from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ....core.cards import bone_chains, spring_colliders
from ....core.files.gltf_springs import Springs
from .. import vertex_groups
from . import armature_weights

_SPHERES = "vellus_spheres"  # property of the armature: center and radius of each, in its coordinates
_END = 0.1  # length of the last bone, relative to the previous bone
_NAME_BYTES = 50  # of the hair's name in names of bones, which have at most 63
_HIT_RADIUS = 0.05  # relative to the length of a bone


@dataclass(frozen=True)
class BoneChains:
    """An armature object, and its chains' joints (C, B + 1, 3) in world axes around the surface's origin."""

    armature_object: bpy.types.Object
    joints: np.ndarray
    bone_names: list[list[str]]  # of each chain, without the bone at its end
    root_name: str

    def bind(self, mesh_object, lines, vertices_across):
        """Give a mesh object the armature and weights; lines: (N, n, 3) middle lines of its pieces, root to tip.

        Each piece has n × vertices_across consecutive vertices.
        """
        chosen = bone_chains.nearest_chains(lines, self.joints)
        weights = bone_chains.weights(lines, self.joints[chosen])
        weights = np.repeat(weights, vertices_across, axis=1)
        _add_group(mesh_object, self.root_name, weights[..., 0])
        for chain, names in enumerate(self.bone_names):
            for bone, name in enumerate(names):
                _add_group(mesh_object, name, np.where((chosen == chain)[:, None], weights[..., bone + 1], 0.0))
        modifier = mesh_object.modifiers.new("Armature", "ARMATURE")
        modifier.object, modifier.use_bone_envelopes = self.armature_object, False


def _add_group(mesh_object, name, weights):
    if weights.any():
        vertex_groups.paint(mesh_object.vertex_groups.new(name=name), weights.ravel())


def new(name, joints, surface_object, surface, collection):
    """Make the `BoneChains` of joints (C, B + 1, 3); surface: the posed `TriMesh`, both around the surface's origin.

    The armature is a child of the bone that moves the surface most at the roots, or of the surface without one.
    """
    armature = bpy.data.armatures.new(f"{name} Bones")
    armature_object = bpy.data.objects.new(armature.name, armature)
    start = name.encode()[:_NAME_BYTES].decode(errors="ignore")
    root = f"{start}_root"
    names = [[f"{start}_{i + 1:03}_{j + 1:02}" for j in range(len(chain) - 1)] for i, chain in enumerate(joints)]
    _add_bones(armature_object, joints, root, names)
    collection.objects.link(armature_object)
    _parent(armature_object, surface_object, joints[:, 0])
    length = np.linalg.norm(np.diff(joints, axis=1), axis=-1).mean()
    centers, radii = spring_colliders.inner_spheres(surface, joints[:, 1:].reshape(-1, 3), _HIT_RADIUS * length)
    armature[_SPHERES] = np.concatenate([centers, radii[:, None]], axis=1).ravel().tolist()
    return BoneChains(armature_object, joints, names, root)


def _add_bones(armature_object, joints, root, names):
    """Add the bones in a scene of their own: bones are made in Edit Mode, which would end the mode of other objects."""
    scene = bpy.data.scenes.new("Bones")
    try:
        scene.collection.objects.link(armature_object)
        view_layer = scene.view_layers[0]
        view_layer.objects.active = armature_object
        context = {
            "scene": scene,
            "view_layer": view_layer,
            "object": armature_object,
            "active_object": armature_object,
        }
        with bpy.context.temp_override(**context):
            bpy.ops.object.mode_set(mode="EDIT")
            bones = armature_object.data.edit_bones
            middle = Vector(joints[:, 0].mean(axis=0))
            length = float(np.linalg.norm(joints[:, 1] - joints[:, 0], axis=1).mean())
            top = _bone(bones, root, middle, middle + Vector((0.0, 0.0, length)))
            for chain, of_chain in zip(joints, names, strict=True):
                parent = top
                for index, name in enumerate(of_chain):
                    bone = _bone(bones, name, Vector(chain[index]), Vector(chain[index + 1]))
                    bone.parent, bone.use_connect = parent, index > 0
                    parent = bone
                beyond = parent.tail + _END * (parent.tail - parent.head)
                end = _bone(bones, f"{of_chain[0][:-3]}_end", parent.tail, beyond)
                end.parent, end.use_connect, end.use_deform = parent, True, False
            bpy.ops.object.mode_set(mode="OBJECT")
    finally:
        bpy.data.scenes.remove(scene)


def _bone(bones, name, head, tail):
    bone = bones.new(name)
    bone.head, bone.tail = head, tail
    return bone


def _parent(armature_object, surface_object, places):
    """Attach an armature to the surface's rig or the surface, unscaled, with world axes at the surface's origin."""
    rig, bone_name = armature_weights.strongest_bone(surface_object, places)
    armature_object.parent = rig or surface_object
    if rig:
        armature_object.parent_type, armature_object.parent_bone = "BONE", bone_name
    bpy.context.view_layer.update()
    # Only the parent inverse can undo uneven scale exactly.
    armature_object.matrix_parent_inverse = armature_object.matrix_world.inverted()
    armature_object.matrix_basis = Matrix.Translation(surface_object.matrix_world.translation)
    bpy.context.view_layer.update()


def all_springs():
    """Return the `Springs` of all armatures with bone chains, for glTF."""
    armatures = [one for one in bpy.data.objects if one.type == "ARMATURE" and _SPHERES in one.data]
    return [_springs_of(one) for one in armatures]


def _springs_of(armature_object):
    bones = armature_object.data.bones
    root = next(bone for bone in bones if bone.parent is None)
    chains = [[bone.name for bone in (first, *first.children_recursive)] for first in root.children]
    lengths = [bone.length for bone in bones if bone.use_deform and bone != root]
    spheres = np.array(armature_object.data[_SPHERES], np.float64).reshape(-1, 4)
    to_world = np.array(armature_object.matrix_world)
    centers = spheres[:, :3] @ to_world[:3, :3].T + to_world[:3, 3]
    upward = np.stack([centers[:, 0], centers[:, 2], -centers[:, 1]], axis=1)
    return Springs(
        armature_object.name, root.name, chains, upward, spheres[:, 3], _HIT_RADIUS * float(np.mean(lengths))
    )
