# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of maps at the roots of strands, from images, vertex groups and attributes."""

from dataclasses import dataclass, replace

import bpy
import numpy as np

from ....core import maps
from ....core.errors import HairError
from ....core.geometry.mesh import SurfacePoints
from ....core.maps import combination
from ....core.maps.map_settings import MapSettings
from ....core.params import Param
from ...host.caches import Cache
from ...host.notices import name_of
from .. import scene
from ..strands import attributes, curves, stored_roots, style_inputs
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


def stored_strands(hair):
    """Return the `Strands` of hair Curves as they are stored. Raises `HairError`."""
    surface, roots = None, None
    surface_object = curves.grown_on(hair)
    if surface_object is not None:
        surface = scene.read_surface(surface_object, scene.last_depsgraph())
        roots = _known_roots(hair, surface)
    identities = attributes.read(hair, "id", "INT", "CURVE")
    return Strands(
        hair,
        surface_object,
        surface,
        roots,
        np.arange(len(hair.curves), dtype=np.int32) if identities is None else identities,
        curves.read_randoms(hair),
        attributes.read(hair, _CLUMP, "INT", "CURVE"),
    )


def _known_roots(hair, surface):
    """Return `stored_roots.points`, cached while nothing changes, so that painting does not check roots again."""
    stored, known = stored_roots.stored(hair), root_cache.get(hair.session_uid)
    if known is not None and _has_same_faces(known[0], surface) and all(map(_are_equal, known[1], stored)):
        return known[2]
    found = stored_roots.points_of(stored, surface)
    if found is not None:
        root_cache.keep(hair.session_uid, (surface, stored, found))
    return found


def _has_same_faces(surface, other):
    """Whether two `Surface`s have the same faces; their poses may differ."""
    return surface.mesh is other.mesh and surface.is_turned == other.is_turned


def _are_equal(one, two):
    return one is two or (one is not None and two is not None and np.array_equal(one, two))


# session_uid of hair → (`Surface`, `stored_roots.stored`, `SurfacePoints`); the first two are compared.
root_cache = Cache(capacity=4)


@dataclass(frozen=True, eq=False)
class Source:
    """Data that a map reads from Blender, which determine its values at any roots.

    hair_uid: session UID of the hair; corners: (F, 3, C) float32 of a vertex group or attribute, or the UVs for an
    image; pixels: {UDIM tile: (H, W, C)} of an image; of_curves: (S, C) of an attribute of the hair; None for other
    kinds. ramp: (N, 1 or 4) samples of the map's ramp, which turns masks into numbers or colors; is_color: of the
    values before the ramp.
    """

    settings: MapSettings
    is_color: bool
    hair_uid: int
    surface: Surface | None = None
    corners: np.ndarray | None = None
    pixels: dict | None = None
    of_curves: np.ndarray | None = None
    ramp: np.ndarray | None = None

    @property
    def combination(self) -> combination.Combination:
        """How `values` change the setting: a ramp has inverted them already."""
        how = self.settings.combination
        return how if self.ramp is None else replace(how, is_inverted=False)

    def values(self, roots, identities: np.ndarray, clumps: np.ndarray | None) -> np.ndarray:
        """Return (S, 1) masks or (S, 4) colors with alpha of strands; NaN where the map has none.

        roots, identities, clumps: as of `Strands`.
        """
        found = self._before_ramp(roots, identities, clumps)
        return found if self.ramp is None else combination.ramped(found[:, 0], self.ramp, self.settings.is_inverted)

    def _before_ramp(self, roots, identities, clumps):
        if self.pixels is not None:
            return self._of_image(roots)
        if self.corners is not None:
            return self._at_roots(roots)
        if self.of_curves is not None:
            count = len(identities)
            found = self.of_curves if len(self.of_curves) == count else np.full((count, 1), np.nan, np.float32)
        elif self.settings.kind == "CLUMP":
            found = np.full((len(identities), 1), np.nan, np.float32)
            if clumps is not None:
                found = combination.random_masks(clumps, self.settings.seed)[:, None]
        else:
            found = combination.random_masks(identities, self.settings.seed)[:, None]
        return _as(found, self.is_color)

    def is_same(self, other: "Source | None") -> bool:
        """Whether both give the same values at the same roots."""
        if other is None or (self.settings, self.is_color) != (other.settings, other.is_color):
            return False
        pairs = [(self.corners, other.corners), (self.of_curves, other.of_curves), (self.ramp, other.ramp)]
        if (self.pixels is None) != (other.pixels is None):
            return False
        if self.pixels is not None and self.pixels is not other.pixels:
            if self.pixels.keys() != other.pixels.keys():
                return False
            pairs += [(self.pixels[tile], other.pixels[tile]) for tile in self.pixels]
        return all(_are_equal(one, two) for one, two in pairs)

    def _at_roots(self, roots):
        owned = self.corners[roots.triangle]
        at_roots = np.einsum("nck,nc->nk", owned, roots.barycentric)
        # Barycentric coordinates sum to one up to rounding.
        return _as(np.clip(at_roots, owned.min(axis=1), owned.max(axis=1)).astype(np.float32), self.is_color)

    def _of_image(self, roots):
        sizes = {tile: values.shape[1::-1] for tile, values in self.pixels.items()}
        key = self.hair_uid, self.settings.uv, tuple(sizes.items()), len(roots)
        known = texel_cache.get(key)
        if known is None or not (_are_same(known.roots, roots) and _are_equal(known.corner_uvs, self.corners)):
            texels = maps.box_filter.root_texels(self.surface.mesh, self.corners, roots, sizes)
            known = texel_cache.keep(key, _Known(roots, self.corners, sizes, texels))
        key = self.hair_uid, self.settings.uv, self.settings.source, self.is_color
        before = mean_cache.get(key)
        means = self._means(known.texels, before)
        mean_cache.keep(key, _Means(known.texels, self.pixels, means))
        return means

    def _means(self, texels, before):
        """Return the means of an image; only strands at changed texels, or on changed tiles, get new means."""
        is_tiled = set(self.pixels) != {None}
        if before is None or before.texels is not texels:
            return texels.sample(self.pixels if is_tiled else {None: self._levels(self.pixels[None])})
        if is_tiled:
            tiles = self.pixels.items()
            changed = {tile: values for tile, values in tiles if not _are_equal(before.pixels[tile], values)}
            return texels.resample(before.means, changed) if changed else before.means
        now = self.pixels[None]
        if before.pixels[None] is now:
            return before.means
        box = image_pixels.changed_since(before.pixels[None], now)
        return texels.follow(before.means, self._levels(now), box)

    def _levels(self, values):
        """Return the `Levels` of an image without tiles. They are kept, and updated when the image changes."""
        key = self.settings.source, self.is_color
        levels = level_cache.get(key)
        if levels is None or levels.pixels.shape != values.shape:
            return level_cache.keep(key, maps.box_filter.Levels(values))
        levels.follow(values, image_pixels.changed_since(levels.pixels, values))
        return levels


