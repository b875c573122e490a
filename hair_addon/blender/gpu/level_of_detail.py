# SPDX-License-Identifier: GPL-3.0-or-later
"""Level of detail in viewports: with distance, fewer strands, thicker in proportion, with fewer points.

Consecutive indices are a uniform subset of all strands (shaders/strands/level_of_detail.glsl) [Cook07]; their number
changes one by one with the distance, without popping. Each pass of a picture uses another subset, so that all strands
contribute to a still view.
"""

from dataclasses import dataclass

import numpy as np

from . import drawing

# Maximum width of strands that represent others, in samples and as a part of the hair's diameter: thicker strands on
# the outline of small hair would cover more samples than all strands. Distance [samples] between two points.
_FULL_WIDTH, _WIDTH_PART = 0.5, 1.0 / 200.0
_PIECE_LENGTH = 2.0

_LEAST_STRANDS, _LEAST_POINTS = 2000, 9


@dataclass(frozen=True)
class Limits:
    """An artist's limits of the level of detail of a hair in viewports.

    part: maximum fraction of all strands; is_reduced: whether distant hair is reduced.
    """

    part: float = 1.0
    is_reduced: bool = True


NO_LIMITS = Limits()


def steps_of(strands, view, object_to_world, limits=NO_LIMITS):
    """Return the `drawing.Steps` that suffice for `StrandsOnGPU` in a view.

    view: a `uniforms.VIEW` record; object_to_world: (4, 4); limits: `Limits`.
    """
    count, part = strands.strand_count, limits.part
    if not limits.is_reduced:
        return drawing.Steps(None, max(int(count * part), 1))
    samples_per_unit, diameter = _size_in(view, strands, object_to_world)
    samples_per_meter = samples_per_unit * drawing.scale_of(object_to_world)
    wanted = 2.0 * strands.mean_radius * samples_per_meter / min(_FULL_WIDTH, _WIDTH_PART * diameter)
    strand_count = int(np.clip(count * min(wanted, part), min(_LEAST_STRANDS, count * part), count))
    pieces = strands.mean_length * samples_per_meter / _PIECE_LENGTH
    point_count = int(np.clip(np.ceil(min(pieces, strands.point_count)) + 1, _LEAST_POINTS, strands.point_count))
    # With a limit by the artist each pass draws the same strands.
    turn = float(view["coverage_turn"]) % 1.0 if part == 1.0 else 0.0
    return drawing.Steps(point_count, max(strand_count, 1), int(turn * count))


def _size_in(view, strands, object_to_world):
    """Return samples per unit at the nearest hair, and its diameter [samples]; infinite if the viewer is inside."""
    centre, radius = drawing.bounding_sphere([(strands, object_to_world)])
    samples_per_unit = float(view["pixels_per_unit"])
    if view["is_perspective"]:
        distance = float(np.linalg.norm(view["eye"][:3] - centre)) - radius
        samples_per_unit = samples_per_unit / distance if distance > 0.0 else np.inf
    return samples_per_unit, 2.0 * radius * samples_per_unit
