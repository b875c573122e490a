# SPDX-License-Identifier: GPL-3.0-or-later
"""How finely a viewport samples its hair: where hair is small in the picture, that part of it has more samples a pixel.

Few samples of small hair are a matter of chance: its light flickers, and the first pass is not as bright as the last.
"""

from dataclasses import dataclass

import numpy as np

from ...gpu import drawing, windows

_MOST_PER_SIDE = 6  # samples along each side of a pixel: about as many as a finished picture has

# Samples in the part of the picture that holds all hair: with a third of them on hair, light in the mean of a pass is
# known to half a per cent. At most a part of those of the whole picture, so that near hair takes no longer.
_WANTED_SAMPLES = 48_000
_LARGEST_PART = 1.0 / 4.0

_MARGIN = 6  # pixels around the hair, where it may have been before: picture/history_carry.frag looks that far
_SIZE_STEP = 16  # pixels: textures are made anew when the size changes


@dataclass(frozen=True)
class Detail:
    """Samples along each side of a pixel, and the part of the picture that has them.

    tile: (left, bottom, width, height) [pixels].
    """

    per_side: int
    tile: tuple

    @property
    def corner(self):
        """(left, bottom) [samples]."""
        return tuple(length * self.per_side for length in self.tile[:2])

    @property
    def buffer_size(self):
        """(width, height) [samples]."""
        return tuple(length * self.per_side for length in self.tile[2:])

    def pass_record(self, camera, size, turn):
        """Return `drawing.pass_record` of its samples.

        camera: (world to view, view to clip), each (4, 4); size: (width, height) of the picture [pixels]; turn: of the
        pass.
        """
        whole = tuple(length * self.per_side for length in size)
        return drawing.pass_record(*camera, whole, turn, (*self.corner, *self.buffer_size))


def whole(size, per_side):
    """`Detail` of a whole picture of size (width, height) [pixels]."""
    return Detail(per_side, (0, 0, *size))


def of_hair(drawn, camera, size, per_side):
    """`Detail` for the hair of a `DrawnScene`: of the whole picture where hair is large in it.

    camera: (world to view, view to clip), each (4, 4); per_side: samples along each side of a pixel, at least.
    """
    window = _window(drawn, camera, size)
    area = window[2] * window[3]
    samples = min(_WANTED_SAMPLES, _LARGEST_PART * size[0] * size[1] * per_side**2)
    finer = min(round(np.sqrt(samples / area)), _MOST_PER_SIDE) if area else 0
    return Detail(finer, _tile_around(window, size)) if finer > per_side else whole(size, per_side)


def _window(drawn, camera, size):
    """(left, bottom, width, height) [pixels] of the part of a picture that holds all hair."""
    view = drawing.pass_record(*camera, size)
    low, high = np.array(size), np.zeros(2, int)
    for strands, _shading, to_world, *_ in drawn.hair:
        left, bottom, width, height = windows.of_strands(strands, drawing.strand_record(strands, view, to_world), size)
        if width and height:
            low, high = np.minimum(low, (left, bottom)), np.maximum(high, (left + width, bottom + height))
    return (*low.tolist(), *np.maximum(high - low, 0).tolist())


def _tile_around(window, size):
    """The window with a margin, of a size in whole steps, within the picture."""
    placed = []
    for start, length, most in zip(window[:2], window[2:], size, strict=True):
        length = min(-(-(length + 2 * _MARGIN) // _SIZE_STEP) * _SIZE_STEP, most)
        placed.append((max(min(start - _MARGIN, most - length), 0), length))
    (left, width), (bottom, height) = placed
    return left, bottom, width, height
