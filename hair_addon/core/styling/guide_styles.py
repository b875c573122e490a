# SPDX-License-Identifier: GPL-3.0-or-later
"""The guides that strands follow: combed guides after styles on guides, with the strands' number of points.

Combed guides themselves do not change. Only guides that changed are computed again, so the time of a stroke depends on
the guides that it moves.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np

from .. import geometry, styling
from ..geometry.mesh import SurfacePoints, TriMesh, normals
from ..geometry.strands import Strands, from_numpy
from ..geometry.strands import segment_lengths as lengths_of
from . import base, courses, kinds, lean, wet
from .base import Profile, StyleSettings, has_effect
from .random_numbers import VARY, random_numbers
from .varied_numbers import NumberMap

_WET_ROOT = 0.3  # fraction of the length over which wet hair starts to lean
DOWN = np.array([0.0, 0.0, -1.0])


@dataclass(frozen=True)
class Lean:
    """One style on guides.

    settings: of the style; amounts (G,): of each guide; profile: its numbers are floats, or arrays (G,); None for the
    course of wet hair; directions (G, 3): unit; clearances (G,) [m]; curve (N,): the course of the amount, None
    for 1.
    """

    settings: StyleSettings
    amounts: np.ndarray
    profile: Profile | None
    directions: np.ndarray
    clearances: np.ndarray
    curve: np.ndarray | None = None

    def is_same(self, other: "Lean") -> bool:
        """Return whether both styles lean guides equally."""
        arrays = (
            (self.amounts, other.amounts),
            (self.directions, other.directions),
            (self.clearances, other.clearances),
            *zip(_numbers_of(self.profile), _numbers_of(other.profile), strict=False),
        )
        is_same = self.settings == other.settings and courses.are_same(self.curve, other.curve)
        return is_same and all(np.array_equal(*pair) for pair in arrays)

    def course(self, chosen: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return the part (M, P) of the amount of guides with indices chosen (M,) at x (M, P), as for `evaluated`."""
        found = self._profile(chosen, x)
        return found if self.curve is None else found * courses.at(self.curve, x)

    def _profile(self, chosen, x):
        if self.profile is None:
            return np.clip(x / _WET_ROOT, 0.0, 1.0)
        numbers = _numbers_of(self.profile)
        return base.evaluated(Profile(*(each[chosen] if isinstance(each, np.ndarray) else each for each in numbers)), x)


def _numbers_of(profile):
    """Return the numbers of a `Profile`; none for the course of wet hair."""
    return [] if profile is None else [getattr(profile, field.name) for field in fields(profile)]


def leans(
    styles: Sequence[StyleSettings],
    mesh: TriMesh,
    roots: SurfacePoints,
    identities: np.ndarray,
    masks: dict[Any, np.ndarray],
    targets: dict[str, np.ndarray],
    mask_key: Callable[[StyleSettings], Any],
    numbers: Mapping[tuple[int, str], NumberMap] = MappingProxyType({}),
    curves: courses.Courses = MappingProxyType({}),
) -> list[Lean]:
    """Return the `Lean` of each style that acts on guides, in order.

    roots: of the guides; identities: (G,) int32 IDs; masks: (G,) weights by their keys; targets: unit (3,) directions
    by objects' names; numbers: maps of numbers that differ between guides, by (index of the style, name of the
    setting); curves: courses of amounts, by the same keys.
    """
    found = []
    for place, declared in enumerate(styles):
        if not isinstance(declared, lean.Settings | wet.Settings) or not has_effect(declared):
            continue
        values = {name: each.of_guides(roots, identities) for (its, name), each in numbers.items() if its == place}
        settings = kinds.with_values(declared, values)
        amounts = settings.amount * (1.0 - np.float32(settings.vary) * random_numbers(identities, settings.seed, VARY))
        key = mask_key(settings)
        amounts = amounts if key is None else amounts * masks[key]
        if isinstance(settings, wet.Settings):
            directions = np.tile(DOWN, (len(roots), 1))
            clearances = _of_all(settings.lock * wet.CLEARANCE, len(roots))
            found.append(Lean(declared, amounts * np.float32(settings.cling), None, directions, clearances))
            continue
        directions = _directions(settings, mesh, roots, targets)
        if directions is not None:
            clearances = _of_all(settings.clearance, len(roots))
            curve = curves.get((place, "amount"))
            found.append(Lean(declared, amounts, base.profile_of(settings), directions, clearances, curve))
    return found


def _of_all(value, count):
    """Return (G,) float32 of one number for all guides, or of an array (G,)."""
    return np.broadcast_to(np.asarray(value, np.float32), count)


def _directions(settings, mesh, roots, targets):
    if settings.direction == "NORMAL":
        return normals(mesh, roots)
    if settings.direction == "DOWN":
        return np.tile(DOWN, (len(roots), 1))
    target = targets.get(settings.target)
    return None if target is None else np.tile(target, (len(roots), 1))


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
            amounts = style.amounts[chosen][:, None] * style.course(chosen, x)
            points = styling.guide_lean.leaned(
                points,
                amounts,
                style.directions[chosen],
                self._surface,
                self._mesh.vertex_normals,
                style.clearances[chosen],
            )
        return points
