# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair and guides of the scene as `GroomCurves`, for export."""

from dataclasses import dataclass, replace

import bpy
import numpy as np

from ...core.errors import HairError
from ...core.files import groom_curves
from ...core.files.groom_curves import GroomCurves
from ...core.geometry import strands
from ...core.shading import strand_colors
from ..data import scene
from ..data.maps import strand_maps
from ..data.strands import attributes, curves, exported_curves, simulated_guides
from ..groom import guide_maps, selection
from ..groom.dynamics import frame_folders
from ..groom.systems import hair_systems
from ..host.datablocks import Remembered
from ..host.notices import name_of
from ..settings import properties
from . import modified_strands, strand_arrays

_RESERVED = ("groom", "materials")  # names of other objects in files


@dataclass(frozen=True)
class Source:
    """Guides or strands to export.

    is_modified: whether the artist's modifiers are applied; matrix: (4, 4), world space [m] → place of another object
    that shows them; None for their own object.
    """

    datablock: Remembered
    curves: GroomCurves
    moves: bool
    is_modified: bool = False
    matrix: np.ndarray | None = None


def hair_on(active):
    """Return the hair to export for an active object: all hair on its surface with objects in the view layer."""
    layer = bpy.context.view_layer
    layer.update()  # the view layer may lack new objects
    systems = hair_systems.systems_of(selection.surface_of(active), layer)
    hair = selection.hair_of(active)
    return [system for system in systems if system.vellus.kind == "HAIR"] or ([] if hair is None else [hair])


def all_hair():
    """Return all hair with objects in the view layer, oldest first."""
    layer = bpy.context.view_layer
    layer.update()
    found = {o.data for o in layer.objects if o.type == "CURVES" and o.data.vellus.kind == "HAIR"}
    return sorted(found, key=lambda hair: hair.session_uid)


def sources_of(chosen, settings, per_meter):
    """Return the `Source`s of the guides and strands of each hair; IDs are unique in the file.

    Guides and hair without curves are left out. Raises `HairError` if all hair is without strands.
    """
    names, sources, first_id = group_names(chosen), [], 0
    for group, (hair, name) in enumerate(zip(chosen, names, strict=True)):
        guides = hair.vellus.guide_curves
        if settings.has_guides and guides is not None and len(guides.curves):
            made = _guide_curves(guides, group, name, first_id, per_meter)
            sources.append(Source(Remembered(guides), made, settings.moves(True)))
        if settings.has_hair and len(hair.curves):
            shown = modified_strands.curves_of(hair)
            made = _strand_curves(hair, shown or hair, group, name, first_id, per_meter, settings)
            sources.append(Source(Remembered(hair), made, settings.moves(False), shown not in (None, hair)))
        first_id += (len(guides.curves) if guides is not None else 0) + len(hair.curves)
    if settings.has_hair and chosen and not sources:
        raise HairError('"{name}" has no strands.', name=name_of(chosen[0]))
    return sources


def group_names(chosen):
    """Return the group names of some hair in a file."""
    return groom_curves.group_names([name_of(hair) for hair in chosen], _RESERVED)


def _guide_curves(guides, group, name, first_id, per_meter):
    local = _guides_at_rest(guides)
    counts = strand_arrays.counts_of(guides) if local is None else np.full(*local.shape[:2], np.int32)
    return GroomCurves(
        group_id=group,
        group_name=name,
        is_guide=True,
        counts=counts,
        first_id=first_id,
        widths=_widths(guides, guides, counts, per_meter),
        root_uvs=exported_curves.read_root_uvs(guides),
    )


def _strand_curves(hair, shown, group, name, first_id, per_meter, settings):
    counts = strand_arrays.counts_of(hair)
    widths = _widths(hair, shown, counts, per_meter)  # first: later calls may evaluate again
    guides = hair.vellus.guide_curves
    guide_count = 0 if guides is None else len(guides.curves)
    # Strands name guides only if the file has guides.
    depsgraph = scene.present_depsgraph()
    guide_map = guide_maps.of(hair, depsgraph) if guide_count and settings.has_guides else None
    ids, weights = (None, None) if guide_map is None else groom_curves.closest_guides(*guide_map, first_id)
    look, randoms = properties.look_of(hair.vellus), curves.read_randoms(hair)
    varied = strand_maps.read_looks(hair)
    colors, roughness = _shading_of(look, randoms, varied, counts, shown) if settings.has_color else (None, None)
    return GroomCurves(
        group_id=group,
        group_name=name,
        is_guide=False,
        counts=counts,
        first_id=first_id + guide_count,
        widths=widths,
        root_uvs=exported_curves.read_root_uvs(hair),
        guide_ids=ids,
        guide_weights=weights,
        colors=colors,
        roughness=roughness,
        radial_roughness=varied.radial if settings.has_color and varied is not None else None,
        look=look,
    )


def _widths(datablock, shown, counts, per_meter):
    """Return a function of a slice of curves that gives diameters in the file's units; shown: Curves with radii."""
    if np.array_equal(counts, exported_curves.counts_per_curve(shown)):
        radii = exported_curves.radii_per_curve(shown)
    else:  # simulated guides, which are resampled to equal point counts
        radii = exported_curves.read_radii(shown, int(counts[0]))(slice(None)).ravel()
    factor = np.float32(2.0 * strand_arrays.world_scale(datablock) * per_meter)
    return lambda some: radii[_points_of(counts, some)] * factor


def _points_of(counts, some):
    """Convert a slice of curves to a slice of their points."""
    first = int(counts[: some.start].sum(dtype=np.int64))
    return slice(first, first + int(counts[some].sum(dtype=np.int64)))


