# SPDX-License-Identifier: GPL-3.0-or-later
"""The strands that a camera sees, and what is drawn of them by dual scattering: where paths of light start."""

import numpy as np

from ...core.shading import light_paths
from ..gpu import drawing
from ..gpu.visibility_buffer import VisibilityBuffer
from . import scene_drawing

_MOST_SAMPLES = 4096  # along a side


def find(drawn, grid, camera, window, count, turn):
    """`gather.Seen` of a `DrawnScene` in a window of a camera's picture, at about `count` places.

    grid: `StrandGrid` of the scene's hair; camera: (4, 4) world to view and view to clip; window: (low, high) corners
    (2,) in clip space; turn: which of several for the same picture.
    """
    whole, tile = _samples(camera[1], window, count)
    view = drawing.pass_record(*camera, whole, turn, tile)
    view["sample_offset"] = 0.0  # a path begins on the ray through a sample's center
    buffer = VisibilityBuffer(*tile[2:])
    with drawing.ALONE:
        with buffer.surfaces():
            scene_drawing.draw_hiding(drawn, view)
        scene_drawing.draw_hair(drawn, view, buffer)
        shape = tile[3], tile[2]
        found = np.array(buffer.segments.read(), np.int64).reshape(shape)
        color = np.array(buffer.color.read(), np.float32).reshape(*shape, 4)[..., :3]
    segments, rows, columns = [np.zeros(0, int)], [np.zeros(0, int)], [np.zeros(0, int)]
    for system, (first, segment_count) in enumerate(buffer.segment_ranges):
        row, column = np.nonzero((found >= first) & (found < first + segment_count))
        a_strand = drawn.hair[system][0].point_count - 1
        strand, place = np.divmod(found[row, column] - first, a_strand)
        segments.append(light_paths.strand_grid.segment_of(grid, system, strand, (place + 0.5) / a_strand))
        rows.append(row)
        columns.append(column)
    row, column = np.concatenate(rows), np.concatenate(columns)
    shown = np.concatenate(segments)
    near, directions, areas = _rays(view, tile, (row, column), grid.points[shown])
    return light_paths.gather.Seen(shown, near, -directions, areas, color[row, column])


def _samples(view_to_clip, window, count):
    """((width, height) of a picture [samples], (left, bottom, width, height) of the window in it)."""
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


def _rays(view, tile, at, places):
    """(points on the near plane (N, 3), unit directions, areas [m²] of samples near places (N, 3)) of rays through
    samples of a tile; at: their (rows, columns).
    """
    to_world = np.linalg.inv(view["world_to_clip"].T.astype(np.float64))
    row, column = at
    near, way = _lines(to_world, (column + 0.5) / tile[2], (row + 0.5) / tile[3])
    right, up = (_lines(to_world, (column + x) / tile[2], (row + y) / tile[3]) for x, y in ((1.5, 0.5), (0.5, 1.5)))
    length = np.linalg.norm(way, axis=1, keepdims=True)
    directions = way / length
    part = ((places - near) * directions).sum(axis=1, keepdims=True) / length
    sides = [start + part * other - near - part * way for start, other in (right, up)]
    return near, directions, np.abs((np.cross(*sides) * directions).sum(axis=1))


def _lines(to_world, x, y):
    """(points on the near plane (N, 3), ways to the far plane) of rays through a picture, x and y (N,) from 0 to 1."""
    ends = []
    for depth in (-1.0, 1.0):
        clip = np.stack([2.0 * x - 1.0, 2.0 * y - 1.0, np.full(len(x), depth), np.ones(len(x))], axis=-1) @ to_world.T
        ends.append(clip[:, :3] / clip[:, 3:])
    return ends[0], ends[1] - ends[0]