def masks(strands: Strands, settings: MapSettings, image) -> np.ndarray:
    """Return (S,) float32 masks of a map; NaN where it has no value. Raises `HairError` if its source is missing.

    image: of a map of the kind IMAGE.
    """
    return values_of(strands, settings, image)[0][:, 0]


def varied_numbers(
    strands: Strands, settings: MapSettings, image, value: float, details: Param, ramp: np.ndarray | None = None
) -> np.ndarray:
    """Return (S,) float64 of a setting with a value by its map. Raises `HairError` if the source is missing.

    ramp: (N, 1) of `ramps.map_samples`.
    """
    found, how = values_of(strands, settings, image, ramp=ramp)
    return combination.varied_number(value, found[:, 0], how, details)


def values_of(
    strands: Strands, settings: MapSettings, image, is_color: bool = False, ramp: np.ndarray | None = None
) -> tuple[np.ndarray, combination.Combination]:
    """Return (`Source.values` of strands, their `Combination`). Raises `HairError` if the source is missing.

    is_color: of the values before the ramp; ramp: (N, 1 or 4) of `ramps.map_samples`.
    """
    if settings.kind == "CLUMP" and strands.clumps is None:
        raise HairError("There are no clumps for a random map: add the style Clump.")
    if settings.kind in _ON_SURFACE and strands.roots is None:
        raise _without_roots(strands.curves)
    found = read(strands.curves, strands.surface_object, strands.surface, settings, image, is_color, ramp)
    if found.of_curves is not None and len(found.of_curves) != len(strands.identities):
        sentence = 'The attribute "{attribute}" of "{name}" has values for other strands: pick another attribute.'
        raise HairError(sentence, attribute=settings.source, name=name_of(strands.curves))
    return found.values(strands.roots, strands.identities, strands.clumps), found.combination


_ON_SURFACE = ("IMAGE", "GROUP", "ATTRIBUTE")


def read(hair, surface_object, surface, settings: MapSettings, image, is_color=False, ramp=None) -> Source:
    """Return the `Source` of a map of hair Curves on the `Surface` of an object. Raises `HairError` if it is
    missing.
    """
    found = _read(hair, surface_object, surface, settings, image, is_color)
    return found if ramp is None else replace(found, ramp=ramp)


