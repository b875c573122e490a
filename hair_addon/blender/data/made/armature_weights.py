# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of hair that follow the armature of their surface: each piece has the weights of the surface at its root."""

import bpy
import numpy as np

from ....core import geometry
from ....core.geometry.mesh import interpolate
from .. import scene, vertex_groups

_LEAST = 1e-4  # smaller weights are ignored


def armatures_of(mesh_object):
    """Return the Armature modifiers of a mesh object that deform it by vertex groups."""
    return [m for m in mesh_object.modifiers if m.type == "ARMATURE" and m.object and m.use_vertex_groups]


def bind(mesh_object, surface_object, piece_size):
    """Give a mesh object the armatures of its surface, and each of its pieces the weights at the piece's root.

    piece_size: number of consecutive vertices of each piece, from root to tip. The mesh is in the current pose; its
    vertices are transformed by the inverse of the pose, so that the armature leaves the mesh in place.
    """
    modifiers, names = armatures_of(surface_object), _bone_names(surface_object)
    if not names:
        return
    mesh = mesh_object.data
    vertices = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", vertices.ravel())
    pieces = vertices.reshape(-1, piece_size, 3)
    weights = _weights_at(pieces[:, :2].mean(axis=1), surface_object, names)
    _add(mesh_object, names, weights, piece_size, modifiers)
    maps = _poses(pieces[:, 0], weights, names, mesh_object, surface_object)
    offsets = pieces.astype(np.float64) - maps[:, None, 3]
    unposed = np.einsum("pvi,pij->pvj", offsets, np.linalg.inv(maps[:, :3]))
    mesh.vertices.foreach_set("co", np.ascontiguousarray(unposed, np.float32).ravel())
    mesh.update()


def strongest_bone(surface_object, places):
    """Return (armature object, bone name) that move a surface most at places (N, 3), or (None, "") without an
    armature.

    places: around the surface's origin, in world axes.
    """
    names = _bone_names(surface_object)
    if not names:
        return None, ""
    to_local = scene.read_surface(surface_object, scene.present_depsgraph()).to_local_axes
    name = names[_weights_at(places @ to_local.T, surface_object, names).sum(axis=0).argmax()]
    return next(m.object for m in armatures_of(surface_object) if name in m.object.data.bones), name


def _bone_names(surface_object):
    """Deforming bones with a vertex group of a surface."""
    bones = {bone.name for m in armatures_of(surface_object) for bone in m.object.data.bones if bone.use_deform}
    return [group.name for group in surface_object.vertex_groups if group.name in bones]


def _weights_at(places, surface_object, names):
    """Return (N, K) weights of the surface nearest to local places (N, 3); each row sums to one or is zero."""
    depsgraph = scene.present_depsgraph()
    surface = scene.read_surface(surface_object, depsgraph)
    weights = np.stack([scene.read_vertex_group(surface_object, depsgraph, name) for name in names], axis=1)
    nearest = geometry.closest_point.SurfaceQuery(surface.posed_mesh).nearest(surface.from_local(places))
    found = interpolate(weights, surface.posed_mesh, nearest)
    found[found < _LEAST] = 0.0
    return found / np.maximum(found.sum(axis=1, keepdims=True), _LEAST)


def _add(mesh_object, names, weights, piece_size, modifiers):
    """Add vertex groups with weights (N, K) of pieces, and copies of modifiers."""
    for name, of_pieces in zip(names, weights.T, strict=True):
        if of_pieces.any():
            vertex_groups.paint(mesh_object.vertex_groups.new(name=name), np.repeat(of_pieces, piece_size))
    for modifier in modifiers:
        copy = mesh_object.modifiers.new(modifier.name, "ARMATURE")
        copy.object, copy.use_bone_envelopes = modifier.object, False
        copy.use_deform_preserve_volume = modifier.use_deform_preserve_volume
        copy.show_viewport, copy.show_render = modifier.show_viewport, modifier.show_render


def _poses(places, weights, names, mesh_object, surface_object):
    """Return (N, 4, 3) rows x, y, z and origin of the pose's affine map of each piece, measured with four points."""
    span = max(float(np.ptp(places, axis=0).max()), *surface_object.dimensions, 1e-6)
    corners = np.concatenate([span * np.eye(3), np.zeros((1, 3))]).astype(np.float32)
    probe = bpy.data.meshes.new("Probe")
    probe.from_pydata((corners[None] + np.zeros((len(places), 1, 1), np.float32)).reshape(-1, 3), [], [])
    probe_object = bpy.data.objects.new("Probe", probe)
    try:
        probe_object.parent = surface_object
        mesh_object.users_collection[0].objects.link(probe_object)
        _add(probe_object, names, weights, 4, [m for m in mesh_object.modifiers if m.type == "ARMATURE"])
        bpy.context.view_layer.update()
        evaluated = probe_object.evaluated_get(scene.present_depsgraph())
        posed = np.empty((4 * len(places), 3), np.float32)
        evaluated.data.vertices.foreach_get("co", posed.ravel())
    finally:
        bpy.data.objects.remove(probe_object)
        bpy.data.meshes.remove(probe)
    maps = posed.reshape(-1, 4, 3).astype(np.float64)
    maps[:, :3] = (maps[:, :3] - maps[:, 3:]) / span
    return maps
