# SPDX-License-Identifier: GPL-3.0-or-later
"""A rendered frame: the mean over its motion samples, by tiles and passes."""

import numpy as np

from ....core.imaging import cryptomatte, pixel_sampling
from ....core.long_work import no_progress, part_of
from ...gpu import drawing
from .. import film, light_groups, light_paths

_LIGHT = 0.3  # share of tracing light among strands in the progress of a motion step
_PASS = "Pass {number} of {count}"
_NEAREST = {"Depth", "Position"}  # passes of the nearest sample, whose last channel is the distance


class Frame:
    """Arrays {pass: (height, width, channels) float32} of a window of a picture, bottom row first.

    size: (width, height) of the whole picture [pixels]; window: (left, bottom, width, height) of the rendered part;
    sample_count: per pixel in each motion step; passes, is_transparent, filter_width: of `film.Film`; lens_passes:
    minimum passes per motion step, for depth of field; path_count: paths through the light grid in each, 0: none;
    labels: `mattes.Labels` if mattes are wanted; step_count: number of motion steps.
    """

    def __init__(
        self,
        size,
        window,
        sample_count,
        passes,
        is_transparent,
        filter_width=0.0,
        lens_passes=1,
        path_count=0,
        labels=None,
        step_count=1,
    ):
        self._size, self._window, self._path_count, self._passes = size, window, path_count, passes
        self._step_count = step_count
        self._per_side = pixel_sampling.samples_per_side(sample_count, lens_passes)
        self._turns = sample_count // self._per_side**2
        self._tiles = pixel_sampling.tiles(window, film.largest_tile(self._per_side, filter_width))
        self._new_film = lambda tile: film.Film(
            tile[2:], self._per_side, passes, is_transparent, filter_width, labels=labels
        )
        self._film, self._moment_count, self._sums = None, 0, {}
        self._mattes = None

    @property
    def _passes_of_moment(self):
        """Number of passes per motion sample."""
        return len(self._tiles) * self._turns

    def expose(self, drawn, world_to_view, view_to_clip, motion=None, lens=None, progress=no_progress):
        """Draw a motion step; progress is called after each pass, and may raise `Stopped`.

        drawn: `DrawnScene`; world_to_view, view_to_clip: (4, 4); motion: for the pass "Vector"; lens: `Lens`, None: all
        in focus.
        """
        lit = _LIGHT if self._path_count and drawn.hair else 0.0
        following, drawing_passes = part_of(progress, 0.0, lit), part_of(progress, lit, 1.0)
        groups = light_groups.lit(drawn, self._passes)
        traced = []
        for number, one in enumerate((drawn, *groups.values())):
            tracing = part_of(following, number / (1 + len(groups)), (number + 1) / (1 + len(groups)))
            arguments = world_to_view, view_to_clip, self._path_count, self._moment_count, tracing, self._step_count
            traced.append(light_paths.with_grid(one, *arguments))
        drawn, groups = traced[0], dict(zip(groups, traced[1:], strict=True))
        done = 0
        for tile in self._tiles:
            if self._film is None or self._film.size != tile[2:]:
                self._film = self._new_film(tile)
            self._film.clear()
            self._film.motion, self._film.groups = motion, groups
            for turn in range(self._turns):
                with drawing.ALONE:
                    turns_before = self._moment_count * self._turns
                    self._film.add_pass(
                        drawn, world_to_view, view_to_clip, self._size, turns_before + turn, tile[:2], lens
                    )
                done += 1
                drawing_passes(_PASS.format(number=done, count=self._passes_of_moment), done / self._passes_of_moment)
            with drawing.ALONE:
                self._add(tile, self._film.read())
                self._add_mattes(tile, self._film.read_mattes())
        self._moment_count += 1

    def free_film(self):
        """Free GPU memory until the next motion step is drawn."""
        self._film = None

    def _add(self, tile, arrays):
        left, bottom, width, height = tile
        left, bottom = left - self._window[0], bottom - self._window[1]
        for name, values in arrays.items():
            if name not in self._sums:
                shape = (self._window[3], self._window[2], values.shape[-1])
                self._sums[name] = np.full(shape, film.FAR if name in _NEAREST else 0.0, np.float32)
            part = self._sums[name][bottom : bottom + height, left : left + width]
            if name in _NEAREST:
                np.copyto(part, values, where=values[..., -1:] < part[..., -1:])
            else:
                part += values

    def _add_mattes(self, tile, mattes):
        if mattes is None:
            return
        left, bottom, width, height = tile
        left, bottom = left - self._window[0], bottom - self._window[1]
        if self._mattes is None:
            shape = (self._window[3], self._window[2], mattes[0].shape[-1])
            self._mattes = np.zeros(shape, np.int32), np.zeros(shape, np.float32)
        part = tuple(whole[bottom : bottom + height, left : left + width] for whole in self._mattes)
        cryptomatte.added(part, mattes)

    def mattes(self):
        """Mattes of the motion steps so far: (labels, coverages), each (height, width, slots)."""
        labels, coverages = self._mattes
        return labels, coverages / np.float32(self._moment_count)

    def arrays(self):
        """Return {pass: array}: means over the motion steps so far, and the nearest depths and positions."""
        found = {n: a if n in _NEAREST else a / np.float32(self._moment_count) for n, a in self._sums.items()}
        if "Position" in found:
            places, distances = np.split(found["Position"], [3], axis=-1)
            found["Position"] = np.where(distances < film.FAR, places, np.float32(0.0))
        return found
