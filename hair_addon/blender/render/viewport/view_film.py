# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of a viewport with Rendered shading: a film and its history."""

import functools

from .. import scene_drawing
from ..film import Film
from . import picture_detail
from .hair_picture import SAMPLE_COUNT
from .history import History


class ViewFilm:
    """Light over a region of `size` (width, height) [pixels], refined pass by pass while nothing moves.

    per_side, is_transparent: as for `Film`.
    """

    def __init__(self, size, per_side, is_transparent):
        self._film = Film(size, per_side, ("Combined",), is_transparent, border=0)
        self._detail = picture_detail.whole(size, per_side)
        self._history = History(size)
        self._pass_total = -(-SAMPLE_COUNT // per_side**2)
        self._first_turn = 0
        self._view = None  # record of the last pass

    @property
    def pass_count(self):
        """Number of passes since the last restart."""
        return self._film.pass_count

    @property
    def is_fine(self):
        """Whether all passes are drawn."""
        return self.pass_count >= self._pass_total

    def restart(self, is_moved=False):
        """Start another picture; is_moved: as for `HairPicture.restart`."""
        if is_moved:
            self._history.turn(self._film.light, self._film.pass_count / self._pass_total)
            self._first_turn += self._film.pass_count
        else:
            self._history.forget()
            self._first_turn = 0
        self._film.clear()

    def add_pass(self, drawn, world_to_view, view_to_clip, lens=None):
        """Draw a `DrawnScene` once more; arguments as for `Film.add_pass`."""
        film, camera = self._film, (world_to_view, view_to_clip)
        if film.pass_count == 0:
            relight = functools.partial(scene_drawing.relight, drawn, self._view, film.samples, film.is_transparent)
            self._history.follow_light(drawn, camera, film.samples, relight)
        self._view = view = film.add_pass(drawn, *camera, film.size, self._first_turn + film.pass_count, lens=lens)
        part_left = 1.0 - film.pass_count / self._pass_total
        samples = film.samples, self._detail
        self._history.add(drawn, camera, view, samples, film.light, film.pass_count, part_left, has_lit_surfaces=True)

    def show(self, border=None):
        """Draw the picture over the bound viewport; border: as for `Film.show`."""
        self._film.show(self._history.picture, border)

    def read(self):
        """Return (height, width, 4) float32: the mean of the passes so far, bottom row first."""
        return self._film.read()["Combined"]

    def read_shown(self):
        """`read` of the picture that `show` draws, which may include the history of former pictures."""
        return self.read() if self._history.picture is None else self._history.read()
