# SPDX-License-Identifier: GPL-3.0-or-later
"""Data of strands after a program has changed them: their former points, and their bounding box."""

from dataclasses import dataclass, replace

import gpu
import numpy as np

from ....core import geometry
from .. import driver_textures
from ..strand_textures import TEXTURE_WIDTH, Moved, StrandsOnGPU, copy_strands, numbers_texture, row_strands_of
from . import strand_bounds

# Maximum number of points whose former positions are stored for motion vectors: 64 MiB.
MOST_MOVED = 8 << 20


@dataclass(frozen=True)
class StrandChanges:
    """Textures that a program changes besides the strands; made by `new_changes`."""

    moved: gpu.types.GPUTexture  # former points, as `Moved.points`; a single texel if they are not stored
    row_moved: int  # strands per row of it, 0 if they are not stored
    moved_rows: gpu.types.GPUTexture
    bounds: strand_bounds.StrandBounds

    @property
    def textures(self) -> list[gpu.types.GPUTexture]:
        """All textures."""
        return [self.moved, self.moved_rows, *(boxes for boxes, _count in self.bounds.levels)]

    def keep(self, strands: StrandsOnGPU) -> None:
        """Store the points of strands that a program is about to change."""
        if self.row_moved:
            copy_strands(strands, self.moved, strands.strand_count, self.row_moved)

    def bind(self, program: gpu.types.GPUShader) -> None:
        """Bind the image `boxes` of a bound program."""
        program.image("boxes", self.bounds.boxes)

    def changed(self, strands: StrandsOnGPU) -> StrandsOnGPU:
        """Return `strands` as the program leaves them.

        The first use of the exact box reads it, and waits until the program has run. So the GPU runs the programs of
        all hair while the CPU reads the rest of the scene.
        """
        before = strands.moved.turn if strands.moved else 0
        if self.row_moved:
            moved = Moved(self.moved, self.row_moved, self.moved_rows, before + 1)
        else:
            # Former points are unknown: counted like more than one change.
            moved = Moved(self.moved, 1, self.moved_rows, before + 2)
        flags = {"is_made": True, "has_points": False, "has_bends": False}
        return replace(strands, moved=moved, box=self.bounds.joined(strands.box.known), **flags)


def new_changes(strand_count: int, point_count: int, keeps_moved: bool = True) -> StrandChanges:
    """Return `StrandChanges` for strands with `point_count` points; keeps_moved: store their former points.

    Raises `HairError` if the driver does not support it.
    """
    bounds = strand_bounds.new_bounds(strand_count)
    if keeps_moved and strand_count * point_count <= MOST_MOVED:
        moved, row_moved = empty_rows(strand_count, 1 + geometry.packed_strands.texel_count(point_count), "RG32F")
        moved_rows = numbers_texture(np.arange(1, strand_count + 1), row_strands_of(point_count))
        return StrandChanges(moved, row_moved, moved_rows, bounds)
    return StrandChanges(empty_rows(1, 1, "RG32F")[0], 0, empty_rows(1, 1)[0], bounds)


def declare_written(info: gpu.types.GPUShaderCreateInfo, first_slot: int) -> None:
    """Declare the images of shaders/strands/write_packed_strand.glsl, from an image slot on."""
    for slot, (name, texture_format) in enumerate((("strands", "RG32F"), ("boxes", "RGBA32F")), start=first_slot):
        info.image(slot, texture_format, "FLOAT_2D", name, qualifiers={"WRITE"})


def rows_texture(values: np.ndarray, channels: int) -> tuple[gpu.types.GPUTexture, int]:
    """Return (texture, rows of values per row of texels) of (N, channels T) float32 values, T texels each."""
    texels = values.shape[1] // channels
    in_row = min(TEXTURE_WIDTH // texels, len(values))
    height = -(-len(values) // in_row)
    if height * in_row > len(values):
        values = np.concatenate([values, np.zeros((height * in_row - len(values), values.shape[1]), np.float32)])
    return driver_textures.new_texture((in_row * texels, height), {1: "R32F", 4: "RGBA32F"}[channels], values), in_row


def empty_rows(count: int, texels: int, texture_format: str = "RGBA32F") -> tuple[gpu.types.GPUTexture, int]:
    """`rows_texture` for `count` rows with undefined values."""
    in_row = min(TEXTURE_WIDTH // texels, count)
    return driver_textures.new_texture((in_row * texels, -(-count // in_row)), texture_format), in_row