def _read(hair, surface_object, surface, settings, image, is_color):
    known = settings, is_color, hair.session_uid
    if settings.kind in ("STRAND", "CLUMP"):
        return Source(*known)
    if settings.kind == "CURVES":
        return Source(*known, of_curves=_finite(_of_curves(hair, settings.source)))
    if settings.kind == "IMAGE" and image is None:
        sentence = 'There is no image "{name}": pick another image, or clear the field.'
        raise HairError(sentence, name=settings.source)
    if surface is None:
        raise _without_roots(hair)
    if settings.kind == "IMAGE":
        found = image_pixels.read(image, is_color)
        return Source(*known, surface, _corner_uvs(surface_object, surface, settings.uv), found)
    if settings.kind == "GROUP":
        return Source(*known, surface, _of_group(surface_object, surface, settings.source))
    return Source(*known, surface, _of_attribute(surface_object, surface, settings.source))


def _without_roots(hair):
    sentence = 'The strands of "{name}" have no roots on a surface: attach the hair to a mesh.'
    return HairError(sentence, name=name_of(hair))


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


def _are_same(roots, others):
    return roots is others or roots.is_same(others)


@dataclass(frozen=True, eq=False)
class _Known:
    """`RootTexels` and the inputs that they depend on."""

    roots: SurfacePoints
    corner_uvs: np.ndarray
    sizes: dict
    texels: "maps.box_filter.RootTexels"


# (session_uid of hair, UV map, sizes, number of roots) → `_Known`, which is checked.
texel_cache = Cache(capacity=16)
# (name of an image, whether as colors) → `Levels` of an image without tiles.
level_cache = Cache(capacity=2)


@dataclass(frozen=True, eq=False)
class _Means:
    """Means (S, C) of an image, and the `RootTexels` and {tile: pixels} that they depend on."""

    texels: "maps.box_filter.RootTexels"
    pixels: dict
    means: np.ndarray


# (session_uid of hair, UV map, name of an image, whether as colors) → `_Means`, which are compared.
mean_cache = Cache(capacity=4)


def _corner_uvs(surface_object, surface, name):
    """Return (F, 3, 2) float32 of a UV map by name; empty: the active UV map."""
    if not name or name == surface.uv_map:
        if surface.corner_uvs is None:
            raise HairError('"{name}" has no UV map for the images of its hair: create one.', name=surface.name)
        return surface.corner_uvs
    values = _corner_values(surface_object, surface, name)
    if values is None or values.shape[2] != 2:
        raise HairError('"{name}" has no UV map "{uv}": pick another UV map.', name=surface.name, uv=name)
    return values


def _of_group(surface_object, surface, name):
    """Return (F, 3, 1) float32 weights of a vertex group."""
    if surface_object.vertex_groups.get(name) is None:
        sentence = '"{name}" has no vertex group "{group}": pick another group.'
        raise HairError(sentence, name=surface.name, group=name)
    weights = scene.read_weights(surface_object, surface, scene.last_depsgraph(), name)
    style_inputs.require_same(surface_object, len(weights) == len(surface.rest))
    return weights[surface.mesh.triangles][..., None]


def _of_attribute(surface_object, surface, name):
    values = _corner_values(surface_object, surface, name)
    if values is None:
        sentence = '"{name}" has no attribute "{attribute}" of numbers or colors: pick another attribute.'
        raise HairError(sentence, name=surface.name, attribute=name)
    return _finite(values)


def _of_curves(hair, name):
    """Return (S, C) of an attribute of hair Curves; on points, its values at the roots."""
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


def _corner_values(surface_object, surface, name):
    """Return an attribute of any domain as (F, 3, C) float32 at the corners of triangles; None if it does not exist."""
    depsgraph = scene.last_depsgraph()
    evaluated = surface_object.evaluated_get(depsgraph)
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
    return style_inputs.at_corners(surface_object, surface, depsgraph, values, domain)


def _of_edges(mesh, values):
    """Return (V, C) means of the edges at each vertex."""
    ends = np.empty(2 * len(mesh.edges), np.int32)
    mesh.edges.foreach_get("vertices", ends)
    found = np.zeros((len(mesh.vertices), values.shape[1]))
    for channel in range(values.shape[1]):
        found[:, channel] = np.bincount(ends, np.repeat(values[:, channel], 2), len(found))
    counts = np.bincount(ends, minlength=len(found))
    return (found / np.maximum(counts, 1)[:, None]).astype(np.float32)
