# SPDX-License-Identifier: GPL-3.0-or-later
"""The guides that strands follow: combed guides after styles on guides, with the strands' number of points.

Combed guides themselves do not change. Only guides that changed are computed again, so the time of a stroke depends on
the guides that it moves.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from .. import geometry, styling
from ..geometry.mesh import SurfacePoints, TriMesh, normals
from ..geometry.strands import Strands, from_numpy
from ..geometry.strands import segment_lengths as lengths_of
from . import base, lean, wet
from .base import Profile, StyleSettings, has_effect
from .random_numbers import VARY, random_numbers

_WET_ROOT = 0.3  # fraction of the length over which wet hair starts to lean
DOWN = np.array([0.0, 0.0, -1.0])


@dataclass(frozen=True)
class Lean:
    """One style on guides.

    settings: of the style; amounts (G,): of each guide; course(x): profile; directions (G, 3): unit; clearance [m].
    """

    settings: StyleSettings
    amounts: np.ndarray
    course: Callable[[np.ndarray], np.ndarray]
    directions: np.ndarray
    clearance: float

    def is_same(self, other: "Lean") -> bool:
        """Return whether both styles lean guides equally."""
        arrays = (self.amounts, other.amounts), (self.directions, other.directions)
        return self.settings == other.settings and all(np.array_equal(*pair) for pair in arrays)


def leans(
    styles: Sequence[StyleSettings],
    mesh: TriMesh,
    roots: SurfacePoints,
    identities: np.ndarray,
    masks: dict[Any, np.ndarray],
    targets: dict[str, np.ndarray],
    mask_key: Callable[[StyleSettings], Any],
) -> list[Lean]:
    """Return the `Lean` of each style that acts on guides, in order.

    roots: of the guides; identities: (G,) int32 IDs; masks: (G,) weights by their keys; targets: unit (3,) directions
    by objects' names.
    """
    found = []
    for settings in filter(has_effect, styles):
        if not isinstance(settings, lean.Settings | wet.Settings):
            continue
        amounts = settings.amount * (1.0 - settings.vary * random_numbers(identities, settings.seed, VARY))
        key = mask_key(settings)
        amounts = amounts if key is None else amounts * masks[key]
        if isinstance(settings, wet.Settings):
            directions = np.tile(DOWN, (len(roots), 1))
            clearance = settings.lock * wet.CLEARANCE
            found.append(Lean(settings, amounts * settings.cling, _wet_course, directions, clearance))
            continue
        directions = _directions(settings, mesh, roots, targets)
        if directions is not None:
            found.append(Lean(settings, amounts, _course(base.profile_of(settings)), directions, settings.clearance))
    return found


def _directions(settings, mesh, roots, targets):
    if settings.direction == "NORMAL":
        return normals(mesh, roots)
    if settings.direction == "DOWN":
        return np.tile(DOWN, (len(roots), 1))
    target = targets.get(settings.target)
    return None if target is None else np.tile(target, (len(roots), 1))


def _wet_course(x):
    return np.clip(x / _WET_ROOT, 0.0, 1.0)


def _course(profile: Profile):
    return lambda x: base.evaluated(profile, x)


class FollowedGuides:
    """The guides that strands follow: leaned, and with the strands' number of points."""

    def __init__(self, mesh: TriMesh, leans: Sequence[Lean], point_count: int) -> None:
        """mesh: the surface that leaned guides keep clear of."""
        self._mesh, self._leans, self._point_count = mesh, leans, point_count
        self._before, self._after = np.empty((0, 0, 3), np.float32), np.empty((0, 0, 3), np.float32)

    def continue_from(self, other: "FollowedGuides") -> None:
        """Reuse the guides of another instance if its inputs are the same."""
        is_same = (
            self._mesh is other._mesh
            and self._point_count == other._point_count
            and len(self._leans) == len(other._leans)
            and all(one.is_same(another) for one, another in zip(self._leans, other._leans, strict=True))
        )
        if is_same:
            self._before, self._after = other._before, other._after

    @cached_property
    def _surface(self):
        return geometry.closest_point.SurfaceQuery(self._mesh)

    def of(self, guides: Strands) -> Strands:
        """Return the `Strands` that hair follows, for combed guides."""
        if not self._leans and guides.point_count == self._point_count:
            return guides
        points = guides.numpy()
        if self._before.shape != points.shape:
            after = self._made(points, np.arange(len(points)))
        else:
            changed = np.flatnonzero((points != self._before).any(axis=(1, 2)))
            after = self._after
            if len(changed):
                after = after.copy()
                after[changed] = self._made(points[changed], changed)
        self._before, self._after = points.copy(), after
        return from_numpy(after, guides.roots, str(guides.points.device))

    def _made(self, points, chosen):
        """Return (M, point_count, 3) for the points (M, P, 3) of guides with indices chosen (M,)."""
        count, own_count = len(points), points.shape[1]
        if own_count != self._point_count and count:
            starts = np.arange(count + 1) * own_count
            is_smooth = np.ones(count, bool)
            points = geometry.curves.resampling.resample(points.reshape(-1, 3), starts, self._point_count, is_smooth)
        for style in self._leans:
            x = np.cumsum(lengths_of(points), axis=1)
            x = np.concatenate([np.zeros((count, 1)), x / np.maximum(x[:, -1:], 1e-20)], axis=1)
            amounts = style.amounts[chosen][:, None] * style.course(x)
            points = styling.guide_lean.leaned(
                points, amounts, style.directions[chosen], self._surface, self._mesh.vertex_normals, style.clearance
            )
        return points
