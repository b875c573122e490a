# SPDX-License-Identifier: GPL-3.0-or-later
"""The sampling density of hair in a viewport: small hair has more samples per pixel.

With few samples small hair flickers, and the brightness of the first pass differs from the last.
"""

from dataclasses import dataclass

import numpy as np

from ...gpu import drawing, windows

_MOST_PER_SIDE = 6  # samples along each side of a pixel: about as many as in a finished picture

# Samples in the part of the picture that contains all hair: with a third of them on hair, the mean light of a pass has
# an error of half a percent. At most a fraction of the whole picture's samples, so that near hair takes no longer.
_WANTED_SAMPLES = 48_000
_LARGEST_PART = 1.0 / 4.0

_MARGIN = 6  # pixels around the hair, where hair may have been before: the search radius of picture/history_places.comp
_SIZE_STEP = 16  # pixels: textures are created again when the size changes


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
        """Return the `drawing.pass_record` of the samples.

        camera: (world to view, view to clip), each (4, 4); size: (width, height) of the picture [pixels]; turn: index
        of the pass.
        """
        whole = tuple(length * self.per_side for length in size)
        return drawing.pass_record(*camera, whole, turn, (*self.corner, *self.buffer_size))


def whole(size, per_side):
    """`Detail` of a whole picture of size (width, height) [pixels]."""
    return Detail(per_side, (0, 0, *size))


def of_hair(drawn, camera, size, per_side, is_shadowed=False):
    """`Detail` for the hair of a `DrawnScene`; of the whole picture if hair is large.

    camera: (world to view, view to clip), each (4, 4); per_side: minimum samples along each side of a pixel;
    is_shadowed: contain the surfaces that hair darkens too.
    """
    found = _of_likely_boxes(drawn, camera, size, per_side, is_shadowed)
    guessed = [batch.strands.box for batch in drawn.batches if not batch.strands.box.is_exact]
    if found.per_side == per_side or not guessed:
        return found
    # Hair outside of the part that has finer samples would not be drawn.
    for box in guessed:
        box.require()
    return _of_likely_boxes(drawn, camera, size, per_side, is_shadowed)


def _of_likely_boxes(drawn, camera, size, per_side, is_shadowed):
    """`of_hair` for the likely boxes of strands."""
    most = min(_WANTED_SAMPLES, _LARGEST_PART * size[0] * size[1] * per_side**2)
    low, high, finer = np.array(size), np.zeros(2, int), 0
    for found in _windows(drawn, camera, size, is_shadowed):
        found = found[(found[:, 2:] > 0).all(axis=1)]
        if not len(found):
            continue
        low = np.minimum(low, found[:, :2].min(axis=0))
        high = np.maximum(high, (found[:, :2] + found[:, 2:]).max(axis=0))
        finer = min(round(np.sqrt(most / np.prod(high - low))), _MOST_PER_SIDE)
        if finer <= per_side:
            break  # large hair: further windows only enlarge the part
    window = *low.tolist(), *np.maximum(high - low, 0).tolist()
    return Detail(finer, _tile_around(window, size)) if finer > per_side else whole(size, per_side)


def _windows(drawn, camera, size, is_shadowed):
    """Yield arrays (N, 4) of windows (left, bottom, width, height) [pixels] that contain hair, or surfaces that it
    darkens.
    """
    view = drawing.pass_record(*camera, size)
    for batch in drawn.batches:
        records = drawing.strand_records(batch.strands, view, batch.to_world)
        yield windows.of_strands(batch.strands, records, size, batch.strands.box.likely)
    if is_shadowed:
        for surface, _lights, _seen, is_darkened in drawn.shadowed:
            if is_darkened:
                to_clip = camera[1] @ camera[0] @ surface.to_world.reshape(-1, 4, 4)
                yield windows.of_boxes(surface.bounds, to_clip, size)


def _tile_around(window, size):
    """Return the window with a margin, enlarged to a multiple of the size step, within the picture."""
    placed = []
    for start, length, most in zip(window[:2], window[2:], size, strict=True):
        length = min(-(-(length + 2 * _MARGIN) // _SIZE_STEP) * _SIZE_STEP, most)
        placed.append((max(min(start - _MARGIN, most - length), 0), length))
    (left, width), (bottom, height) = placed
    return left, bottom, width, height
