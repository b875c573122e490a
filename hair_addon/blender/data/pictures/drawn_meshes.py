# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes as they are drawn around hair: triangles, normals and materials of all that a viewport or a render shows."""

from dataclasses import dataclass, replace

import numpy as np

from ...host.notices import can_be_drawn, name_of
from .. import scene
from . import surface_materials


@dataclass(frozen=True)
class DrawnMesh:
    """Triangles as they are drawn: (3 F, 3) float32 corner positions [m] and unit normals in world space, (3 F, 2) UVs.

    parts: (first corner, number of corners, `SurfaceMaterial`) of each material. A holdout has none: where it is
    nearest the picture is empty. owner: `owner_of` it.
    """

    positions: np.ndarray
    normals: np.ndarray
    uvs: np.ndarray
    parts: tuple | None
    owner: tuple = ()
    color: tuple = (0.0, 0.0, 0.0)  # `surface_color` of its object

    @property
    def is_clear(self):
        """Whether all of it transmits light: it hides nothing, and casts no shadow."""
        return self.parts is not None and all(material.is_clear for _first, _count, material in self.parts)


def read_drawn_meshes(depsgraph, viewport=None):
    """A `DrawnMesh` for every mesh that a 3-D viewport shows as a surface, or without one a render; instances too."""
    meshes = []
    for instance in depsgraph.object_instances:
        if instance.object.type == "MESH" and instance.show_self and _is_surface_seen(instance, viewport):
            is_holdout = viewport is None and instance.object.original.holdout_get(view_layer=depsgraph.view_layer)
            matrix = np.array(instance.matrix_world, np.float64)
            if not can_be_drawn(instance.object, matrix):
                continue
            meshes.append(replace(_read_drawn_mesh(instance.object, matrix, is_holdout), owner=owner_of(instance)))
    return [mesh for mesh in meshes if len(mesh.positions)]


def held_out(meshes):
    """The same meshes as holdouts, without those that are clear, which hide nothing."""
    return [replace(mesh, parts=None) for mesh in meshes if not mesh.is_clear]


def owner_of(instance):
    """A key of a depsgraph instance, the same in every frame."""
    parent = instance.parent.original.session_uid if instance.is_instance else 0
    return instance.object.original.session_uid, parent, tuple(instance.persistent_id)


def _is_surface_seen(instance, viewport):
    placed = instance.parent if instance.is_instance else instance.object
    if viewport is None:
        return not (instance.object.hide_render or placed.hide_render)
    return placed.original.visible_in_viewport_get(viewport) and instance.object.display_type in {"TEXTURED", "SOLID"}


def _read_drawn_mesh(mesh_object, to_world, is_holdout):
    mesh = mesh_object.to_mesh()
    try:
        vertices = scene.vertex_positions(mesh)
        faces = scene.faces_of(mesh)
        triangles = scene.triangle_corners(mesh, faces, name_of(mesh_object))
        runs = () if is_holdout else _material_runs(mesh_object, mesh)
        if len(runs) > 1:
            triangles = triangles[np.concatenate([chosen for _material, chosen in runs])]
        loops = triangles.ravel()
        corners = faces.corner_vertices[loops]
        loop_normals = np.empty((len(mesh.loops), 3), np.float32)
        mesh.corner_normals.foreach_get("vector", loop_normals.ravel())
        parts = () if is_holdout else _parts(runs)
        uvs = _read_uvs(mesh, loops, parts)
    finally:
        mesh_object.to_mesh_clear()
    positions = vertices[corners] @ to_world[:3, :3].T + to_world[:3, 3]
    normals = loop_normals[loops] @ np.linalg.pinv(to_world[:3, :3])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    shown = None if is_holdout else parts
    color = surface_color(mesh_object)
    return DrawnMesh(positions.astype(np.float32), normals.astype(np.float32), uvs, shown, color=color)


def _material_runs(mesh_object, mesh):
    """[(`SurfaceMaterial`, indices of its triangles)] of an evaluated mesh, with as many as it has."""
    materials = [slot.material for slot in mesh_object.material_slots] or [None]
    slots = np.zeros(len(mesh.loop_triangles), np.int32)
    if len(materials) > 1 and len(slots):
        mesh.loop_triangles.foreach_get("material_index", slots)
        slots = np.clip(slots, 0, len(materials) - 1)
    return [(surface_materials.read_material(materials[slot]), np.flatnonzero(slots == slot)) for slot in set(slots)]


def _parts(runs):
    ends = 3 * np.cumsum([len(chosen) for _material, chosen in runs])
    return tuple(
        (int(end) - 3 * len(chosen), 3 * len(chosen), material)
        for (material, chosen), end in zip(runs, ends, strict=True)
    )


def _read_uvs(mesh, loops, parts):
    """(3 F, 2) float32 UVs of drawn corners, of each part by the UV map of its images: zero without."""
    uvs = np.zeros((len(loops), 2), np.float32)
    for first, count, material in parts:
        name = material.uv_map
        layer = None if name is None else (mesh.uv_layers.get(name) or _active_uvs(mesh))
        if layer is not None:
            found = np.empty((len(mesh.loops), 2), np.float32)
            layer.uv.foreach_get("vector", found.ravel())
            uvs[first : first + count] = found[loops[first : first + count]]
    return uvs


def _active_uvs(mesh):
    """The UV map that renders use, None where there is none."""
    return next((layer for layer in mesh.uv_layers if layer.active_render), None)


def surface_color(mesh_object):
    """Linear RGB: base colour of the first material's Principled BSDF, or its colour in the viewport; black of None."""
    if mesh_object is None:
        return (0.0, 0.0, 0.0)
    material = next((slot.material for slot in mesh_object.material_slots if slot.material), None)
    return surface_materials.read_material(material).color
