# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides derived from hair: representative strands, fitted so that interpolation reproduces the hair."""

from dataclasses import dataclass, replace

import numpy as np

from .. import grooming, interpolation
from ..errors import HairError
from ..geometry.mesh import SurfacePoints, TriMesh, positions
from ..geometry.search import clusters
from ..geometry.strands import Strands, from_numpy, lengths
from ..interpolation.hair_binding import HairBinding
from ..long_work import Progress, no_progress, part_of
from ..params import Settings, param
from . import following, groom
from .groom import HairSettings

_STEPS = 4  # of the fit: preserved lengths and excluded guides make it nonlinear
_MOST_FITTED = 30_000  # strands in the fit, evenly chosen


@dataclass(frozen=True)
class DerivationSettings(Settings):
    """Settings of guides derived from existing hair."""

    guide_count: int = param(
        400,
        "Number of guides derived from the strands; more guides reproduce them more closely",
        label="Guide count",
        low=1,
        high=4000,
        soft_high=2000,
    )


@dataclass(frozen=True)
class DerivedGuides:
    """Guides of existing hair, and the errors of its reproduction.

    guides: `Strands` (G, P) on the CPU; sources: (G,) strands whose roots the guides share, empty for given guides;
    binding: of all strands to the guides; guide_map: (S, k) int32 guides, -1 for none, and float32 weights of each
    strand; errors: (S,) root mean square distance between the points of a strand and its reproduction, relative to its
    length.
    """

    guides: Strands
    sources: np.ndarray
    binding: HairBinding
    guide_map: tuple[np.ndarray, np.ndarray]
    errors: np.ndarray

    @property
    def mean_error(self) -> float:
        """Root mean square of all errors."""
        return float(np.sqrt(np.mean(np.square(self.errors))))

    @property
    def high_error(self) -> float:
        """The 95th percentile of the errors."""
        return float(np.percentile(self.errors, 95.0))


def derive(
    mesh: TriMesh,
    points: np.ndarray,
    roots: SurfacePoints,
    settings: HairSettings,
    guide_count: int,
    *,
    is_mirrored: bool = False,
    progress: Progress = no_progress,
) -> DerivedGuides:
    """Derive guides from strands (S, P, 3) float32 [m] of positive length, rooted at `SurfacePoints` of a checked mesh.

    settings: completed, for the interpolation; is_mirrored: as in `groom.bind_hair`. Strands that begin off the surface
    are reproduced from their roots on it. Returns `DerivedGuides`. Raises `HairError`.
    """
    groom.load_kernels("cpu", part_of(progress, 0.0, 0.1))
    progress("Choosing guides", 0.1)
    sources = grooming.derived_guides.representatives(points, guide_count)
    at_roots = positions(mesh, roots)
    arms = points - at_roots[:, None]
    guide_arms = arms[sources] - arms[sources, :1]
    own = roots[sources]

    def guides_of(its_arms):
        return from_numpy((at_roots[sources][:, None] + its_arms).astype(np.float32), own, "cpu")

    progress("Finding guides", 0.3)
    binding = groom.bind_hair(mesh, guides_of(guide_arms), settings, roots=roots, is_mirrored=is_mirrored)
    scale = lengths(points)
    chosen = np.unique(np.linspace(0, len(points) - 1, min(len(points), _MOST_FITTED)).astype(np.int64))
    fitting = part_of(progress, 0.5, 1.0)
    best = _Reproduction(binding, guides_of(guide_arms), points, scale)
    rooted, present = arms - arms[:, :1], guide_arms
    found = best
    for step in range(_STEPS):
        fitting("Fitting guides", step / _STEPS)
        stretches = found.stretches
        if not np.isfinite(stretches).all():  # single precision overflows far from the surface
            raise HairError("The curves are too small or too far away for the surface: check the scales of both.")
        present = interpolation.guide_fitting.fitted(binding, found.weights, rooted, present, chosen, stretches)
        found = _Reproduction(binding, guides_of(present), points, scale)
        if found.mean < best.mean:
            best = found
    return DerivedGuides(best.guides, sources, binding, best.guide_map, best.errors)


def reproduced(
    mesh: TriMesh,
    points: np.ndarray,
    roots: SurfacePoints,
    settings: HairSettings,
    guides: Strands,
    *,
    is_mirrored: bool = False,
    progress: Progress = no_progress,
) -> DerivedGuides:
    """Return `DerivedGuides` with given guides, which are not changed; other arguments as in `derive`."""
    groom.load_kernels("cpu", part_of(progress, 0.0, 0.5))
    binding = groom.bind_hair(mesh, guides, settings, roots=roots, is_mirrored=is_mirrored)
    found = _Reproduction(binding, guides, points, lengths(points))
    return DerivedGuides(guides, np.zeros(0, np.int64), binding, found.guide_map, found.errors)


class _Reproduction:
    """Strands interpolated from guides, compared to the strands (S, P, 3) to be reproduced; scale: (S,) lengths."""

    def __init__(self, binding, guides, strands, scale):
        self._binding, self.guides = binding, guides
        self.weights = following.weights_now(binding, guides)
        self.points = following.strands_now(binding, guides, self.weights).numpy()
        apart = np.sqrt(np.mean(np.sum(np.square(self.points - strands), axis=2), axis=1))
        self.errors = apart / scale
        self.mean = float(np.mean(np.square(self.errors)))

    @property
    def stretches(self):
        """Factors (S,) float64 by which `keep_length` stretches the strands."""
        binding = replace(self._binding, keep_length=0.0)
        plain = lengths(following.strands_now(binding, self.guides, self.weights).numpy())
        with np.errstate(invalid="ignore"):
            return lengths(self.points) / np.maximum(plain, 1e-3 * lengths(self.points))

    @property
    def guide_map(self):
        shares = self.weights.weights.numpy()
        return np.where(shares > 0.0, self.weights.indices.numpy(), -1), shares


_SHAPE = 0.5  # weight of distances between shapes relative to distances between roots
_SAMPLES = 4  # points of a strand that describe its shape


def representatives(points: np.ndarray, count: int) -> np.ndarray:
    """Return ascending indices, at most `count`, of representatives of strands (S, P, 3) [m]; S > 0."""
    features = _features(points)
    if count >= len(features):
        return np.arange(len(features))
    return np.sort(clusters.medoids(features, clusters.clusters(features, count), count))


def _features(points):
    """Return features (S, 3 + 3 k) float32: the root of each strand, and points along it relative to the root."""
    along = np.rint(np.linspace(0.0, points.shape[1] - 1, _SAMPLES + 1)[1:]).astype(np.int64)
    roots = points[:, 0].astype(np.float32)
    shapes = (points[:, along] - points[:, :1]) * (_SHAPE / np.sqrt(_SAMPLES))
    return np.concatenate([roots - roots.mean(axis=0), shapes.reshape(len(points), -1)], axis=1).astype(np.float32)
