# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces on the GPU: positions of vertices in a texture, and constant data of triangle corners.

A pose uploads the positions of vertices, twelve bytes each. An object that moves rigidly uploads nothing.
"""

from dataclasses import dataclass
from functools import cache, cached_property
from itertools import groupby

import gpu
import numpy as np

from ...core import geometry
from ...core.kernels.checks import require_count, require_indices
from ...core.texture_sides import avoid_powers_of_two
from ..host.caches import Cache
from . import drawing, driver_textures, strand_batches
from .programs import surface_programs, uniforms
from .strand_textures import TEXTURE_WIDTH, bare_vertices

_ROW_VERTICES = TEXTURE_WIDTH // 3  # maximum per row; each is three texels
_ROW_CORNERS = TEXTURE_WIDTH - 1  # maximum per row
_ROW_TRANSFORMS = 250  # transforms in a row of their texture

surface_cache = Cache(capacity=64)  # session_uid of a mesh object → its last drawn `SurfaceOnGPU`
posed_cache = Cache(capacity=16)  # session_uid of a mesh object → the last (vertices, texture) of `posed_places`


@dataclass(frozen=True, eq=False)
class _Corners:
    """The data of a surface that does not change while it moves."""

    vertices: np.ndarray  # (3 F,) int32 vertex of each corner
    has_vertex_normals: bool  # whether normals are of vertices, not of corners
    uvs: np.ndarray | None  # (3 F, 2), None: zero
    colors: tuple  # (number of corners, packed color) of each material, in the corners' order
    vertex_count: int

    def is_same(self, other):
        """Whether other corners are drawn the same way."""
        own, others = ((c.has_vertex_normals, c.colors, c.vertex_count, c.uvs is None) for c in (self, other))
        return own == others and all(
            a is b or np.array_equal(a, b) for a, b in ((self.vertices, other.vertices), (self.uvs, other.uvs))
        )

    @cached_property
    def triangles(self):
        """The batch of indexed triangles without attributes: a shader reads positions by vertex index."""
        vertices = gpu.types.GPUVertBuf(gpu.types.GPUVertFormat(), self.vertex_count)
        indices = gpu.types.GPUIndexBuf(type="TRIS", seq=np.ascontiguousarray(self.vertices.reshape(-1, 3), np.int32))
        return gpu.types.GPUBatch(type="TRIS", buf=vertices, elem=indices)

    @cached_property
    def bare(self):
        """The batch of corners without attributes: a shader reads `texture` by corner index."""
        return bare_vertices(len(self.vertices), "TRIS")

    @cached_property
    def texture(self):
        """Each corner's vertex, as two 16-bit numbers, and its UV: shaders/surfaces/surface_corner.glsl."""
        count = len(self.vertices)
        width = min(count, _ROW_CORNERS)
        texels = np.zeros((avoid_powers_of_two(-(-count // width)) * width, 4), np.float32)
        texels[:count, 0], texels[:count, 1] = self.vertices & 0xFFFF, self.vertices >> 16
        if self.uvs is not None:
            texels[:count, 2:] = self.uvs
        data = gpu.types.Buffer("FLOAT", texels.size, texels.ravel())
        texture = gpu.types.GPUTexture((width, len(texels) // width), format="RGBA32F", data=data)
        texture.filter_mode(False)
        return texture


@dataclass(frozen=True, eq=False)
class SurfaceOnGPU:
    """Triangles of a surface, placed by a matrix."""

    places: gpu.types.GPUTexture  # positions of vertices in the object's coordinates
    normals: gpu.types.GPUTexture  # in the object's coordinates; any texture without normals
    corners: _Corners
    to_world: np.ndarray  # (4, 4)
    vertices: np.ndarray  # (V, 3) float32, as uploaded
    normals_here: np.ndarray | None

    @property
    def vertex_count(self) -> int:
        return self.corners.vertex_count

    @property
    def row_vertices(self) -> int:
        """Vertices per row of textures with a texel for each."""
        return _row_of(self.vertex_count)

    @property
    def shape(self) -> tuple[int, int]:
        """(number of vertices, number of corners)."""
        return self.vertex_count, len(self.corners.vertices)

    @property
    def placed_shape(self) -> "PlacedShape":
        """The positions of vertices in the world, for motion vectors."""
        return PlacedShape(self.shape, self.vertices, self.to_world.tobytes())

    @property
    def samplers(self) -> dict:
        """{sampler: texture} for a program that draws the lit surface."""
        return {"places": self.places, "normals": self.normals, "corners": self.corners.texture}

    @property
    def triangle_count(self) -> int:
        return len(self.corners.vertices) // 3

    @cached_property
    def bounds(self) -> np.ndarray:
        """(2, 3) least and greatest coordinates of all vertices."""
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    def bounds_of(self, first: int, count: int) -> np.ndarray:
        """Return (2, 3) least and greatest coordinates of a range of corners."""
        if (first, count) not in self._bounds:
            places = self.vertices[self.corners.vertices[first : first + count]]
            self._bounds[first, count] = np.stack([places.min(axis=0), places.max(axis=0)])
        return self._bounds[first, count]

    @cached_property
    def _bounds(self):
        return {}

    def placed(self, view: np.ndarray) -> np.ndarray:
        """Return a copy of a `uniforms.VIEW` record with the surface's transform and layout."""
        record = view.copy()
        record["object_to_world"] = self.to_world.T
        record["row_strands"] = self.row_vertices
        record["has_vertex_normals"] = self.corners.has_vertex_normals
        return record


@dataclass(frozen=True, eq=False)
class PlacedShape:
    """The positions of a surface's vertices in the world, which can be compared with those of another time."""

    shape: tuple  # as of `SurfaceOnGPU`
    vertices: np.ndarray
    to_world: bytes

    def __eq__(self, other):
        if (self.shape, self.to_world) != (other.shape, other.to_world):
            return False
        return self.vertices is other.vertices or _have_same_bits(self.vertices, other.vertices)


def _have_same_bits(vectors, others):
    """Whether two arrays (N, 3) float32 have the same bits, also if they are not numbers."""
    own, other = (np.ascontiguousarray(one, np.float32).view(np.uint32) for one in (vectors, others))
    return geometry.fingerprint.are_equal(own, other)


def posed_places(uid, vertices):
    """Return the texture of the (V, 3) float32 vertices of a mesh object, which must not change later.

    All hair that follows the object and the drawn mesh share the texture, if they were given the same array.
    """
    known = posed_cache.get(uid)
    if known is None or known[0] is not vertices:
        known = posed_cache.keep(uid, (vertices, _texture_of(vertices, known)))
    return known[1]


def known_places(uid, vertices):
    """Return the texture of `posed_places` if it was called last with these vertices; else None."""
    known = posed_cache.get(uid)
    return known[1] if known is not None and known[0] is vertices else None


def upload_surface(
    vertices,
    triangles,
    normals=None,
    has_vertex_normals=True,
    uvs=None,
    colors=(),
    to_world=None,
    known=None,
    places=None,
):
    """Return the `SurfaceOnGPU` of vertices (V, 3) float32 and vertex indices (3 F,) of triangles. Raises `HairError`.

    normals: unit, (V, 3) of vertices, or without has_vertex_normals (3 F, 3) of corners, in the coordinates of
    vertices; None if only depth is drawn; to_world: (4, 4), None: vertices are in world space; uvs: (3 F, 2) or None;
    colors: (number of corners, linear RGB) of each part, with which it lights hair, black by default; known: the last
    `SurfaceOnGPU` of the object, or None. Unchanged data is not uploaded again. places: the texture of the vertices if
    it is known.
    """
    packed = tuple(packed_colors([color for _count, color in colors]).tolist()) if colors else (0.0,)
    counts = [count for count, _color in colors] if colors else [len(triangles)]
    if normals is None and known is not None:
        has_vertex_normals = known.corners.has_vertex_normals  # viewports that read normals use the same corners
    corners = _Corners(triangles, has_vertex_normals, uvs, tuple(zip(counts, packed, strict=True)), len(vertices))
    if known is not None and known.corners.is_same(corners):
        corners = known.corners
    else:
        require_indices("vertices", triangles, len(vertices))
        require_count("corners of materials", sum(counts), len(triangles))
    if places is None:
        places = _texture_of(vertices, known and (known.vertices, known.places))
    if normals is None:
        normals_texture = places
    else:
        require_count("normals", len(normals), len(vertices) if has_vertex_normals else len(triangles))
        normals_texture = _texture_of(normals, known and (known.normals_here, known.normals))
    to_world = np.eye(4) if to_world is None else to_world
    return SurfaceOnGPU(places, normals_texture, corners, to_world, vertices, normals)


def packed_colors(colors):
    """Return linear RGB (N, 3) as (N,) float32: square roots in eight bits each, as integers that are exact in
    floats.
    """
    roots = np.rint(255.0 * np.sqrt(np.clip(colors, 0.0, 1.0)))
    return (roots @ np.array([65536.0, 256.0, 1.0])).astype(np.float32)


@cache
def _row_of(count):
    """Number of vectors per row of a texture of `count` vectors: a third of a small number."""
    return min(int(avoid_powers_of_two(-(-count // 3))), _ROW_VERTICES)


def _texture_of(vectors, known):
    """Return a texture of (N, 3) float32 vectors, three texels each; known: (vectors, texture) to reuse if equal, or
    None.
    """
    if known is not None and known[0] is not None and _have_same_bits(vectors, known[0]):
        return known[1]
    row = _row_of(len(vectors))
    row_count = avoid_powers_of_two(-(-len(vectors) // row))
    texels = np.ascontiguousarray(vectors, np.float32).ravel()
    if row_count * row > len(vectors):
        texels = np.append(texels, np.zeros(3 * (row_count * row - len(vectors)), np.float32))
    data = gpu.types.Buffer("FLOAT", texels.size, texels)
    texture = gpu.types.GPUTexture((3 * row, row_count), format="R32F", data=data)
    texture.filter_mode(False)
    return texture


_COLORED = "shadows/shadow_surface.frag"  # the only shader that reads a material's color


def draw_depth(surface, view, light_block, fragment=_COLORED, clip_planes=None):
    """Draw a `SurfaceOnGPU` into a shadow map's first pass, or as an occluder: surfaces/occluding_surface.frag.

    light_block: `uniforms.LIGHTS` on the GPU, for any number of surfaces; clip_planes: (6, 4) that clip an occluder,
    None for none.
    """
    program = surface_programs.depth_program(fragment, clip_planes is not None)
    placed = surface.placed(view)
    clipping = uniforms.clipping_blocks(clip_planes)
    first, has_color = 0, fragment == _COLORED
    for color, parts in groupby(surface.corners.colors, key=lambda part: part[1] if has_color else 0.0):
        count = sum(part_count for part_count, _color in parts)
        placed["surface_color"] = color
        blocks = {"view": uniforms.uniform_buffer(placed), "lights": light_block, **clipping}
        with drawing.bound(program, blocks, {"places": surface.places}):
            surface.corners.triangles.draw_range(program, elem_start=first, elem_count=count)
        first += count


class LinkedSurfaces:
    """`SurfaceOnGPU`s with the same vertices and corners, drawn together as instances.

    bounds: (2, 3) of the vertices, the same for each surface; to_world: (N, 4, 4) object to world.
    """

    def __init__(self, surfaces):
        self._first, self._count = surfaces[0], len(surfaces)
        self.bounds, self.to_world = self._first.bounds, np.stack([surface.to_world for surface in surfaces])
        row_count = int(avoid_powers_of_two(-(-self._count // _ROW_TRANSFORMS)))
        texels = np.zeros((row_count * _ROW_TRANSFORMS, 4, 4), np.float32)
        texels[: self._count] = self.to_world.transpose(0, 2, 1)
        self._transforms = driver_textures.new_texture((4 * _ROW_TRANSFORMS, row_count), "RGBA32F", texels)

    def draw_depth(self, view, light_block, fragment=_COLORED, clip_planes=None):
        """Draw the depth of all surfaces, as `draw_depth` does, in the color of their first part."""
        program = surface_programs.depth_program(fragment, clip_planes is not None, is_linked=True)
        placed = self._first.placed(view)
        placed["surface_color"] = self._first.corners.colors[0][1]
        blocks = {"view": uniforms.uniform_buffer(placed), "lights": light_block}
        textures = {"places": self._first.places, "transforms": self._transforms}
        with drawing.bound(program, blocks | uniforms.clipping_blocks(clip_planes), textures):
            self._first.corners.triangles.draw_instanced(program, instance_start=0, instance_count=self._count)

    def draw_lit(self, program, view, lights, samplers):
        """Draw all surfaces, as `draw_lit` does, with a program for linked surfaces."""
        blocks = {"view": uniforms.uniform_buffer(self._first.placed(view)), "lights": uniforms.uniform_buffer(lights)}
        textures = self._first.samplers | samplers | {"transforms": self._transforms}
        with drawing.bound(program, blocks, textures):
            self._first.corners.bare.draw_instanced(program, instance_start=0, instance_count=self._count)


def linked(surfaces, has_color=False):
    """Return [`SurfaceOnGPU` or `LinkedSurfaces`]: surfaces with the same data are joined; has_color: surfaces with
    several colors are not.
    """
    keys = [
        index if has_color and len({color for _count, color in surface.corners.colors}) > 1 else None
        for index, surface in enumerate(surfaces)
    ]
    groups = linked_groups(surfaces, keys)
    chosen = [[surfaces[index] for index in group] for group in groups]
    return [group[0] if len(group) == 1 else LinkedSurfaces(group) for group in chosen]


def linked_groups(surfaces, keys):
    """Return groups [indices] of surfaces with the same data and equal keys, as `strand_batches.groups_of`."""
    data = ((id(surface.places), id(surface.normals), id(surface.corners)) for surface in surfaces)
    return strand_batches.groups_of(zip(data, keys, strict=True))


def draw_lit(surface, program, view, lights, samplers):
    """Draw a `SurfaceOnGPU` with a program of `surface_programs.arrival_program`."""
    blocks = {"view": uniforms.uniform_buffer(surface.placed(view)), "lights": uniforms.uniform_buffer(lights)}
    with drawing.bound(program, blocks, surface.samplers | samplers):
        surface.corners.bare.draw(program)


def draw_numbers(surface, view, lights, first_triangle):
    """Draw the numbers of a `SurfaceOnGPU`'s triangles, from `first_triangle` on, into a visibility buffer."""
    program = surface_programs.number_program()
    blocks = {"view": uniforms.uniform_buffer(surface.placed(view)), "lights": uniforms.uniform_buffer(lights)}
    with drawing.bound(program, blocks, surface.samplers):
        program.uniform_int("first_triangle", first_triangle)
        surface.corners.bare.draw(program)
