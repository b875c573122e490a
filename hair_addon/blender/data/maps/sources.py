# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of maps at the roots of strands, from images, vertex groups and attributes."""

from dataclasses import dataclass

import bpy
import numpy as np

from ....core import geometry, maps
from ....core.errors import HairError
from ....core.geometry.mesh import SurfacePoints
from ....core.maps import combination, pixels
from ....core.maps.map_settings import MapSettings
from ...host.caches import Cache
from ...host.notices import name_of
from .. import scene
from ..strands import attributes, curves, stored_roots
from ..surfaces import Surface
from . import image_pixels

_CLUMP = "clump_index"  # attribute of the hair's Curves


@dataclass(frozen=True, eq=False)
class Strands:
    """Strands that maps are read for.

    roots: (S,) on the `Surface`, both None for hair without a surface; identities, clumps: (S,) int32, clumps None if
    the hair has none.
    """

    curves: bpy.types.Curves
    surface_object: bpy.types.Object | None
    surface: Surface | None
    roots: SurfacePoints | None
    identities: np.ndarray
    randoms: np.ndarray
    clumps: np.ndarray | None


def present_depsgraph():
    """The depsgraph of the view layer as it is: maps are read while handlers run, which must not update it."""
    return bpy.context.view_layer.depsgraph or scene.present_depsgraph()


def stored_strands(hair):
    """The `Strands` of hair Curves as they are stored. Raises `HairError`."""
    surface, roots = None, None
    if hair.surface is not None:
        surface = scene.read_surface(hair.surface, present_depsgraph())
        roots = stored_roots.points(hair, surface)
    identities = attributes.read(hair, "id", "INT", "CURVE")
    return Strands(
        hair,
        hair.surface,
        surface,
        roots,
        np.arange(len(hair.curves), dtype=np.int32) if identities is None else identities,
        curves.read_randoms(hair),
        attributes.read(hair, _CLUMP, "INT", "CURVE"),
    )


def masks(strands: Strands, settings: MapSettings, image) -> np.ndarray:
    """(S,) float32 masks of a map; NaN where it has no value. Raises `HairError` if its source is missing.

    image: of a map of the kind IMAGE.
    """
    return _read(strands, settings, image, is_color=False)[:, 0]


def colors(strands: Strands, settings: MapSettings, image) -> tuple[np.ndarray, np.ndarray]:
    """Colors (S, 3) and alpha (S,) of a map; NaN where it has no value. Raises `HairError`."""
    return pixels.unpremultiplied(_read(strands, settings, image, is_color=True))


def _read(strands, settings, image, is_color):
    """(S, 1) masks, or (S, 4) colors with alpha."""
    if settings.kind == "IMAGE":
        return _of_image(strands, settings, image, is_color)
    if settings.kind == "STRAND":
        return _as(combination.random_masks(strands.identities, settings.seed)[:, None], is_color)
    if settings.kind == "CLUMP":
        if strands.clumps is None:
            raise HairError("There are no clumps for a random map: add the style Clump.")
        return _as(combination.random_masks(strands.clumps, settings.seed)[:, None], is_color)
    if settings.kind == "CURVES":
        return _as(_finite(_of_curves(strands.curves, settings.source)), is_color)
    _require_roots(strands)
    if settings.kind == "GROUP":
        corners = _of_group(strands, settings.source)
    else:
        corners = _of_attribute(strands, settings.source)
    at_roots = np.einsum("nck,nc->nk", corners[strands.roots.triangle], strands.roots.barycentric)
    # Barycentric coordinates sum to one up to rounding.
    owned = corners[strands.roots.triangle]
    return _as(np.clip(at_roots, owned.min(axis=1), owned.max(axis=1)).astype(np.float32), is_color)


def _finite(values):
    return np.where(np.isfinite(values), values, np.float32(0.0))


def _as(values, is_color):
    """Values (S, 1 or 3 or 4) as masks (S, 1) or as colors with alpha (S, 4)."""
    width = values.shape[1]
    if is_color:
        found = np.ones((len(values), 4), np.float32)
        found[:, :3] = values[:, :3] if width > 1 else values
        return found
    if width == 1:
        return values
    is_gray = (values[:, 1:3] == values[:, :1]).all(axis=1, keepdims=True)
    return np.where(is_gray, values[:, :1], values[:, :3].mean(axis=1, keepdims=True)).astype(np.float32)


def _require_roots(strands):
    if strands.roots is None:
        sentence = 'The strands of "{name}" have no roots on a surface: attach the hair to a mesh.'
        raise HairError(sentence, name=name_of(strands.curves))


@dataclass(frozen=True, eq=False)
class _Known:
    """`RootTexels` and the inputs that they depend on."""

    roots: SurfacePoints
    corner_uvs: np.ndarray
    sizes: dict
    texels: "maps.box_filter.RootTexels"


# (session_uid of hair, UV map, sizes) → `_Known`, which is checked.
texel_cache = Cache(capacity=16)