def _shading_of(look, randoms, varied, counts, shown):
    """Return (colors, roughness): functions of a slice of curves that give values per point.

    varied: `StrandLooks` by maps, or None.
    """

    def looks(some):
        return None if varied is None else varied[some]

    if (counts == counts[0]).all():
        count = int(counts[0])
        return (
            lambda some: strand_colors.colors(look, randoms[some], count, looks(some)).reshape(-1, 3),
            lambda some: strand_colors.roughness(look, randoms[some], count, looks(some)).ravel(),
        )
    along = strands.places_along(exported_curves.points_per_curve(shown), strands.curve_offsets(counts))

    def colors(some):
        of_points = np.repeat(np.arange(len(counts))[some], counts[some])
        places = along[_points_of(counts, some)]
        return strand_colors.colors_at(look, randoms[of_points], places, looks(of_points))

    def roughness(some):
        return np.repeat(strand_colors.roughness(look, randoms[some], 1, looks(some))[:, 0], counts[some])

    return colors, roughness


def _guides_at_rest(guides):
    """Return (G, P, 3) float32 local points of simulated guides, with a constant P; None for others."""
    shown = simulated_guides.point_cache.get(guides.session_uid)
    if shown is not None or not frame_folders.is_simulated(guides):
        return shown
    offsets = curves.curve_offsets(guides)
    return curves.even_points(curves.read_points(guides), offsets, lambda: attributes.are_smooth(guides))


def points_of(source, per_meter):
    """Return the present points of a `Source`, as `Rows` (see `strand_arrays.shown_rows`). Raises `HairError`."""
    datablock, exported = source.datablock.find(), source.curves
    if source.is_modified and modified_strands.curves_of(datablock) is None:
        raise HairError('The number of strands of "{name}" changes: remove its keys.', name=name_of(datablock))
    local = _guides_at_rest(datablock) if exported.is_guide else None
    counts = strand_arrays.counts_of(datablock) if local is None else np.full(*local.shape[:2])
    if not np.array_equal(counts, exported.counts):
        raise HairError('The number of strands of "{name}" changes: remove its keys.', name=name_of(datablock))
    if exported.is_guide:
        rows = strand_arrays.world_rows(datablock, per_meter, local)
    else:
        rows = strand_arrays.shown_rows(datablock, per_meter)
    matrix = source.matrix
    return rows if matrix is None else lambda some: rows(some) @ matrix[:3, :3].T + matrix[:3, 3] * per_meter


def instances_of(chosen):
    """Return [(group name, (4, 4) matrix)] of other objects that show the hair (see `strand_arrays.other_places`)."""
    pairs = zip(chosen, group_names(chosen), strict=True)
    return [(name, matrix) for hair, name in pairs for matrix in strand_arrays.other_places(hair)]


def copies_of(sources, instances):
    """Return copies of the `Source`s for each instance, for formats without instances."""
    groups = {source.curves.group_id: source.curves.group_name for source in sources}
    instances = [(name, matrix) for name, matrix in instances if name in groups.values()]
    wanted = [*groups.values(), *(f"{name}_instance" for name, _matrix in instances)]
    names = groom_curves.group_names(wanted, _RESERVED)[len(groups) :]
    first_id, first_group, copies = _next_id(sources), max(groups) + 1, []
    for group, (new_name, (name, matrix)) in enumerate(zip(names, instances, strict=True), first_group):
        its = [source for source in sources if source.curves.group_name == name]
        shift = first_id - min(source.curves.first_id for source in its)
        copies += [_copy(source, group, new_name, shift, matrix) for source in its]
        first_id = _next_id(copies)
    return copies


def _next_id(sources):
    return max(source.curves.first_id + source.curves.curve_count for source in sources)


def _copy(source, group, name, shift, matrix):
    its = source.curves
    scale = np.float32(abs(np.linalg.det(matrix[:3, :3])) ** (1.0 / 3.0))
    curves_there = replace(
        its,
        group_id=group,
        group_name=name,
        first_id=its.first_id + shift,
        widths=lambda some: its.widths(some) * scale,
        guide_ids=None if its.guide_ids is None else its.guide_ids + np.int32(shift),
    )
    return replace(source, curves=curves_there, matrix=matrix)


def counts_of(sources):
    """Counts of (guides, strands)."""
    every = [source.curves for source in sources]
    return tuple(sum(c.curve_count for c in every if c.is_guide == is_guide) for is_guide in (True, False))


def notes_of(chosen, sources, settings):
    """Notes on how importers will handle the hair; sources: `sources_of` the same hair."""
    without_map = {s.curves.group_id for s in sources if not s.curves.is_guide and s.curves.guide_ids is None}
    for group, (hair, name) in enumerate(zip(chosen, group_names(chosen), strict=True)):
        if name_of(hair) != name:
            yield HairError('"{name}" is called {group} in the file.', name=name_of(hair), group=name)
        if settings.has_hair:
            yield from modified_strands.notes_of(hair)
        if settings.has_guides and hair.vellus.guide_curves is not None:
            yield from _notes_of_guides(hair.vellus.guide_curves)
        if not (settings.has_hair and settings.has_guides):
            continue
        if hair.vellus.guide_curves is None:
            yield HairError('"{name}" has no guides: Unreal creates guides from its strands.', name=name)
        elif group in without_map:
            yield HairError(
                '"{name}" has no guide weights: Unreal computes its own. Regenerate the strands first.', name=name
            )


def _notes_of_guides(guides):
    """Notes on guides that are written with other point counts than their own."""
    local = _guides_at_rest(guides)
    if local is not None and (curves.point_counts(guides) != local.shape[1]).any():
        sentence = '"{name}" is written with {count} points per guide, as it is simulated.'
        yield HairError(sentence, name=name_of(guides), count=local.shape[1])
