# SPDX-License-Identifier: GPL-3.0-or-later
"""Rotations of a surface at its vertices on the GPU: core/geometry/vertex_turns.py as a compute program.

A pose only uploads the positions of vertices around roots, twelve bytes each, or shares those of the whole surface.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import gpu
import numpy as np

from ....core.errors import HairError
from ....core.kernels.checks import require_count
from ..programs import shaders
from ..strand_textures import MOST_GROUPS, TEXTURE_WIDTH
from .strand_changes import empty_rows, rows_texture

if TYPE_CHECKING:
    from ....core.geometry.vertex_turns import VertexRotations

_GROUP_SIZE = 64
_VERTEX_TEXELS = 3
_LARGEST_INDEX = 1 << 24  # exact in single precision
_LEAST_PART = 0.125  # of all vertices: fewer are uploaded alone


@dataclass(frozen=True)
class VertexTurner:
    """A `VertexRotations` on the GPU; made by `new_turner`."""

    turned: gpu.types.GPUTexture  # for each vertex its position and axes: shaders/strands/carry_strands.comp
    rings: gpu.types.GPUTexture  # for each vertex its index among uploaded vertices, and its range of `around`
    around: gpu.types.GPUTexture  # indices of faces
    faces: gpu.types.GPUTexture  # see shaders/strands/vertex_rotations.comp
    rest: gpu.types.GPUTexture  # positions of vertices at rest
    smooth_rest: gpu.types.GPUTexture  # positions on the smooth surface at rest; `rest` without one
    needed: np.ndarray | slice  # (N,) vertices whose positions are uploaded
    vertex_count: int  # of the mesh
    turned_count: int
    values: np.ndarray  # (rows, row) float32, a buffer for uploads of positions
    uploaded: Callable | None  # (V, 3) vertices → texture of their positions; None: the needed vertices are uploaded
    turned_to: list = field(default_factory=list)  # [vertices of `turned`, None at rest]; empty: not computed

    @property
    def textures(self) -> list[gpu.types.GPUTexture]:
        """All textures."""
        rest = [self.rest] if self.smooth_rest is self.rest else [self.rest, self.smooth_rest]
        return [self.turned, self.rings, self.around, self.faces, *rest]

    def turn(self, posed: np.ndarray | None) -> gpu.types.GPUTexture:
        """Compute `turned` for finite (V, 3) float32 vertices of the mesh, unless it was computed for the same array.

        posed: the vertices, which must not change later; None: at rest. Raises `HairError` if their number does not
        match.
        """
        if self.turned_to and self.turned_to[0] is posed:
            return self.turned
        self.turned_to.clear()
        now, smooth_rest = self.rest, self.rest
        if posed is not None:
            require_count("vertices", len(posed), self.vertex_count)
            smooth_rest = self.smooth_rest
            now = self.uploaded(posed) if self.uploaded else _gathered(posed, self.needed, self.values)
        program = _turn_program()
        program.bind()
        for name in ("rings", "around", "faces"):
            program.uniform_sampler(name, getattr(self, name))
        for name, texture in (("now", now), ("rest_places", self.rest), ("smooth_rest", smooth_rest)):
            program.uniform_sampler(name, texture)
        program.image("turned", self.turned)
        program.uniform_int("vertex_count", self.turned_count)
        gpu.compute.dispatch(program, -(-self.turned_count // _GROUP_SIZE), 1, 1)
        gpu.shader.unbind()
        self.turned_to.append(posed)
        return self.turned


def new_turner(turning: "VertexRotations", rest: np.ndarray, uploaded: Callable | None = None) -> VertexTurner:
    """Return the `VertexTurner` of a `VertexRotations`; rest: (V, 3) float32, all vertices at rest.

    `rest` differs from the vertices of the `VertexRotations` for a smooth surface. uploaded: a function from (V, 3)
    vertices to a texture of their positions, three texels each, which is used unless roots need few of the vertices;
    None: each pose uploads the needed vertices. Raises `HairError` if counts do not match, the mesh is too large for a
    texture, or the driver does not support it.
    """
    vertex_count = len(turning.rest)
    require_count("vertices", len(rest), vertex_count)
    needed, ring_count = turning.needed, len(turning.around)
    if len(needed) < _LEAST_PART * vertex_count or vertex_count >= _LARGEST_INDEX:
        uploaded = None
    if uploaded is not None:
        needed = np.arange(vertex_count)
    if max(len(needed), len(turning.corners), ring_count) >= _LARGEST_INDEX or (
        len(turning.vertices) > MOST_GROUPS * _GROUP_SIZE
    ):
        raise HairError("The surface has too many vertices for the graphics card.")
    _turn_program()  # first: if it is not supported, nothing is uploaded
    places = np.zeros(vertex_count, np.int32)
    places[needed] = np.arange(len(needed))
    rings = np.zeros((len(turning.vertices), 4), np.float32)
    rings[:, 0], rings[:, 1], rings[:, 2] = places[turning.vertices], turning.starts[:-1], turning.starts[1:]
    faces = np.zeros((max(len(turning.corners), 1), 3, 4), np.float32)
    faces[: len(turning.corners), :, :3] = np.swapaxes(turning.inverses, 1, 2)  # columns
    faces[: len(turning.corners), :, 3] = places[turning.corners]
    around = turning.around if ring_count else np.zeros(1)
    in_row = min(TEXTURE_WIDTH // 3, len(needed))
    values = np.zeros((-(-len(needed) // in_row), 3 * in_row), np.float32)
    chosen = needed if len(needed) < vertex_count else slice(None)
    rest_places = _gathered(rest, chosen, values)
    smooth = rest_places if np.array_equal(rest, turning.rest) else _gathered(turning.rest, chosen, values)
    return VertexTurner(
        turned=empty_rows(len(turning.vertices), _VERTEX_TEXELS)[0],
        rings=rows_texture(rings, 4)[0],
        around=rows_texture(around.reshape(-1, 1).astype(np.float32), 1)[0],
        faces=rows_texture(faces.reshape(len(faces), -1), 4)[0],
        rest=rest_places,
        smooth_rest=smooth,
        needed=chosen,
        vertex_count=vertex_count,
        turned_count=len(turning.vertices),
        values=values,
        uploaded=uploaded,
    )


def _gathered(vertices, needed, values):
    """Return the texture of the needed vertices of (V, 3); values: the buffer for the upload."""
    flat = values.reshape(-1)
    if isinstance(needed, slice):
        flat[: vertices.size] = vertices.ravel()
    else:
        places = flat[: 3 * len(needed)].reshape(-1, 3)
        np.take(vertices, needed, axis=0, out=places, mode="clip")  # other modes copy; indices were checked before
    data = gpu.types.Buffer("FLOAT", values.size, flat)
    texture = gpu.types.GPUTexture((values.shape[1], len(values)), format="R32F", data=data)
    texture.filter_mode(False)
    return texture


@shaders.cached
def _turn_program():
    """Return the compute program that computes rotations at vertices."""
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(_GROUP_SIZE)
    for slot, name in enumerate(("rings", "around", "faces", "now", "rest_places", "smooth_rest")):
        info.sampler(slot, "FLOAT_2D", name)
    info.image(0, "RGBA32F", "FLOAT_2D", "turned", qualifiers={"WRITE"})
    info.push_constant("INT", "vertex_count")
    return shaders.compile_compute(info, "strands/vertex_rotations.comp")
