# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes around hair in a viewport or a render: triangles, normals and materials."""

from dataclasses import dataclass, replace
from functools import cached_property

import bpy
import numpy as np

from ....core.geometry.mesh import Faces
from ...host import scene_time
from ...host.caches import Cache
from ...host.notices import can_be_drawn, name_of
from .. import scene
from . import surface_bakes, surface_materials, surface_means, unread_nodes
from .rendered_instances import is_rendered, placed_by


@dataclass(frozen=True)
class DrawnMesh:
    """Triangles of a drawn mesh: (V, 3) float32 vertices in the object's coordinates, (3 F,) vertices of corners.

    to_world: (4, 4), from the object's coordinates to world space [m]; normals: unit, (V, 3) of vertices or (3 F, 3) of
    corners, in the object's coordinates; uvs: (3 F, 2), None: zero; parts: (first corner, number of corners,
    `SurfaceMaterial`) of each material; None for a holdout, which leaves the picture empty where it is nearest.
    owner: by `owner_of`; is_seen: visible to cameras; casts_shadow: whether the mesh blocks light.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    to_world: np.ndarray
    normals: np.ndarray | None  # None if they were not read
    has_vertex_normals: bool
    uvs: np.ndarray | None
    parts: tuple | None
    owner: tuple = ()
    materials: tuple = ()  # (number of corners, `SurfaceMaterial`) in the corners' order, also for a holdout
    is_seen: bool = True
    casts_shadow: bool = True

    @property
    def positions(self):
        """(3 F, 3) float32 positions of corners in world space [m]."""
        placed = self.vertices @ self.to_world[:3, :3].T.astype(np.float32)
        placed += self.to_world[:3, 3].astype(np.float32)
        return placed[self.triangles]

    @property
    def corner_normals(self):
        """(3 F, 3) float32 unit normals of corners in world space."""
        placed = self.normals @ np.linalg.pinv(self.to_world[:3, :3])
        placed /= np.maximum(np.sqrt(np.einsum("nc,nc->n", placed, placed)), 1e-12)[:, None]
        placed = placed.astype(np.float32)
        return placed[self.triangles] if self.has_vertex_normals else placed

    @property
    def colors(self):
        """(number of corners, linear RGB) of each material, in the order of corners; for images the mean color."""
        parts = zip(self.materials, self._image_means, strict=True)
        return tuple((count, material.color if means is None else means.of_part) for (count, material), means in parts)

    @property
    def triangle_materials(self):
        """(F, 6) float32 of each triangle's material: linear RGB, roughness, metallic, reflectance; for images
        the mean color over the triangle.
        """
        rows = [
            (*material.color, material.roughness, material.metallic, material.reflectance)
            for _count, material in self.materials
        ]
        found = np.array(rows, np.float32).repeat([count // 3 for count, _material in self.materials], axis=0)
        first = 0
        for (count, _material), means in zip(self.materials, self._image_means, strict=True):
            if means is not None:
                found[first : first + count // 3, :3] = means.of_triangles
            first += count // 3
        return found

    @cached_property
    def _image_means(self):
        """`surface_means.ImageMeans` of each material; None if its color is not from an image."""
        first, found = 0, []
        for count, material in self.materials:
            corners = slice(first, first + count)
            means = None
            if material.color_image is not None and count:
                uvs = np.zeros((count, 2), np.float32) if self.uvs is None else self.uvs[corners]
                means = surface_means.of_image(material.color_image, uvs)
            found.append(means)
            first += count
        return found

    @property
    def is_clear(self):
        """Whether all materials let light through: the mesh hides nothing and casts no shadow."""
        return self.parts is not None and all(material.is_clear for _first, _count, material in self.parts)


@dataclass(frozen=True)
class _Layout:
    """Triangles of a mesh in drawing order, which stays the same while the mesh moves."""

    faces: Faces
    slots: np.ndarray  # (F,) material indices of its polygons; empty with a single material
    loops: np.ndarray  # (3 F',) corners of its triangles
    runs: tuple  # (material slot, number of its triangles)

    @cached_property
    def vertices(self):
        """(3 F',) int32 vertices of its triangles."""
        return self.faces.corner_vertices[self.loops]

    def fits(self, faces, slots):
        if faces is not self.faces:
            own, others = ((f.corner_vertices, f.starts) for f in (self.faces, faces))
            if not all(map(np.array_equal, own, others)):
                return False
        return np.array_equal(self.slots, slots)


layout_cache = Cache(capacity=64)  # session_uid of a mesh object → `_Layout`


def read_drawn_meshes(depsgraph, viewport=None, is_moving=False, has_normals=True, has_uvs=False, refused=None):
    """Return a `DrawnMesh` for every mesh, including instances, that a 3D viewport shows as a surface; None: a
    render.

    is_moving: reuse the last triangulation of polygons if their corners are the same; has_normals: whether normals are
    needed, which Blender computes for each pose, or the session_uids of objects whose normals are; has_uvs: whether
    UVs are needed without images too; refused: called with the sentence and the `HairError` of each object whose
    materials cannot be baked, which has plain colors then; None: prints the sentence.
    """
    meshes, override = [], depsgraph.view_layer_eval.material_override
    bakes = _bakes(depsgraph, viewport, override, refused)
    for instance in depsgraph.object_instances:
        if instance.object.type == "MESH" and instance.show_self and _is_surface_seen(instance, viewport):
            is_holdout = viewport is None and _has(instance, "holdout_get", depsgraph.view_layer)
            matrix = np.array(instance.matrix_world, np.float64)
            if not can_be_drawn(instance.object, matrix):
                continue
            needs_normals = has_normals
            if not isinstance(has_normals, bool):
                needs_normals = instance.object.original.session_uid in has_normals
            is_own = _has_own_mesh(instance)
            bake = bakes.get(instance.object.original.session_uid) if is_own else None
            read_as = is_holdout, is_moving, needs_normals, override, has_uvs, is_own, bake
            mesh = _read_drawn_mesh(instance.object, matrix, *read_as)
            rays = {} if viewport is not None else _rays_of(instance, depsgraph.view_layer)
            meshes.append(replace(mesh, owner=owner_of(instance), **rays))
    for cache in (scene.faces_cache, layout_cache):
        cache.make_room(len(meshes))
    return [mesh for mesh in meshes if len(mesh.triangles)]


def _bakes(depsgraph, viewport, override, refused):
    """Return {session_uid: `Bake`} of the objects that a viewport or a render shows; a render waits for bakes."""
    if not any(unread_nodes.baked_labels(material) for material in bpy.data.materials):
        return {}  # without reading the instances once more
    shown = (
        one.object
        for one in depsgraph.object_instances
        if one.object.type == "MESH" and one.show_self and _has_own_mesh(one) and _is_surface_seen(one, viewport)
    )
    is_render, frame = viewport is None, scene_time.time_of(depsgraph.scene)
    return surface_bakes.find(shown, override, frame, for_render=is_render, waits=is_render, refused=refused)


def _has_own_mesh(instance):
    """Whether an instance has the mesh of its object, not a mesh that Geometry Nodes instance, which is not baked."""
    return not instance.is_instance or instance.object.original != instance.parent.original


def split_clear(meshes):
    """Split meshes into solid and clear parts, for drawing with materials; invisible parts are left out."""
    return [part for mesh in meshes for part in _solid_and_clear(mesh)]


def as_holdouts(meshes):
    """Return the meshes as holdouts, without clear meshes, which hide nothing."""
    return [replace(mesh, parts=None) for mesh in meshes if not mesh.is_clear]


def owner_of(instance):
    """Return a key of a depsgraph instance, the same in every frame."""
    parent = instance.parent.original.session_uid if instance.is_instance else 0
    return instance.object.original.session_uid, parent, tuple(instance.persistent_id)


def _is_surface_seen(instance, viewport):
    if viewport is None:
        return is_rendered(instance)
    is_shown = placed_by(instance).original.visible_in_viewport_get(viewport)
    return is_shown and instance.object.display_type in {"TEXTURED", "SOLID"}


def _has(instance, question, view_layer):
    """Return a view layer's setting of an instance; as in Cycles, that of the object that places it."""
    return getattr(placed_by(instance).original, question)(view_layer=view_layer)


def _rays_of(instance, view_layer):
    """Return {`DrawnMesh` field: value} from the ray visibility of a mesh in a render."""
    placed = {instance.object, placed_by(instance)}
    is_seen = all(one.visible_camera for one in placed) and not _has(instance, "indirect_only_get", view_layer)
    return {"is_seen": is_seen, "casts_shadow": all(one.visible_shadow for one in placed)}


def _solid_and_clear(mesh):
    if mesh.parts is None:
        return [mesh]
    kinds = [(material.is_clear, material.is_invisible) for _first, _count, material in mesh.parts]
    if len(set(kinds)) == 1:
        return [] if kinds[0][1] else [mesh]
    return [
        _some_parts(mesh, [part for part, found in zip(mesh.parts, kinds, strict=True) if found == kind])
        for kind in ((False, False), (True, False))
        if kind in kinds
    ]


def _some_parts(mesh, parts):
    """Return a `DrawnMesh` with some of a mesh's parts."""
    corners = np.concatenate([np.arange(first, first + count) for first, count, _material in parts])
    ends = np.cumsum([count for _first, count, _material in parts])
    return replace(
        mesh,
        triangles=mesh.triangles[corners],
        normals=mesh.normals if mesh.has_vertex_normals else mesh.normals[corners],
        uvs=None if mesh.uvs is None else mesh.uvs[corners],
        parts=tuple(
            (int(end) - count, count, material) for (_first, count, material), end in zip(parts, ends, strict=True)
        ),
        materials=tuple((count, material) for _first, count, material in parts),
    )


def _read_drawn_mesh(mesh_object, to_world, is_holdout, is_moving, has_normals, override, has_uvs, is_own, bake):
    mesh = mesh_object.to_mesh()
    try:
        vertices = scene.cached_positions(mesh_object.original, mesh, is_own)
        layout = _layout(mesh_object, mesh, is_moving, is_own)
        has_vertex_normals = not has_normals or mesh.normals_domain == "POINT"
        normals = _normals(mesh, layout, has_vertex_normals) if has_normals else None
        name = "" if mesh_object.original.data.is_editmode else name_of(mesh_object)
        if bake is not None and not bake.fits(len(mesh.loops), name):
            bake = None
        parts = _parts(mesh_object, layout, override, bake)
        uvs = _read_uvs(mesh, layout.loops, parts, has_uvs, bake)
    finally:
        mesh_object.to_mesh_clear()
    materials = tuple((count, material) for _first, count, material in parts)
    return DrawnMesh(
        vertices,
        layout.vertices,
        to_world,
        normals,
        has_vertex_normals,
        uvs,
        None if is_holdout else parts,
        materials=materials,
    )


def _normals(mesh, layout, has_vertex_normals):
    """Float32 unit normals of vertices (V, 3) or of drawn corners (3 F, 3)."""
    if has_vertex_normals:
        normals = np.empty((len(mesh.vertices), 3), np.float32)
        mesh.vertex_normals.foreach_get("vector", normals.ravel())
        return normals
    normals = np.empty((len(mesh.loops), 3), np.float32)
    mesh.corner_normals.foreach_get("vector", normals.ravel())
    return normals.take(layout.loops, axis=0)


def _layout(mesh_object, mesh, is_moving, is_own):
    """Return the `_Layout` of an evaluated mesh; with `is_moving` the previous layout, if it fits."""
    faces, slots = scene.cached_faces(mesh_object.original, mesh, is_own), np.zeros(0, np.int32)
    if len(mesh_object.material_slots) > 1:
        slots = np.zeros(len(mesh.polygons), np.int32)
        mesh.polygons.foreach_get("material_index", slots)
        slots = np.clip(slots, 0, len(mesh_object.material_slots) - 1)
    uid = mesh_object.original.session_uid
    known = layout_cache.get(uid) if is_moving else None
    if known is not None and known.fits(faces, slots):
        return known
    triangles = scene.triangle_corners(mesh, faces, name_of(mesh_object))
    runs = ((0, len(triangles)),)
    if len(slots):
        polygons = np.empty(len(triangles), np.int32)
        mesh.loop_triangles.foreach_get("polygon_index", polygons)
        of_triangles = slots[polygons]
        used, counts = np.unique(of_triangles, return_counts=True)
        runs = tuple(zip(used.tolist(), counts.tolist(), strict=True))
        triangles = triangles[np.argsort(of_triangles, kind="stable")]
    return layout_cache.keep(uid, _Layout(faces, slots, triangles.ravel(), runs))


def _parts(mesh_object, layout, override, bake):
    """`DrawnMesh.parts` of an evaluated mesh, one for each material; override: the view layer's material."""
    materials = [override or slot.material for slot in mesh_object.material_slots] or [override]
    parts, first = [], 0
    for slot, count in layout.runs:
        material = surface_materials.read_material(materials[slot])
        if bake is not None and count and unread_nodes.baked_labels(materials[slot]):
            material = bake.material(material, layout.loops[first : first + 3 * count])
        parts.append((first, 3 * count, material))
        first += 3 * count
    return tuple(parts)


def _read_uvs(mesh, loops, parts, has_uvs, bake=None):
    """Return (3 F, 2) float32 UVs of drawn corners, for each part from the UV map of its images; None without UV
    maps.

    has_uvs: whether parts without images have those of the active UV map.
    """
    names = [material.uv_map for _first, _count, material in parts]
    names = ["" if name is None and has_uvs else name for name in names]
    layers = [None if name is None else (mesh.uv_layers.get(name) or _active_uvs(mesh)) for name in names]
    if all(layer is None for layer in layers) and not any(material.is_baked for *_corners, material in parts):
        return None
    uvs = np.zeros((len(loops), 2), np.float32)
    for (first, count, _material), layer in zip(parts, layers, strict=True):
        if layer is not None:
            found = np.empty((len(mesh.loops), 2), np.float32)
            layer.uv.foreach_get("vector", found.ravel())
            uvs[first : first + count] = found[loops[first : first + count]]
    for first, count, material in parts:
        if material.is_baked:
            uvs[first : first + count] = bake.uvs[loops[first : first + count]]
    return uvs


def _active_uvs(mesh):
    """Return the UV map that renders use, or None."""
    return next((layer for layer in mesh.uv_layers if layer.active_render), None)
