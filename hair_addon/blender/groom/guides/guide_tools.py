# SPDX-License-Identifier: GPL-3.0-or-later
"""Tools that change combed guides in place: read guides, compute, write changed guides.

Guides keep their roots, and unchanged guides keep all their bits. As after combing, settings no longer apply to the
guides, and hair follows at Blender's next update.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from bpy.types import Curves, Depsgraph

from ....core import geometry, grooming
from ....core.errors import HairError
from ....core.geometry import mesh as mesh_math
from ....core.geometry.mesh import SurfacePoints
from ....core.grooming.guide_tool_settings import (
    AttractSettings,
    CopySettings,
    LengthSettings,
    LiftSettings,
    SmoothSettings,
    ToolSettings,
    TrimSettings,
)
from ...data import scene
from ...data.strands import attributes, curves, cutters, frozen_points, gathered_groups, guide_curves, posed_strands
from ...data.surfaces import Surface
from ...host.notices import name_of
from ...layers import recording
from ...settings import layer_items

_FARTHEST = 1e14  # [m] from the surface's origin: squares of such lengths are still finite


@dataclass(frozen=True)
class CombedGuides:
    """Guides, G of them, with any point counts.

    local (N, 3) float32 in local coordinates, points (N, 3) float32 [m] in the axes of the `Surface`, starts (G+1,);
    weights (G,) float64 in [0, 1]: fraction of a change that each guide gets.
    """

    datablock: Curves
    surface: Surface
    local: np.ndarray
    points: np.ndarray
    starts: np.ndarray
    weights: np.ndarray
    roots: SurfacePoints

    @property
    def counts(self) -> np.ndarray:
        """(G,) number of points of each guide."""
        return np.diff(self.starts)

    @cached_property
    def normals(self) -> np.ndarray:
        """(G, 3) float32 unit normals of the surface at the roots."""
        return mesh_math.normals(self.surface.mesh, self.roots)

    @property
    def first_points(self) -> np.ndarray:
        """(G, 3) float32 [m]."""
        return self.points[self.starts[:-1]]

    def of_count(self, count: int, chosen: np.ndarray) -> np.ndarray:
        """Return (M, count) indices of the points of chosen guides (M,) with `count` points each."""
        return self.starts[chosen][:, None] + np.arange(count)

    @cached_property
    def is_even(self) -> bool:
        """Whether all guides have the same number of points."""
        return bool((self.counts == self.counts[0]).all())

    def taken(self, values: np.ndarray, chosen: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Return a copy of values (N, 3) of the points of chosen guides, (M, P, 3); places: from `of_count`.

        If all guides have the same number of points, whole guides are copied, in a third of the time.
        """
        return values.reshape(len(self.counts), -1, 3)[chosen] if self.is_even else values[places]

    def even(self, point_count: int) -> np.ndarray:
        """Return (G, point_count, 3) float32 [m] guides, unchanged if all have that many points, else resampled."""
        if (self.counts == point_count).all():
            return self.points.reshape(-1, point_count, 3)
        return geometry.curves.resampling.resample(
            self.points, self.starts, point_count, attributes.are_smooth(self.datablock)
        )

    def carried_back(self, posed: np.ndarray, chosen: np.ndarray) -> np.ndarray:
        """Return points (M, P, 3) float32 [m] of chosen guides at rest; posed: on the deformed surface."""
        pose = posed_strands.pose_of(self.surface)
        if not pose.is_deformed:
            return posed
        places = self.surface.places(self.roots)
        motion = pose.motion_at(places[0])
        some = tuple(part[chosen] for part in places)
        return self.surface.from_local(posed_strands.carried(self.surface.to_local(posed), motion, some, is_back=True))

    def posed_of(self, chosen: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Return points (M, P, 3) float32 [m] of chosen guides on the deformed surface; places: from `of_count`."""
        return self.posed_shape(chosen, self.points[places], lambda: self.local[places])

    def posed_shape(
        self, chosen: np.ndarray, shape: np.ndarray, local: Callable[[], np.ndarray] | None = None
    ) -> np.ndarray:
        """Return points (M, P, 3) float32 [m] of chosen guides with a shape (M, P, 3) [m] on the deformed surface.

        local: a function that returns the shape in local coordinates, if it is known.
        """
        pose = posed_strands.pose_of(self.surface)
        if not pose.is_deformed:
            return shape
        roots = self.surface.places(self.roots)
        some = tuple(part[chosen] for part in roots)
        local_shape = self.surface.to_local(shape) if local is None else local()
        return self.surface.from_local(posed_strands.carried(local_shape, pose.motion_at(roots[0]), some))

    def posed(self) -> np.ndarray:
        """Return (N, 3) float32 [m] points on the surface deformed by shape keys and modifiers."""
        pose = posed_strands.pose_of(self.surface)
        if not pose.is_deformed:
            return self.points
        places = self.surface.places(self.roots)
        motion = pose.motion_at(places[0])
        return self.surface.from_local(posed_strands.carried(self.local, motion, places, self.counts))


def open_guides(datablock: Curves, depsgraph: Depsgraph) -> CombedGuides:
    """Return the `CombedGuides` of guide Curves, all with weight one. Raises `HairError` if they cannot be read."""
    surface = scene.read_surface(datablock.surface, depsgraph)
    mesh_math.check_mesh(surface.mesh)
    return on_surface(datablock, surface)


def on_surface(datablock: Curves, surface: Surface) -> CombedGuides:
    """Return the `CombedGuides` of guide Curves on a checked `Surface`; otherwise as `open_guides`."""
    starts = curves.curve_offsets(datablock).astype(np.int64)
    if len(starts) < 2:
        raise HairError('"{name}" has no guides: generate guides first.', name=name_of(datablock))
    local = curves.read_points(datablock)
    if not np.isfinite(local).all():
        sentence = '"{name}" has non-finite coordinates: undo, or delete those guides.'
        raise HairError(sentence, name=name_of(datablock))
    points = surface.from_local(local)
    roots = curves.read_roots(datablock, surface, points[starts[:-1]])
    return CombedGuides(datablock, surface, local, points, starts, np.ones(len(starts) - 1), roots)


def read(datablock: Curves, settings: ToolSettings, depsgraph: Depsgraph) -> CombedGuides:
    """Record the edits of guide Curves and return their `CombedGuides`, weighted by selection and mask.

    Raises `HairError`.
    """
    curves.require_editable(datablock)
    layer_items.require_combable(datablock.vellus)
    recording.update(datablock, depsgraph)
    guides = open_guides(datablock, depsgraph)
    weights = guides.weights.copy()
    selected = guide_curves.selection(datablock, guides.starts) if settings.selected_only else None
    if selected is not None:
        weights *= selected
    if settings.mask:
        weights *= weights_in_group(guides, settings.mask, depsgraph)
    if not weights.any():
        raise HairError("No guide is both selected and inside the mask: change the selection or the mask.")
    return replace(guides, weights=weights)


def weights_in_group(guides: CombedGuides, name: str, depsgraph: Depsgraph) -> np.ndarray:
    """Return (G,) weights in [0, 1] of a vertex group at the roots; the guides' own without a name.

    Raises `HairError`.
    """
    weights = scene.read_vertex_group(guides.datablock.surface, depsgraph, name)
    if weights is None:
        return guides.weights
    return np.clip(mesh_math.interpolate(weights, guides.surface.mesh, guides.roots), 0.0, 1.0)


Shaping = Callable[[np.ndarray, np.ndarray], np.ndarray]


def reshape(guides: CombedGuides, shaped: Shaping) -> int:
    """Change the points of guides; returns the number of changed guides.

    shaped: a function of points (M, P, 3) [m] and indices (M,) of guides with P points each that returns new points. It
    is not called for guides without weight or with a single point.
    """
    after = guides.points.copy()
    for chosen, places in to_shape(guides):
        after[places] = shaped(guides.points[places], chosen)
    return write_shapes(guides, after)


def to_shape(guides: CombedGuides) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return [((M,) guides, (M, P) indices of points)] of guides with weight and several points, by point count."""
    found = []
    for count in np.unique(guides.counts[(guides.counts > 1) & (guides.weights > 0.0)]):
        chosen = np.flatnonzero((guides.counts == count) & (guides.weights > 0.0))
        found.append((chosen, guides.of_count(int(count), chosen)))
    return found


def write_shapes(guides: CombedGuides, after: np.ndarray) -> int:
    """Write points (N, 3) [m] of guides; returns the number changed. Raises `HairError`."""
    _require_near(after)
    after = frozen_points.restored(guides.datablock, guides.points, after)
    is_moved = (after != guides.points).any(axis=1)
    local = guides.local.copy()
    local[is_moved] = guides.surface.to_local(after[is_moved][:, None])[:, 0]
    if is_moved.any():
        attributes.write(guides.datablock, "position", "FLOAT_VECTOR", "POINT", local)
        guides.datablock.update_tag()
    return int(np.count_nonzero(np.add.reduceat(is_moved, guides.starts[:-1])))


class ShapesOfStroke:
    """Shapes of guides while a stroke changes them event by event: only new shapes are compared and converted."""

    def __init__(self, guides: CombedGuides) -> None:
        """guides: as before the stroke; their arrays do not change."""
        self._guides = guides
        self._local = guides.local.copy()
        self._are_frozen = frozen_points.read(guides.datablock)
        self._has_moved = np.zeros(len(guides.counts), bool)

    def write(self, shapes: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> int:
        """Write guides with new shapes; returns the number that differ from before the stroke. Raises `HairError`.

        shapes: (M,) indices of guides, (M, P) indices of their points, and points (M, P, 3) float32 [m]. All other
        guides, and frozen points, stay as they are.
        """
        guides = self._guides
        for _chosen, _places, shape in shapes:
            _require_near(shape)
        for chosen, places, shape in shapes:
            own, after = guides.taken(guides.points, chosen, places), guides.surface.to_local(shape)
            is_other = shape != own
            if self._are_frozen is not None:
                is_other &= ~self._are_frozen[places][..., None]
            if self._are_frozen is not None or after is not shape:
                # Unchanged points keep their bits.
                after = np.where(is_other.any(axis=2)[..., None], after, guides.taken(guides.local, chosen, places))
            self._has_moved[chosen] = is_other.reshape(len(chosen), -1).any(axis=1)
            if guides.is_even:
                self._local.reshape(len(guides.counts), -1, 3)[chosen] = after
            else:
                self._local[places] = after
        attributes.write(guides.datablock, "position", "FLOAT_VECTOR", "POINT", self._local)
        guides.datablock.update_tag()
        return int(np.count_nonzero(self._has_moved))


def _require_near(points):
    """Raise `HairError` unless points (..., 3) [m] are finite and near their surface."""
    if not np.abs(points).max(initial=0.0) < _FARTHEST:  # also refuses NaN
        raise HairError("The guides would extend too far from their surface: use smaller values.")


def change_lengths(datablock: Curves, settings: LengthSettings, depsgraph: Depsgraph) -> int:
    """Change the lengths of guides; returns the number changed. Raises `HairError` before anything changes."""
    guides = read(datablock, settings, depsgraph)
    resized = grooming.guide_lengths.resized
    changed = reshape(guides, lambda points, chosen: resized(points, settings, guides.weights[chosen]))
    gathered_groups.follow_lengths(datablock, guides.local, cuts=settings.shorten == "CUT")
    return changed


def trim(datablock: Curves, settings: TrimSettings, depsgraph: Depsgraph) -> int:
    """Cut guides where an object crosses them, on the deformed surface; returns and raises as `change_lengths`."""
    guides = read(datablock, settings, depsgraph)
    cutter = cutters.read_cutter(settings.cutter, datablock.surface, depsgraph)
    posed = guides.posed()

    def shaped(points, chosen):
        there = posed[guides.of_count(points.shape[1], chosen)]
        if cutter.mesh is not None:
            crossings = grooming.guide_trim.mesh_crossings(there, cutter.mesh)
        else:
            crossings = grooming.guide_trim.plane_crossings(there, cutter.origin, cutter.normal)
        return grooming.guide_trim.trimmed(points, crossings, guides.weights[chosen])

    changed = reshape(guides, shaped)
    gathered_groups.follow_lengths(datablock, guides.local, cuts=True)
    return changed


def smooth(datablock: Curves, settings: SmoothSettings, depsgraph: Depsgraph) -> int:
    """Smooth guides along their length; returns and raises as `change_lengths`."""
    guides = read(datablock, settings, depsgraph)
    smoothed = grooming.guide_shapes.smoothed
    return reshape(guides, lambda points, chosen: smoothed(points, settings, guides.weights[chosen]))


def lift(datablock: Curves, settings: LiftSettings, depsgraph: Depsgraph) -> int:
    """Turn guides toward the surface normal; returns and raises as `change_lengths`."""
    guides = read(datablock, settings, depsgraph)
    lifted = grooming.guide_shapes.lifted
    return reshape(
        guides, lambda points, chosen: lifted(points, guides.normals[chosen], settings, guides.weights[chosen])
    )


def attract(datablock: Curves, settings: AttractSettings, depsgraph: Depsgraph) -> int:
    """Turn guides toward the surface; returns and raises as `change_lengths`."""
    guides = read(datablock, settings, depsgraph)
    mesh, attracted = guides.surface.mesh, grooming.guide_attraction.attracted
    return reshape(
        guides, lambda points, chosen: attracted(mesh, points, guides.normals[chosen], settings, guides.weights[chosen])
    )


def copy_shape(datablock: Curves, settings: CopySettings, depsgraph: Depsgraph) -> int:
    """Copy the shape of guides of one region to those of another; returns and raises as `change_lengths`."""
    curves.require_editable(datablock)
    layer_items.require_combable(datablock.vellus)
    recording.update(datablock, depsgraph)
    guides = open_guides(datablock, depsgraph)
    is_source, weights = _regions(guides, settings, depsgraph)
    guides = replace(guides, weights=weights)
    sources, targets = np.flatnonzero(is_source), np.flatnonzero(weights > 0.0)
    copies = grooming.guide_copies
    its, own = (copies.Places(guides.first_points[rows], guides.normals[rows]) for rows in (sources, targets))
    matches = copies.matched(its, own, settings.mapping, guides.surface.mirror)

    def shaped(points, chosen):
        rows = np.searchsorted(targets, chosen)
        shapes = guides.even(points.shape[1])[sources[matches.sources[rows]]]
        return copies.copied(points, shapes, matches.matrices[rows], settings, weights[chosen])

    return reshape(guides, shaped)


def _regions(guides, settings, depsgraph):
    """Return (G,) bool, the guides to copy from, and (G,) float64, the fraction of the copied shape for the others."""
    selected = guide_curves.selection(guides.datablock, guides.starts)
    if settings.source:
        is_source = weights_in_group(guides, settings.source, depsgraph) >= 0.5
        if not is_source.any():
            raise HairError(
                'No guide is rooted in the vertex group "{name}": pick another group.', name=settings.source
            )
    elif selected is not None:
        is_source = selected > 0.0
    else:
        raise HairError("Select the guides to copy from, or pick the vertex group that they are rooted in.")
    if settings.target:
        weights = weights_in_group(guides, settings.target, depsgraph).astype(np.float64)
    elif settings.source and selected is not None:
        weights = selected.astype(np.float64)
    else:
        weights = np.ones(len(is_source))
    weights[is_source] = 0.0
    if not weights.any():
        raise HairError("There are no guides to copy to: pick another vertex group, or select fewer guides.")
    return is_source, weights


def is_any_selected(datablock: Curves) -> bool:
    """Whether some but not all guides are selected in Sculpt Mode or Edit Mode."""
    return guide_curves.selection(datablock, curves.curve_offsets(datablock)) is not None


def surface_size(datablock: Curves) -> float:
    """Return the longest side [m] of the bounding box of the surface of guides; 0 without one."""
    if datablock.surface is None:
        return 0.0
    return float(max(datablock.surface.dimensions))


def median_length(datablock: Curves) -> float:
    """Return the median length [m] of guides; 0 without guides."""
    starts, points = curves.curve_offsets(datablock), curves.read_points(datablock)
    if datablock.surface is not None:
        points = points @ np.array(datablock.surface.matrix_world.to_3x3(), np.float32).T
    steps = np.linalg.norm(np.diff(points, axis=0, append=points[-1:]), axis=1)
    lengths = [steps[start : end - 1].sum() for start, end in pairwise(starts) if end > start]
    return float(np.median(lengths)) if lengths else 0.0
