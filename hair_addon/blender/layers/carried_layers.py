# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers that are carried to guides that are grown again, with other settings or roots, or that are added."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from bpy.types import Curves, Depsgraph

from ...core.geometry import mesh as mesh_math
from ...core.geometry import strands
from ...core.geometry.mesh import SurfacePoints
from ...core.geometry.strands import Strands
from ...core.grooming import following, groom, guide_layers, layer_transfer
from ...core.grooming.groom import HairSettings
from ...core.grooming.guide_layers import GuideLayers
from ...core.interpolation.hair_binding import HairBinding
from ..data import scene
from ..data.strands import attributes, curves, gathered_groups, layer_attributes, partings
from ..data.surfaces import Surface
from ..settings import layer_items, setting_properties
from . import recording


@dataclass(frozen=True)
class LayersBefore:
    """Layers of guides before these are grown again: their roots on the surface, and partings between them.

    gathered: of gathered guides, or None.

    depsgraph: of that time, as an update in between would record half-written guides.
    """

    layers: GuideLayers
    guides: Strands
    settings: HairSettings
    parting: partings.Partings
    gathered: gathered_groups.Gathered | None
    depsgraph: Depsgraph


def read(guides: Curves | None, surface: Surface) -> LayersBefore | None:
    """Record the edits of guides on a `Surface` and return their `LayersBefore`; None if they have no layers."""
    if guides is None or not len(guides.vellus.layers) or not layer_attributes.has_base(guides):
        return None
    if not len(guides.curves) or attributes.is_from_library(guides):
        return None
    depsgraph = scene.last_depsgraph()
    recording.update(guides, depsgraph)
    followers = curves.followers(guides)
    settings = HairSettings()
    if followers:
        settings = setting_properties.to_settings(followers[0].vellus.hair, HairSettings)
    parting = partings.read(guides.surface, surface, guides, settings, depsgraph)
    its_guides, gathered = curves.read_guides(guides, surface, "cpu"), gathered_groups.read(guides)
    return LayersBefore(recording.read(guides, depsgraph), its_guides, settings, parting, gathered, depsgraph)


def write(guides: Curves, surface: Surface, before: LayersBefore, roots: SurfacePoints) -> None:
    """Give guides that were grown again at `roots` the layers that they had."""
    counts, local = curves.point_counts(guides), curves.read_points(guides)
    normals = surface.to_local_normals(mesh_math.normals(surface.mesh, roots))
    bare = guide_layers.without_layers(local, counts, normals)
    layers, nearest = _carried(surface, before, roots, bare)
    layer_attributes.write(guides, layers, layer_items.identities_of(guides.vellus))
    guides.vellus.is_base_grown = True
    recording.note_shown(guides, before.depsgraph)
    recording.show(guides, guide_layers.composed(recording.read(guides, before.depsgraph)))
    gathered = None if before.gathered is None else before.gathered[nearest]
    gathered_groups.write(guides, gathered)


def between(surface: Surface, before: LayersBefore, roots: SurfacePoints, base: np.ndarray) -> GuideLayers:
    """Return new guides at `roots` with the layers of the guides around them; base (M, P, 3), in local coordinates."""
    normals = surface.to_local_normals(mesh_math.normals(surface.mesh, roots))
    counts = np.full(len(base), base.shape[1], np.int32)
    bare = guide_layers.without_layers(base.reshape(-1, 3), counts, normals)
    return _carried(surface, before, roots, bare)[0]


def replace_last(guides: Curves, before: LayersBefore, parts: Sequence[GuideLayers]) -> None:
    """Give the last guides, which a tool has added, layers of their own; settings no longer grow the base.

    parts: of the last guides, one after another. Guides before them keep their points.
    """
    guides.vellus.is_base_grown = False
    layers = recording.read(guides, before.depsgraph)
    others = np.arange(len(layers.counts) - sum(len(part.counts) for part in parts))
    joined = layer_transfer.joined([layer_transfer.chosen_guides(layers, others), *parts])
    joined = joined.weighted(layers.weights)
    layer_attributes.write(guides, joined, layer_items.identities_of(guides.vellus))
    recording.note_shown(guides, before.depsgraph)
    recording.show_layers(guides, joined)


def binding_of(
    surface: Surface, before: LayersBefore, roots: SurfacePoints, guides: Strands | None = None
) -> HairBinding:
    """Return the `HairBinding` of `roots` to guides, as for strands; guides: None for the former guides."""
    own = strands.from_numpy(before.guides.numpy(), before.guides.roots, "cpu") if guides is None else guides
    regions = before.parting.regions
    if guides is not None:
        regions = tuple(region for region in regions if region.guides is None)  # indices of the former guides
    return groom.bind_hair(
        surface.mesh,
        own,
        before.settings,
        regions=regions,
        lines=before.parting.lines,
        drawn_on=surface.drawn_on,
        roots=roots,
        is_mirrored=surface.has_flipped_winding,
        tie_fractions=before.parting.tie_fractions if guides is None else None,
    )


def _carried(surface, before, roots, bare):
    """Return (layers of guides `bare` at M roots, taken from the guides around them; the nearest guides (M,)).

    Gathered guides are at means of points, like the hair between them.
    """
    own = before.guides.roots
    if own.is_same(roots):
        indices = np.arange(len(roots), dtype=np.int32)[:, None]
        weights, apart = np.ones(indices.shape), np.zeros(len(roots))
        return layer_transfer.transferred(before.layers, bare, indices, weights, apart), indices[:, 0]
    binding = binding_of(surface, before, roots)
    guides = strands.from_numpy(before.guides.numpy(), own, "cpu")
    indices, weights = binding.guide_weights.indices.numpy(), binding.guide_weights.weights.numpy()
    nearest = np.maximum(indices[:, 0], 0)
    first = mesh_math.positions(surface.mesh, own)[nearest]
    apart = np.linalg.norm(first - mesh_math.positions(surface.mesh, roots), axis=1)
    apart /= surface.extent * surface.scale
    layers = layer_transfer.transferred(before.layers, bare, indices, weights, apart)
    is_between = apart > layer_transfer.SAME_PLACE
    is_gathered = is_between & (before.gathered is not None and before.gathered.groups[nearest] > 0)
    if is_gathered.any() and (layers.counts == guides.point_count).all():
        means = surface.to_local(following.follow_guides(binding, guides).numpy())
        layers = layer_transfer.at_points(layers, means.reshape(-1, 3), is_gathered)
    return layers, nearest
