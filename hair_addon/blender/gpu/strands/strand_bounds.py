# SPDX-License-Identifier: GPL-3.0-or-later
"""Bounding boxes of strands that are only on the GPU: boxes of single strands are joined there, six numbers are read.

Compute programs of every backend support it: neither atomics nor shared memory is needed.
"""

from dataclasses import dataclass
from itertools import pairwise

import gpu
import numpy as np

from .. import driver_textures
from ..programs import shaders
from ..strand_box import StrandBox
from ..strand_textures import TEXTURE_WIDTH

_GROUP_SIZE = 64
_PASSES = 3  # each joins the same number of boxes into one: the cube root of the strand count

# Texels of a box: least and greatest coordinates.
_BOX = 2


@dataclass(frozen=True)
class StrandBounds:
    """Textures of bounding boxes, from one per strand to one for all; made by `new_bounds`."""

    levels: tuple  # of (texture, number of boxes)
    share: int  # number of boxes that are joined into one

    @property
    def boxes(self) -> gpu.types.GPUTexture:
        """Texture of the box of each strand: two texels each, with as many per row as fit."""
        return self.levels[0][0]

    def joined(self, former: np.ndarray | None = None) -> StrandBox:
        """Join the boxes of strands; returns the `StrandBox` of the result.

        former: (2, 3) box of the strands before they changed, None: unknown.
        """
        program = _join_program()
        program.bind()
        program.uniform_int("share", self.share)
        for (boxes, count), (joined, joined_count) in pairwise(self.levels):
            program.uniform_sampler("boxes", boxes)
            program.image("joined", joined)
            program.uniform_int("box_count", count)
            program.uniform_int("joined_count", joined_count)
            gpu.compute.dispatch(program, -(-joined_count // _GROUP_SIZE), 1, 1)
        gpu.shader.unbind()
        return StrandBox(self._read, former=former)

    def _read(self):
        return np.array(self.levels[-1][0].read(), np.float32).reshape(_BOX, 4)[:, :3]


def new_bounds(strand_count: int) -> StrandBounds:
    """Return `StrandBounds` for a number of strands. Raises `HairError` if the driver does not support it."""
    _join_program()
    share = max(2, int(np.ceil(strand_count ** (1.0 / _PASSES))))
    counts = [strand_count]
    while len(counts) == 1 or counts[-1] > 1:
        counts.append(-(-counts[-1] // share))
    return StrandBounds(tuple((_boxes_texture(count), count) for count in counts), share)


def _boxes_texture(count):
    in_row = min(TEXTURE_WIDTH // _BOX, count)
    return driver_textures.new_texture((in_row * _BOX, -(-count // in_row)), "RGBA32F")


@shaders.cached
def _join_program():
    """Return the compute program that joins boxes."""
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(_GROUP_SIZE)
    info.sampler(0, "FLOAT_2D", "boxes")
    info.image(0, "RGBA32F", "FLOAT_2D", "joined", qualifiers={"WRITE"})
    for name in ("box_count", "joined_count", "share"):
        info.push_constant("INT", name)
    return shaders.compile_compute(info, "strands/strand_bounds.comp")
