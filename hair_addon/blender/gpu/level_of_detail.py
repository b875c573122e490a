# SPDX-License-Identifier: GPL-3.0-or-later
"""Level of detail in viewports: with distance, fewer strands, thicker in proportion, with fewer points.

Consecutive indices are a uniform subset of all strands (shaders/strands/level_of_detail.glsl) [Cook07]; their number
changes one by one with the distance, without popping. Each pass of a picture uses another subset, so that all strands
contribute to a still view.
"""

import math
from dataclasses import dataclass

import numpy as np

from . import drawing

# Maximum width of strands that represent others, in samples and as a part of the hair's diameter: thicker strands would
# widen the tips of locks and the outline.
_FULL_WIDTH, _WIDTH_PART = 0.5, 1.0 / 1000.0
# Distance between two points [samples], and the greatest distance [samples] of a bend from the line between two points
# at which a strand may have fewer points.
_PIECE_LENGTH, _GREATEST_BEND = 2.0, 0.5

_LEAST_STRANDS, _LEAST_POINTS = 2000, 9
_LEAST_WIDTH = 1e-30  # [samples]: hair that is scaled to a plane has no width
_INSIDE = 1e15  # samples per unit for a viewer inside of the hair: finite, as strands may have no width or length


@dataclass(frozen=True)
class Limits:
    """An artist's limits of the level of detail of a hair in viewports.

    part: maximum fraction of all strands; is_reduced: whether distant hair is reduced.
    """

    part: float = 1.0
    is_reduced: bool = True


NO_LIMITS = Limits()


def steps_of(hair, view):
    """Return the `drawing.Steps` that suffice for each hair in a view, with arrays (N,) of its objects.

    hair: [(`StrandsOnGPU`, (N, 4, 4) object to world, `Limits`)]; view: a `uniforms.VIEW` record.
    """
    return [_steps(*one, view) for one in hair]


def _steps(strands, to_world, limits, view):
    """Return the `drawing.Steps` of a hair."""
    count, part = strands.strand_count, limits.part
    most = max(int(count * part), 1)
    if not limits.is_reduced:
        return drawing.Steps(None, most, most_strands=most)
    samples_per_unit, diameters = _sizes_in(view, strands, to_world)
    samples_per_meter = samples_per_unit * drawing.scales_of(to_world)
    most_widths = np.minimum(_FULL_WIDTH, np.maximum(_WIDTH_PART * diameters, _LEAST_WIDTH))
    wanted = 2.0 * strands.mean_radius * samples_per_meter / most_widths
    strand_counts = np.maximum(count * np.minimum(wanted, part), min(_LEAST_STRANDS, count * part))
    strand_counts = np.minimum(strand_counts, count).astype(int)
    lengths = strands.mean_length * samples_per_meter
    pieces = np.ceil(np.minimum(lengths / _PIECE_LENGTH, strands.point_count)).astype(int)
    point_counts = np.minimum(np.maximum(pieces + 1, _LEAST_POINTS), strands.point_count)
    fewest = np.minimum(point_counts, _points_that_show(strands, lengths, _GREATEST_BEND, _LEAST_POINTS))
    point_counts = np.where(strand_counts < count, fewest, point_counts)
    # With a limit by the artist each pass draws the same strands.
    first = int(float(view["coverage_turn"]) % 1.0 * count) if part == 1.0 else 0
    return drawing.Steps(point_counts, np.maximum(strand_counts, 1), first, most_strands=most)


def points_within(strands, to_world, view, bend):
    """Return (..., N) minimum numbers of evenly chosen points with which `StrandsOnGPU` at (N, 4, 4) places deviate by
    at most `bend` [samples] from their curves in (...) views.
    """
    if not strands.has_bends:  # all points, whatever their size
        return strands.point_count
    samples_per_unit, _diameters = _sizes_in(view, strands, to_world)
    lengths = strands.mean_length * samples_per_unit * drawing.scales_of(to_world)
    return _points_that_show(strands, lengths, bend, 2)


def _points_that_show(strands, lengths, bend, least):
    """Return (..., N) minimum numbers of evenly chosen points, at least `least`, with which `StrandsOnGPU` deviate by
    at most `bend` [samples] from their curves; lengths: (..., N) of strands [samples].

    Returns all points if only the GPU knows how strands bend. An arc of a parabola over a chord c with a sagitta s is
    longer than the chord by the fraction 8/3 (s / c)².
    """
    pieces, enough = strands.point_count - 1, np.full(lengths.shape, strands.point_count)
    are_shown = np.ones(lengths.shape, bool)
    for step in range(2, pieces // (least - 1) + 1 if strands.has_bends else 0):
        if pieces % step:
            continue
        drawn = pieces // step
        bends = lengths / drawn * math.sqrt(0.375 * max(strands.lengthening(drawn + 1) - 1.0, 0.0))
        are_shown &= bends <= bend
        enough[are_shown] = drawn + 1
        if not are_shown.any():
            break
    return enough


def _sizes_in(view, strands, to_world):
    """Return (..., N) samples per unit at the nearest strand and (..., N) diameters [samples] of `StrandsOnGPU` at
    (N, 4, 4) places in (...) views.

    The diameter of hair with an uneven scale is measured along the axis with the smallest scale. Both numbers are very
    large if the viewer is inside of the hair's sphere.
    """
    centres, radii, unevenness = _shape(strands, to_world)
    distances = np.linalg.norm(view["eye"][..., None, :3] - centres, axis=-1) - radii
    per_unit = np.repeat(view["pixels_per_unit"].astype(np.float64)[..., None], len(to_world), axis=-1)
    nearest = np.divide(per_unit, distances, out=np.full(per_unit.shape, _INSIDE), where=distances > 0.0)
    per_unit = np.where(view["is_perspective"][..., None] != 0, nearest, per_unit)
    return per_unit, 2.0 * radii * per_unit * unevenness


def _shape(strands, to_world):
    """Return (N, 3) centers and (N,) radii of spheres around `StrandsOnGPU` at (N, 4, 4) places, and (N,) smallest
    scales divided by the largest; cached until the strands or their places change.
    """
    key = to_world.tobytes(), strands.box.is_exact
    if key not in strands.shapes:
        strands.shapes.clear()
        scales = np.linalg.svd(to_world[:, :3, :3], compute_uv=False)
        unevenness = np.divide(scales[:, 2], scales[:, 0], out=np.ones(len(scales)), where=scales[:, 0] > 0.0)
        strands.shapes[key] = *drawing.bounding_spheres(strands, to_world), unevenness
    return strands.shapes[key]
