# SPDX-License-Identifier: GPL-3.0-or-later
"""The strands visible from a camera, with their light by dual scattering: the starts of light paths."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.shading import light_paths
from ..gpu import drawing
from ..gpu.visibility_buffer import VisibilityBuffer
from . import scene_drawing

_MOST_SAMPLES = 4096  # along each side


@dataclass(frozen=True, eq=False)
class Drawn:
    """A picture of hair by dual scattering, read from the GPU; the fields are arguments of `seen_rays.shown_in`.

    view: a `light_paths.view.View`.
    """

    view: Any
    picture: np.ndarray
    color: np.ndarray
    ranges: list

    def seen(self, grid):
        """`seen_rays.Seen` of a `StrandGrid` of the scene's hair."""
        return light_paths.seen_rays.shown_in(grid, self.view, self.picture, self.color, self.ranges)


def draw(drawn, camera, window, count, turn):
    """`Drawn` of a `DrawnScene` in a window of a camera's picture, with about `count` samples.

    camera: (4, 4) world to view and view to clip; window: (low, high) corners (2,) in clip space; turn: index among
    passes of the same picture.
    """
    whole, tile = _samples(camera[1], window, count)
    view = drawing.pass_record(*camera, whole, turn, tile)
    view["sample_offset"] = 0.0  # a path begins on the ray through a sample's center
    buffer = VisibilityBuffer(*tile[2:])
    with drawing.ALONE:
        with buffer.surfaces():
            scene_drawing.draw_hiding(drawn, view)
        scene_drawing.draw_hair(drawn, view, buffer)
        picture = np.array(buffer.segments.read(), np.uint32).reshape(tile[3], tile[2])
        color = np.array(buffer.color.read(), np.float32).reshape(tile[3], tile[2], 4)
    a_strand = [hair[0].point_count - 1 for hair in drawn.hair]
    ranges = [(*range_of, segments) for range_of, segments in zip(buffer.segment_ranges, a_strand, strict=True)]
    return Drawn(light_paths.view.View(view["world_to_clip"].T.astype(np.float64)), picture, color, ranges)


def _samples(view_to_clip, window, count):
    """Return ((width, height) of a picture [samples], (left, bottom, width, height) of the window in it)."""
    parts = 0.5 * (window[1] - window[0])
    aspect = abs(view_to_clip[1, 1] / view_to_clip[0, 0])
    height = (count / (parts[0] * parts[1] * aspect)) ** 0.5
    size = np.array([aspect * height, height])
    size *= min(1.0, _MOST_SAMPLES / (size * parts).max())
    whole = np.maximum(np.rint(size), 1).astype(int)
    low = np.floor((0.5 * window[0] + 0.5) * whole).astype(int)
    high = np.minimum(np.maximum(np.ceil((0.5 * window[1] + 0.5) * whole).astype(int), low + 1), whole)
    low = np.minimum(low, high - 1)
    return tuple(whole.tolist()), (*low.tolist(), *(high - low).tolist())
