# SPDX-License-Identifier: GPL-3.0-or-later
"""The box around strands that only the GPU knows: boxes of each, joined there, of which six numbers come back.

Compute programs of every backend can do it: neither atomics nor memory that a work group shares is needed.
"""

from dataclasses import dataclass
from itertools import pairwise

import gpu
import numpy as np

from .. import driver_textures, shaders
from ..strand_textures import TEXTURE_WIDTH

_GROUP_SIZE = 64
_PASSES = 3  # each joins as many boxes to one as the others: the cube root of their number

# Texels of a box: least and greatest coordinates.
_BOX = 2


@dataclass(frozen=True)
class StrandBounds:
    """Textures that boxes are joined in, from one of each strand to one of all; made by `new_bounds`."""

    levels: tuple  # of (texture, how many boxes)
    share: int  # boxes that become one

    @property
    def boxes(self) -> gpu.types.GPUTexture:
        """Where the box of each strand is written: two texels, in rows of as many as fit."""
        return self.levels[0][0]

    def read(self) -> np.ndarray:
        """(2, 3) float32, the least and the greatest coordinates; waits until the strands are made."""
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
        return np.array(self.levels[-1][0].read(), np.float32).reshape(_BOX, 4)[:, :3]


def new_bounds(strand_count: int) -> StrandBounds:
    """`StrandBounds` of so many strands. Raises `HairError` where the driver lacks something."""
    _join_program()
    share = max(2, int(np.ceil(strand_count ** (1.0 / _PASSES))))
    counts = [strand_count]
    while len(counts) == 1 or counts[-1] > 1:
        counts.append(-(-counts[-1] // share))
    return StrandBounds(tuple((_boxes_texture(count), count) for count in counts), share)


def _boxes_texture(count):
    in_row = min(TEXTURE_WIDTH // _BOX, count)
    return driver_textures.made((in_row * _BOX, -(-count // in_row)), "RGBA32F")


@shaders.kept
def _join_program():
    """The compute program that joins boxes."""
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(_GROUP_SIZE)
    info.sampler(0, "FLOAT_2D", "boxes")
    info.image(0, "RGBA32F", "FLOAT_2D", "joined", qualifiers={"WRITE"})
    for name in ("box_count", "joined_count", "share"):
        info.push_constant("INT", name)
    return shaders.compile_compute(info, "strands/strand_bounds.comp")
