# SPDX-License-Identifier: GPL-3.0-or-later
"""Tools that add and remove guides: all others keep their bits, order and attributes."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from bpy.types import Curves, Depsgraph

from ....core import geometry, grooming
from ....core.errors import HairError
from ....core.geometry import mesh as mesh_math
from ....core.geometry import strands
from ....core.geometry.mesh import SurfacePoints
from ....core.grooming import guide_layers, layer_transfer
from ....core.grooming.groom import POINT_COUNT, HairSettings
from ....core.grooming.guide_layers import GuideLayers
from ....core.grooming.guide_tool_settings import CountSettings, MirrorSettings
from ...data import masks
from ...data.strands import curves, gathered_groups, guide_curves, partings
from ...layers import carried_layers
from ...layers.carried_layers import LayersBefore
from ...settings import preferences
from .. import pipeline
from . import guide_tools, outside_guides
from .guide_tools import CombedGuides

# Points (M, P, 3) [m], guides (M,) whose attributes are copied, and roots.
Additions = tuple[np.ndarray, np.ndarray, SurfacePoints]

_ASIDE = 0.3  # share of guides, beyond one half, that a tie gathers from one side if it is not in the middle


def change_count(datablock: Curves, settings: CountSettings, depsgraph: Depsgraph) -> int:
    """Add guides between existing ones or remove crowded ones; returns the new number of guides.

    Raises `HairError` before anything changes.
    """
    guides = guide_tools.read(datablock, settings, depsgraph)
    difference = grooming.guide_count.difference(settings, guides.weights)
    before = carried_layers.read(datablock, guides.surface)
    layers = []
    if difference > 0:
        roots = _new_roots(guides, difference, settings.mask, depsgraph)
        if before is not None:
            bare = replace(guides, points=guides.surface.from_local(before.layers.base))
            base = guides.surface.to_local(_between(bare, roots, depsgraph)[0])
            layers = [carried_layers.between(guides.surface, before, roots, base)]
        write(guides, [(*_between(guides, roots, depsgraph), roots)], np.zeros(0, np.int64), before, layers)
        if datablock.vellus.keeps_outside:
            outside_guides.push_new(datablock, guides.local, depsgraph)
    elif difference < 0:
        write(guides, [], _crowded(guides, -difference, depsgraph), before)
    return len(datablock.curves)


def mirror(datablock: Curves, settings: MirrorSettings, depsgraph: Depsgraph) -> int:
    """Replace the guides on one side of the object by mirror images of the others; returns the number of images.

    Raises `HairError` before anything changes.
    """
    guides = guide_tools.read(datablock, settings, depsgraph)
    mesh, mirror = guides.surface.mesh, guides.surface.mirror
    plane = mirror if settings.direction == "FROM_POSITIVE" else mirror.flipped()
    places = mesh_math.positions(mesh, guides.roots)
    found = grooming.guide_copies.mirroring(mesh, places, plane, guides.weights >= 0.5)
    before = carried_layers.read(datablock, guides.surface)
    additions, layers = [], []
    for count in np.unique(guides.counts[found.sources]):
        chosen = np.flatnonzero(guides.counts[found.sources] == count)
        sources, image_roots = found.sources[chosen], found.roots[chosen]

        def images(points, size=int(count), sources=sources, image_roots=image_roots):
            points = points.reshape(-1, size, 3)
            return grooming.guide_copies.images(mesh, points, guides.roots[sources], image_roots, plane)

        additions.append((images(guides.points[guides.of_count(int(count), sources)]), sources, image_roots))
        if before is not None:
            layers.append(_mirrored_layers(guides.surface, before.layers, sources, images))
    gathered = gathered_groups.read(datablock)
    write(guides, additions, found.removed, before, layers)
    if gathered is not None:
        _part_images(datablock, gathered, np.concatenate([sources for _points, sources, _roots in additions]))
    return len(found.sources)


def _part_images(datablock, gathered, sources):
    """Give images of gathered guides groups of their own, unless the ties of these gather both sides.

    gathered: of all guides before; sources (M,): guides whose images are the last ones now.
    """
    groups = gathered.groups
    shares = np.bincount(groups[sources], minlength=groups.max() + 1) / np.maximum(np.bincount(groups), 1)
    is_apart = (groups[sources] > 0) & (np.abs(shares[groups[sources]] - 0.5) > _ASIDE)
    images = np.zeros(len(datablock.curves), np.int32)
    images[len(images) - len(sources) :][is_apart] = groups[sources][is_apart]
    held, tie_fractions = np.zeros(len(images), np.float32), np.zeros(len(images), np.float32)
    held[len(images) - len(sources) :] = gathered.held[sources]
    tie_fractions[len(images) - len(sources) :] = gathered.tie_fractions[sources]
    gathered_groups.add(datablock, gathered_groups.Gathered(images, held, tie_fractions))


def write(
    guides: CombedGuides,
    additions: list[Additions],
    removed: np.ndarray,
    before: LayersBefore | None,
    layers: Sequence[GuideLayers] = (),
) -> None:
    """Add guides and remove (R,) indices of existing ones. At least one guide must remain.

    before: layers of existing guides, None without layers; layers: of added guides, in local coordinates.
    """
    datablock, surface, roots = guides.datablock, guides.surface, guides.roots
    for points, sources, new_roots in additions:
        if len(points):
            starts = curves.curve_offsets(datablock).astype(np.int64)
            guide_curves.append(datablock, surface.to_local(points), sources, starts)
            roots = roots.joined(new_roots)
            identities, randoms = surface.identities(new_roots)
            # Guides made from curves, and so their images, may start off the surface.
            apart = np.linalg.norm(points[:, 0] - mesh_math.positions(surface.mesh, new_roots), axis=1)
            guide_curves.write_tail(datablock, "id", "INT", identities)
            guide_curves.write_tail(datablock, "strand_random", "FLOAT", randoms)
            guide_curves.write_tail(datablock, "root_distance", "FLOAT", apart / surface.scale)
    guide_curves.remove(datablock, removed)
    left = np.setdiff1d(np.arange(len(roots)), removed)
    curves.write_roots(datablock, surface, roots[left], firsts=curves.first_points(datablock))
    if before is not None:
        carried_layers.replace_last(datablock, before, layers)
    datablock.update_tag()


def _mirrored_layers(surface, layers, sources, images):
    """Return the `GuideLayers` of mirror images; images: a function of the points [m] of the guides `sources`."""

    def move(points):
        return surface.to_local(images(surface.from_local(points))).reshape(-1, 3)

    return guide_layers.moved(layer_transfer.chosen_guides(layers, sources), move)


def _new_roots(guides, count, mask, depsgraph):
    """Return at most `count` roots of new guides. Raises `HairError` if there is no room for any."""
    surface, device = guides.surface, preferences.device()
    density, texture = _density(guides, mask, depsgraph)
    roots = grooming.guide_count.new_roots(
        surface.mesh,
        guides.roots,
        count,
        guides.weights > 0.0,
        density=density,
        texture=texture,
        device=device,
    )
    if not len(roots):
        raise HairError("There is no room for more guides here: change the selection or the mask.")
    return roots


def _between(guides, roots, depsgraph):
    """Return new guides (M, P, 3) [m], interpolated from those around them as strands are, and their nearest (M,)."""
    datablock, surface, device = guides.datablock, guides.surface, preferences.device()
    settings = _hair_settings(datablock)
    parting = partings.read(datablock.surface, surface, datablock, settings, depsgraph)
    points, nearest = grooming.guide_count.grown_between(
        surface.mesh,
        strands.from_numpy(guides.even(POINT_COUNT), guides.roots, device),
        roots,
        settings,
        regions=parting.regions,
        lines=parting.lines,
        drawn_on=surface.drawn_on,
        is_mirrored=surface.has_flipped_winding,
        tie_fractions=parting.tie_fractions,
        device=device,
    )
    point_count = max(int(np.bincount(guides.counts).argmax()), 2)
    if point_count != POINT_COUNT:
        starts = np.arange(len(points) + 1) * POINT_COUNT
        points = geometry.curves.resampling.resample(points.reshape(-1, 3), starts, point_count)
    return points, nearest


def _density(guides, mask, depsgraph):
    """Return the density of new guides: (V,) weights or None, and `Texture` or None.

    It combines the mask of the guides with the mask of the tool.
    """
    datablock, surface = guides.datablock, guides.surface
    density = texture = None
    if not curves.is_hand_made(datablock):
        density, texture = masks.own(datablock.vellus.guides).read(datablock.surface, surface, depsgraph)
    if mask:
        weights, _texture = masks.Mask(mask).read(datablock.surface, surface, depsgraph)
        density = weights if density is None else density * weights
    return density, texture


def _crowded(guides, count, depsgraph):
    """Return the guides to remove, of those at least half selected and half inside the mask; at least one remains."""
    may_go = guides.weights >= 0.5
    count = min(count, np.count_nonzero(may_go), len(may_go) - 1)
    if count <= 0:
        raise HairError("No more guides can be removed here: change the selection or the mask.")
    spread = None
    if not curves.is_hand_made(guides.datablock):
        density, _texture = masks.own(guides.datablock.vellus.guides).read(
            guides.datablock.surface, guides.surface, depsgraph
        )
        if density is not None:
            spread = np.maximum(mesh_math.interpolate(density, guides.surface.mesh, guides.roots), 0.01)
    places = mesh_math.positions(guides.surface.mesh, guides.roots)
    return grooming.guide_count.most_crowded(places, guides.normals, int(count), may_go, spread)


def _hair_settings(datablock):
    """Return the `HairSettings` of the first hair that follows guides, or the defaults."""
    following = curves.followers(datablock)
    return pipeline.inputs_of(following[0])[1] if following else HairSettings()
