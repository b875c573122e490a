# SPDX-License-Identifier: GPL-3.0-or-later
"""Deforms strands with their surface on the GPU: core/geometry/surface_deform.py as a compute program.

Strands at rest and their roots are uploaded once, or made on the GPU; a pose of the surface only uploads positions of
vertices, once for all hair on a surface.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import gpu
import numpy as np

from ....core.kernels.checks import require_count, require_indices
from ..programs import shaders
from ..strand_textures import StrandsOnGPU, run_for_each
from . import vertex_turner
from .strand_changes import StrandChanges, declare_written, new_changes, rows_texture

if TYPE_CHECKING:
    from ....core.geometry.vertex_turns import VertexRotations

_GROUP_SIZE = 64


@dataclass(frozen=True)
class StrandCarrier:
    """Strands at rest and their roots; made by `new_carrier`."""

    rest: gpu.types.GPUTexture  # in the format of `StrandsOnGPU.texture`
    roots: gpu.types.GPUTexture  # see shaders/strands/carry_strands.comp
    vertices: np.ndarray  # (V, 3) of the surface at rest
    turner: vertex_turner.VertexTurner  # of the vertices around roots
    changes: StrandChanges

    @property
    def textures(self) -> list[gpu.types.GPUTexture]:
        """All textures."""
        return [self.rest, self.roots, *self.turner.textures, *self.changes.textures]

    def carry(self, strands: StrandsOnGPU, posed: np.ndarray | None) -> StrandsOnGPU:
        """Deform all strands from rest; returns the new `StrandsOnGPU`.

        strands: with the same roots; their texture, which must not be `rest`, is changed; posed: (V, 3) float32 finite
        current vertices of the surface, None: at rest. Raises `HairError` if counts do not match.
        """
        turned = self.turner.turn(posed)
        self.changes.keep(strands)
        program = _carry_program()
        program.bind()
        for name, sampled in (("rest", self.rest), ("roots", self.roots), ("vertices", turned)):
            program.uniform_sampler(name, sampled)
        program.image("strands", strands.texture)
        self.changes.bind(program)
        for name, value in (
            ("strand_count", strands.strand_count),
            ("point_count", strands.point_count),
            ("row_strands", strands.row_strands),
            ("is_posed", int(posed is not None)),
        ):
            program.uniform_int(name, value)
        run_for_each(program, strands.strand_count, _GROUP_SIZE)
        gpu.shader.unbind()
        return replace(self.changes.changed(strands), has_bends=strands.has_bends)


def new_carrier(
    rest: gpu.types.GPUTexture,
    point_count: int,
    places: tuple[np.ndarray, np.ndarray],
    vertices: np.ndarray,
    turning: "VertexRotations",
    slides: np.ndarray | None = None,
    uploaded: Callable | None = None,
) -> StrandCarrier:
    """Return the `StrandCarrier` of S strands.

    rest: texture of the strands; places: (S, 3) int32 vertices around each root and (S, 3) float32 barycentric
    coordinates; vertices: (V, 3) float32 of the surface at rest; turning: of the vertices around roots; slides: (S, 3)
    offsets from first points to roots at rest, None if strands begin at their roots; uploaded: as for
    `vertex_turner.new_turner`. Raises `HairError` if counts or indices do not match, or the driver does not support it.
    """
    corners, barycentric = places
    require_count("barycentric coordinates", len(barycentric), len(corners))
    require_indices("vertices", corners, len(vertices))
    _carry_program()  # first: if it is not supported, nothing is uploaded
    turner = vertex_turner.new_turner(turning, vertices, uploaded)
    found = np.searchsorted(turning.vertices, corners)
    require_indices("vertices", found, len(turning.vertices))
    require_count("vertices around roots", np.count_nonzero(turning.vertices[found] == corners), corners.size)
    rows = np.zeros((len(corners), 3, 4), np.float32)
    rows[:, 0, :3], rows[:, 1, :3] = found, barycentric  # indices are exact in single precision up to 16 million
    rows[:, 2, :3] = (barycentric[:, :, None] * vertices[corners]).sum(axis=1)
    if slides is not None:
        require_count("slides", len(slides), len(corners))
        rows[:, 2, :3] -= slides
        rows[:, 2, 3] = slides.any(axis=1)
    roots, _row = rows_texture(rows.reshape(len(rows), -1), 4)
    return StrandCarrier(rest, roots, vertices, turner, new_changes(len(corners), point_count))


@shaders.cached
def _carry_program():
    """Return the compute program that deforms strands with their surface."""
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(_GROUP_SIZE)
    for slot, name in enumerate(("rest", "roots", "vertices")):
        info.sampler(slot, "FLOAT_2D", name)
    declare_written(info, first_slot=0)
    for name in ("strand_count", "point_count", "row_strands", "is_posed"):
        info.push_constant("INT", name)
    return shaders.compile_compute(info, "strands/carry_strands.comp")