def _of_image(strands, settings, image, is_color):
    if image is None:
        sentence = 'There is no image "{name}": pick another image, or clear the field.'
        raise HairError(sentence, name=settings.source)
    _require_roots(strands)
    found = image_pixels.read(image, is_color)
    uvs = _corner_uvs(strands, settings.uv)
    sizes = {tile: values.shape[1::-1] for tile, values in found.items()}
    key = strands.curves.session_uid, settings.uv, tuple(sizes.items())
    known = texel_cache.get(key)
    if known is None or not (known.roots.is_same(strands.roots) and np.array_equal(known.corner_uvs, uvs)):
        texels = maps.box_filter.root_texels(strands.surface.mesh, uvs, strands.roots, sizes)
        known = texel_cache.keep(key, _Known(strands.roots, uvs, sizes, texels))
    return known.texels.sample(found)


def _corner_uvs(strands, name):
    """(F, 3, 2) float32 of a UV map by name; empty: the active UV map."""
    surface = strands.surface
    if not name or name == surface.uv_map:
        if surface.corner_uvs is None:
            raise HairError('"{name}" has no UV map for the images of its hair: create one.', name=surface.name)
        return surface.corner_uvs
    values = _corner_values(strands, name)
    if values is None or values.shape[2] != 2:
        raise HairError('"{name}" has no UV map "{uv}": pick another UV map.', name=surface.name, uv=name)
    return values


def _of_group(strands, name):
    surface_object = strands.surface_object
    if surface_object.vertex_groups.get(name) is None:
        sentence = '"{name}" has no vertex group "{group}": pick another group.'
        raise HairError(sentence, name=strands.surface.name, group=name)
    weights = scene.read_weights(surface_object, strands.surface, present_depsgraph(), name)
    _require_same(strands, len(weights) == len(strands.surface.rest))
    return weights[strands.surface.mesh.triangles][..., None]


def _of_attribute(strands, name):
    values = _corner_values(strands, name)
    if values is None:
        sentence = '"{name}" has no attribute "{attribute}" of numbers or colors: pick another attribute.'
        raise HairError(sentence, name=strands.surface.name, attribute=name)
    return _finite(values)


def _of_curves(hair, name):
    """(S, C) of an attribute of hair Curves; on points, its values at the roots."""
    attribute = hair.attributes.get(name)
    if attribute is None or attribute.data_type not in attributes.LAYOUTS:
        sentence = '"{name}" has no attribute "{attribute}" of numbers or colors: pick another attribute.'
        raise HairError(sentence, name=name_of(hair), attribute=name)
    values = _values(attribute)
    return values[curves.curve_offsets(hair)[:-1]] if attribute.domain == "POINT" else values


def _values(attribute):
    field, width, scalar = attributes.LAYOUTS[attribute.data_type]
    values = np.empty(len(attribute.data) * width, scalar)
    attribute.data.foreach_get(field, values)
    return values.reshape(-1, width).astype(np.float32)


def _corner_values(strands, name):
    """(F, 3, C) float32 at the corners of triangles of an attribute on any domain; None without it."""
    surface = strands.surface
    depsgraph = present_depsgraph()
    evaluated = strands.surface_object.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        attribute = mesh.attributes.get(name)
        if attribute is None or attribute.data_type not in attributes.LAYOUTS:
            return None
        domain, values = attribute.domain, _values(attribute)
        if domain == "EDGE":
            domain, values = "POINT", _of_edges(mesh, values)
    finally:
        evaluated.to_mesh_clear()
    values = scene.on_surface(strands.surface_object, surface, depsgraph, values, domain)
    faces, triangles = surface.faces, surface.mesh.triangles
    sizes = {"POINT": len(surface.rest), "CORNER": len(faces.corner_vertices), "FACE": len(faces.starts) - 1}
    _require_same(strands, domain in sizes and len(values) == sizes[domain])
    if domain == "POINT":
        return values[triangles]
    owners = geometry.faces.face_places.owners(faces)
    if domain == "FACE":
        return np.repeat(values[owners][:, None], 3, axis=1)
    return values[faces.starts[owners][:, None] + geometry.faces.face_places.corners_of(faces, owners, triangles)]


def _of_edges(mesh, values):
    """(V, C) means of the edges at each vertex."""
    ends = np.empty(2 * len(mesh.edges), np.int32)
    mesh.edges.foreach_get("vertices", ends)
    found = np.zeros((len(mesh.vertices), values.shape[1]))
    for channel in range(values.shape[1]):
        found[:, channel] = np.bincount(ends, np.repeat(values[:, channel], 2), len(found))
    counts = np.bincount(ends, minlength=len(found))
    return (found / np.maximum(counts, 1)[:, None]).astype(np.float32)


def _require_same(strands, is_same):
    if not is_same:
        sentence = 'The mesh of "{name}" has changed: the hair updates when you leave its paint mode.'
        raise HairError(sentence, name=strands.surface.name)
