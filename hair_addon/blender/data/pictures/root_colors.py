# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors of a surface at the roots of its hair, as Workbench shows them: a color attribute, or images of materials."""

from dataclasses import dataclass

import bpy
import numpy as np

from ....core import geometry
from ...host.caches import Cache
from .. import scene

ATTRIBUTE, TEXTURE = "VERTEX", "TEXTURE"  # color types of viewports


@dataclass(frozen=True, eq=False)
class _Sampled:
    """Colors (S, 3) of an image at UVs (S, 2)."""

    uvs: np.ndarray
    colors: np.ndarray


@dataclass(frozen=True, eq=False)
class _Corners:
    """Corners (S, 3) of the polygons that contain roots with vertices (S, 3)."""

    faces: geometry.mesh.Faces
    vertices: np.ndarray
    corners: np.ndarray


# session_uid of an image and of a hair, slot, extension, interpolation → `_Sampled`; dropped when an image changes.
sample_cache = Cache(capacity=32)
corner_cache = Cache(capacity=32)  # session_uid of a hair → `_Corners`


def at_roots(hair_object, depsgraph, kind, places, firsts):
    """Return (S, 3) float32 scene-linear colors of a hair's surface at its roots; None if the surface has no such
    colors.

    kind: ATTRIBUTE for the active color attribute, TEXTURE for the active image of each material at the active UV map;
    places: (vertices, barycentric coordinates) of the roots, each (S, 3); firsts: (S, 3) local first points of the
    strands, for roots on faces that have changed. Materials without an image have their viewport color.
    """
    surface_object = hair_object.data.surface
    if surface_object is None or surface_object.type != "MESH" or kind not in {ATTRIBUTE, TEXTURE}:
        return None
    evaluated = surface_object.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        layer = mesh.color_attributes.active_color if kind == ATTRIBUTE else mesh.uv_layers.active
        if layer is None or not len(mesh.polygons):
            return None
        faces = scene.cached_faces(surface_object, mesh)
        vertices, barycentric = _places_on(surface_object, depsgraph, faces, len(mesh.vertices), places, firsts)
        if vertices is None:
            return None
        corners = _corners(hair_object, faces, len(mesh.vertices), vertices)
        if kind == ATTRIBUTE:
            at_corners = _colors_of(layer)
            return _weighed(at_corners[vertices if layer.domain == "POINT" else corners], barycentric)
        uvs = np.empty((len(mesh.loops), 2), np.float32)
        layer.uv.foreach_get("vector", uvs.ravel())
        slots = np.zeros(len(mesh.polygons), np.int32)
        mesh.polygons.foreach_get("material_index", slots)
        polygons = np.searchsorted(faces.starts, corners[:, 0], side="right") - 1
        return _of_materials(hair_object, evaluated, slots[polygons], _weighed(uvs[corners], barycentric))
    finally:
        evaluated.to_mesh_clear()


def _places_on(surface_object, depsgraph, faces, vertex_count, places, firsts):
    """Return (vertices, barycentric) on the evaluated mesh; the nearest where a root is on no face of it."""
    if places is None or len(places[0]) != len(firsts):
        places = np.zeros((len(firsts), 3), np.int32), np.zeros((len(firsts), 3), np.float32)
    vertices, barycentric = places[:2]
    is_lost = ~barycentric.any(axis=1) | (vertices >= vertex_count).any(axis=1)
    wanted = np.where(is_lost[:, None], -1, vertices)
    lost = np.flatnonzero(is_lost | (geometry.faces.face_places.polygons_with(faces, vertex_count, wanted) < 0))
    if len(lost):
        surface = scene.read_surface(surface_object, depsgraph)
        if len(surface.rest) != vertex_count:
            return None, None
        vertices, barycentric = vertices.copy(), barycentric.copy()
        vertices[lost], barycentric[lost] = surface.nearest_places(np.ascontiguousarray(firsts[lost]))
    return vertices, barycentric


def _corners(hair_object, faces, vertex_count, vertices):
    """Return (S, 3) corners of the polygons with these vertices (S, 3)."""
    key = hair_object.session_uid
    known = corner_cache.get(key)
    if known is None or known.faces is not faces or not np.array_equal(known.vertices, vertices):
        polygons = np.maximum(geometry.faces.face_places.polygons_with(faces, vertex_count, vertices), 0)
        corners = np.maximum(geometry.faces.face_places.corners_of(faces, polygons, vertices), 0)
        known = corner_cache.keep(key, _Corners(faces, vertices, faces.starts[polygons][:, None] + corners))
    return known.corners


