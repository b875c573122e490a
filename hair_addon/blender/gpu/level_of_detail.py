# SPDX-License-Identifier: GPL-3.0-or-later
"""Level of detail in viewports: with distance, fewer strands, thicker in proportion, with fewer points.

Consecutive indices are a uniform subset of all strands (shaders/strands/level_of_detail.glsl) [Cook07]; their number
changes one by one with the distance, without popping. Each pass of a picture uses another subset, so that all strands
contribute to a still view.
"""

import numpy as np

from . import drawing

# Maximum width [samples] of strands that represent others; distance [samples] between two points.
_FULL_WIDTH = 0.5
_PIECE_LENGTH = 2.0

_LEAST_STRANDS, _LEAST_POINTS = 10_000, 9


def steps_of(strands, view, object_to_world, part=1.0):
    """Return the `drawing.Steps` that suffice for `StrandsOnGPU` in a view.

    view: a `uniforms.VIEW` record; object_to_world: (4, 4); part: maximum fraction of all strands.
    """
    count = strands.strand_count
    samples_per_meter = _closest(strands, view, object_to_world) * drawing.scale_of(object_to_world)
    wanted = 2.0 * strands.mean_radius * samples_per_meter / _FULL_WIDTH
    strand_count = int(np.clip(count * min(wanted, part), min(_LEAST_STRANDS, count * part), count))
    pieces = strands.mean_length * samples_per_meter / _PIECE_LENGTH
    point_count = int(np.clip(np.ceil(min(pieces, strands.point_count)) + 1, _LEAST_POINTS, strands.point_count))
    # With a limit by the artist each pass draws the same strands.
    turn = float(view["coverage_turn"]) % 1.0 if part == 1.0 else 0.0
    return drawing.Steps(point_count, max(strand_count, 1), int(turn * count))


def _closest(strands, view, object_to_world):
    """Samples per meter at the nearest hair; infinite if the viewer is inside."""
    pixels_per_unit = float(view["pixels_per_unit"])
    if not view["is_perspective"]:
        return pixels_per_unit
    centre, radius = drawing.bounding_sphere([(strands, object_to_world)])
    distance = float(np.linalg.norm(view["eye"][:3] - centre)) - radius
    return pixels_per_unit / distance if distance > 0.0 else np.inf
