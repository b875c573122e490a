# SPDX-License-Identifier: GPL-3.0-or-later
"""The visible strand in each sample of a texture, for strands laid flat and drawn from above like hair."""

from dataclasses import dataclass

import numpy as np

from ...core.cards.texels import NO_STRAND
from ..gpu import drawing, strand_textures
from ..gpu.programs import uniforms
from ..gpu.visibility_buffer import NO_SEGMENT, VisibilityBuffer
from . import offscreen

PER_SIDE = 2  # samples along each side of a texel in each pass
PASSES = 4
_MOST_SAMPLES = 2**24  # maximum samples in a strip


@dataclass(frozen=True)
class _Opaque:
    """Replaces a `Shading`: strands are found, but not shaded."""

    opacity: float = 1.0
    forward: tuple = (0.0, 0.0, 0.0)
    reflectance: tuple = (0.0, 0.0, 0.0)


class CardPicture:
    """`PlacedStrands` drawn into strips of a square texture; size: texels along each side."""

    def __init__(self, strands, size):
        offscreen.start_gpu()
        self._strands = strand_textures.upload_strands(strands.places, strands.radii)
        self._side = size * PER_SIDE
        self._strip = min(max(_MOST_SAMPLES // self._side // PER_SIDE, 1), size)  # rows of texels
        low, high = (float(strands.places[..., 2].min()), float(strands.places[..., 2].max()))
        depth = 0.9 / max(high - low, 1e-9) * 2.0
        self._view_to_clip = np.array(
            [[2.0, 0.0, 0.0, -1.0], [0.0, 2.0, 0.0, -1.0], [0.0, 0.0, -depth, 0.5 * depth * (low + high)], [0, 0, 0, 1]]
        )
        self._size = size

    def strips(self):
        """Ranges of rows of texels."""
        return [range(row, min(row + self._strip, self._size)) for row in range(0, self._size, self._strip)]

    def segments(self, rows, turn):
        """Return ((rows · PER_SIDE, size · PER_SIDE) visible segment in each sample of a pass, (2,) jitter of the
        samples).
        """
        tile = (0, rows.start * PER_SIDE, self._side, len(rows) * PER_SIDE)
        with drawing.ALONE:
            buffer = VisibilityBuffer(*tile[2:])
            with buffer.surfaces():
                pass
            view = drawing.pass_record(np.eye(4), self._view_to_clip, (self._side, self._side), turn, tile)
            hair = [(self._strands, _Opaque(), np.eye(4), {}, drawing.Steps())]
            buffer.find_hair(hair, uniforms.LIGHTS.record(), view)
            found = np.asarray(buffer.segments.read()).astype(np.int32).reshape(tile[3], tile[2])
        found[found == NO_SEGMENT] = NO_STRAND
        return found, drawing.pass_shift(turn)
