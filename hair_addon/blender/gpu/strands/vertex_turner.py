# SPDX-License-Identifier: GPL-3.0-or-later
"""Turns of a surface at its vertices, where strands are drawn: core/geometry/vertex_turns.py as a compute program.

A pose uploads the places of vertices around roots, twelve bytes each, and nothing else.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import gpu
import numpy as np

from ....core.errors import HairError
from ....core.kernels.checks import require_count
from .. import shaders
from ..strand_textures import MOST_GROUPS, TEXTURE_WIDTH
from .strand_changes import empty_rows, rows_texture

if TYPE_CHECKING:
    from ....core.geometry.vertex_turns import Turning

_GROUP_SIZE = 64
_VERTEX_TEXELS = 3
_LARGEST_INDEX = 1 << 24  # that is exact in single precision


@dataclass(frozen=True)
class VertexTurner:
    """A `Turning` on the GPU; made by `new_turner`."""

    turned: gpu.types.GPUTexture  # of each vertex where it is, and its axes: shaders/strands/carry_strands.comp
    rings: gpu.types.GPUTexture  # of each vertex its place among those that are uploaded, and its faces in `around`
    around: gpu.types.GPUTexture  # indices of faces
    faces: gpu.types.GPUTexture  # shaders/strands/vertex_rotations.comp
    rest: gpu.types.GPUTexture  # places of vertices at rest
    smooth_rest: gpu.types.GPUTexture  # the same on the smooth surface that they turn from; `rest` where none is
    needed: np.ndarray | slice  # (N,) vertices whose places are uploaded
    vertex_count: int  # of the mesh
    turned_count: int
    values: np.ndarray  # (rows, row) float32, which places are gathered in before they are uploaded

    @property
    def textures(self) -> list[gpu.types.GPUTexture]:
        """All that it holds."""
        rest = [self.rest] if self.smooth_rest is self.rest else [self.rest, self.smooth_rest]
        return [self.turned, self.rings, self.around, self.faces, *rest]

    def turn(self, posed: np.ndarray | None) -> gpu.types.GPUTexture:
        """`turned` where the mesh's vertices are at (V, 3) float32, finite; None: at rest.

        Raises `HairError` where there are not as many.
        """
        now, smooth_rest = self.rest, self.rest
        if posed is not None:
            require_count("vertices", len(posed), self.vertex_count)
            now, smooth_rest = _gathered(posed, self.needed, self.values), self.smooth_rest
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
        return self.turned


def new_turner(turning: "Turning", rest: np.ndarray) -> VertexTurner:
    """The `VertexTurner` of a `Turning`; rest: (V, 3) float32, all vertices where strands are at rest.

    They are those of the `Turning` unless that is of a smooth surface. Raises `HairError` where counts do not match, a
    mesh is too large for a texture, or the driver lacks something.
    """
    vertex_count = len(turning.rest)
    require_count("vertices", len(rest), vertex_count)
    needed, ring_count = turning.needed, len(turning.around)
    if max(len(needed), len(turning.corners), ring_count) >= _LARGEST_INDEX or (
        len(turning.vertices) > MOST_GROUPS * _GROUP_SIZE
    ):
        raise HairError("The surface has too many vertices to turn on the graphics card.")
    _turn_program()  # first: where there is none, nothing is uploaded
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
    )


def _gathered(vertices, needed, values):
    """The texture of (V, 3) vertices, those of them that are needed; values: memory for them."""
    flat = values.reshape(-1)
    if isinstance(needed, slice):
        flat[: vertices.size] = vertices.ravel()
    else:
        places = flat[: 3 * len(needed)].reshape(-1, 3)
        np.take(vertices, needed, axis=0, out=places, mode="clip")  # checked when it was made; else NumPy makes a copy
    data = gpu.types.Buffer("FLOAT", values.size, flat)
    texture = gpu.types.GPUTexture((values.shape[1], len(values)), format="R32F", data=data)
    texture.filter_mode(False)
    return texture


@shaders.kept
def _turn_program():
    """The compute program that turns vertices."""
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(_GROUP_SIZE)
    for slot, name in enumerate(("rings", "around", "faces", "now", "rest_places", "smooth_rest")):
        info.sampler(slot, "FLOAT_2D", name)
    info.image(0, "RGBA32F", "FLOAT_2D", "turned", qualifiers={"WRITE"})
    info.push_constant("INT", "vertex_count")
    return shaders.compile_compute(info, "strands/vertex_rotations.comp")