def _colors_of(attribute):
    """Return (N, 3) float32 linear colors of a color attribute."""
    colors = np.empty((len(attribute.data), 4), np.float32)
    attribute.data.foreach_get("color", colors.ravel())
    return colors[:, :3]


def _weighed(values, barycentric):
    """Return (S, C) from the values (S, 3, C) of three corners."""
    return np.einsum("scv,sc->sv", values, barycentric).astype(np.float32)


def _of_materials(hair_object, evaluated, slots, uvs):
    """Return (S, 3) colors of the materials in `slots` (S,) at UVs (S, 2)."""
    colors = np.full((len(uvs), 3), 0.8, np.float32)
    materials = [slot.material for slot in evaluated.material_slots] or [None]
    slots = np.clip(slots, 0, len(materials) - 1)
    for slot, material in enumerate(materials):
        rows = np.flatnonzero(slots == slot)
        if material is None or not len(rows):
            continue
        node = active_image_node(material.node_tree)
        if node is None:
            colors[rows] = material.diffuse_color[:3]
        else:
            key = node.image.original.session_uid, hair_object.session_uid, slot, node.extension, node.interpolation
            colors[rows] = _sampled(key, node, uvs[rows])
    return colors


def active_image_node(tree):
    """Return the node whose image Workbench shows for a material, an Image Texture with pixels; None: its viewport
    color.
    """
    node = None if tree is None else _active_texture(tree)
    if node is None or node.type != "TEX_IMAGE" or node.image is None or node.image.source not in {"FILE", "GENERATED"}:
        return None
    return node if all(node.image.size) else None  # the access loads the file if necessary


def _active_texture(tree):
    """Return the active texture node: of the active group, of the tree, of other groups; else the first; or None."""
    active, shown = tree.nodes.active, next((node for node in tree.nodes if node.show_texture), None)
    if shown is not None and shown == active:
        return shown
    groups = [node for node in tree.nodes if node.type == "GROUP" and node.node_tree is not None]
    inside = {node: _active_texture(node.node_tree) for node in groups}
    if active is not None and inside.get(active) is not None:
        return inside[active]
    first = next((node for node in tree.nodes if node.bl_idname.startswith("ShaderNodeTex")), None)
    others = [found for found in inside.values() if found is not None and (found.show_texture or first is None)]
    return shown or next(iter(others), first)


def _sampled(key, node, uvs):
    known = sample_cache.get(key)
    if known is None or not np.array_equal(known.uvs, uvs):
        image: bpy.types.Image = node.image
        width, height = image.size
        pixels = np.empty((height, width, image.channels), np.float32)
        image.pixels.foreach_get(pixels.ravel())
        colors = pixels[..., :3] if image.channels > 2 else np.repeat(pixels[..., :1], 3, axis=2)
        at_roots = look_up(colors, uvs, node.extension, node.interpolation == "Closest")
        if not image.is_float and image.colorspace_settings.name == "sRGB":
            at_roots = _linear(at_roots)
        known = sample_cache.keep(key, _Sampled(uvs, at_roots))
    return known.colors


_FOLD = {
    "REPEAT": lambda texel, size: texel % size,
    "MIRROR": lambda texel, size: size - 1 - np.abs(texel % (2 * size) - size + (texel % (2 * size) < size)),
}


def look_up(pixels, uvs, extension, is_closest):
    """Return (S, C) values of (H, W, C) pixels at UVs (S, 2), between four texels, or of the closest."""
    size = np.array(pixels.shape[1::-1])
    uvs = np.where(np.isfinite(uvs) & (np.abs(uvs) < 1e6), uvs, 0.0).astype(np.float64)
    place = uvs * size - (0.0 if is_closest else 0.5)
    first = np.floor(place).astype(np.int64)
    share = np.zeros_like(place) if is_closest else place - first
    found = np.zeros((len(uvs), pixels.shape[2]))
    fold = _FOLD.get(extension, lambda texel, count: np.clip(texel, 0, count - 1))
    for column in (0, 1):
        for row in (0, 1):
            weight = np.abs(1 - column - share[:, 0]) * np.abs(1 - row - share[:, 1])
            texel = fold(first[:, 0] + column, size[0]), fold(first[:, 1] + row, size[1])
            found += weight[:, None] * pixels[texel[1], texel[0]]
    return found.astype(np.float32)


def _linear(encoded):
    """Linear values of sRGB-encoded values (IEC 61966-2-1)."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((np.maximum(encoded, 0.04045) + 0.055) / 1.055) ** 2.4)
