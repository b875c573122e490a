# SPDX-License-Identifier: GPL-3.0-or-later
"""Small files of grooms: surfaces with few faces where no hair grows, few points, rounded coordinates.

UV maps and the nearest surface, by which grooms are transferred to other meshes, need no more of the surface.
"""

from dataclasses import replace

import bpy
import numpy as np

from hair_addon.blender.data import vertex_groups
from hair_addon.blender.data.made import groom_assets
from hair_addon.blender.groom.transfer import library_groom
from hair_addon.core.files import library_settings
from hair_addon.core.geometry.strands import curve_offsets
from hair_addon.core.grooming import groom_passage, groom_transfer

_STEP = 2.0**-16  # [m]: coordinates of points are multiples of it
_FACES_KEPT = 0.15  # fraction of faces that remain when a surface is thinned where no hair grows
_MOST_LOST = 0.005  # largest fraction of guides whose roots are outside of the other surface's UV map
_BOX_MARGIN = 0.01  # relative to a mesh's extents: vertices this near to its bounding box are not merged
_AWAY = "away"  # vertex group of a surface where no hair grows


def small(hair, name, bare_surface, stride=1):
    """Return the `LibraryGroom` of hair on a surface with fewer faces and the same UV map.

    bare_surface: a function that returns a mesh object in a new file; stride: every nth point of a guide stays.
    """
    groom = library_groom.take(hair, name, bpy.context.evaluated_depsgraph_get())
    groom = _every(_on(groom, bare_surface()), stride)
    surface = bare_surface()
    _thin(surface, np.max(list(groom.masks.values()), axis=0) == 0.0)
    groom = _on(groom, surface)
    return replace(groom, points=(np.round(groom.points / _STEP) * _STEP).astype(np.float32))


def _on(groom, surface):
    """Return a groom on another mesh object with the same UV map."""
    target = groom_transfer.TransferSurface(*groom_assets.read_surface(surface))
    places = groom_transfer.places_by_uv(groom.source, target, groom.roots)
    if places.lost_count > _MOST_LOST * len(groom.counts):
        raise ValueError(f"{groom.name}: {places.lost_count} guides have no place on the other surface")
    weights = np.stack(list(groom.masks.values()), axis=1)
    masks = groom_passage.carried_weights(groom.source, target, weights, None).T
    return replace(
        groom,
        source=target,
        roots=places.roots,
        points=groom_transfer.carried(groom.source.mesh, target.mesh, groom.roots, groom.points, groom.counts, places),
        counts=groom.counts[places.kept],
        regions={region: values[places.kept] for region, values in groom.regions.items()},
        settings=library_settings.scaled(groom.settings, places.scale),
        masks=dict(zip(groom.masks, masks, strict=True)),
    )


def _every(groom, stride):
    """Return a groom with every nth point of each guide, the first and the last included."""
    starts = curve_offsets(groom.counts)[:-1]
    if ((groom.counts - 1) % stride).any():
        raise ValueError(f"{groom.name}: the tips of guides are between every {stride} points")
    counts = (groom.counts - 1) // stride + 1
    chosen = np.concatenate([start + stride * np.arange(count) for start, count in zip(starts, counts, strict=True)])
    return replace(groom, points=groom.points[chosen], counts=counts)


def _thin(surface, is_bare):
    """Merge faces of a mesh object at vertices (V,) bool without hair; the bounding box, which aligns meshes, stays."""
    places = np.array([vertex.co for vertex in surface.data.vertices])
    margin = _BOX_MARGIN * np.ptp(places, axis=0)
    is_at_box = (places < places.min(axis=0) + margin) | (places > places.max(axis=0) - margin)
    is_bare = is_bare & ~is_at_box.any(axis=1)
    if not is_bare.any():
        return
    vertex_groups.paint(surface.vertex_groups.new(name=_AWAY), is_bare.astype(np.float32))
    modifier = surface.modifiers.new("Thin", "DECIMATE")
    modifier.ratio, modifier.vertex_group, modifier.vertex_group_factor = _FACES_KEPT, _AWAY, 10.0
    bpy.ops.object.modifier_apply(modifier=modifier.name)
