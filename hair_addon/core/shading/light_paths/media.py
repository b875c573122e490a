# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands, surfaces and lamps on a device, for the kernels that trace paths."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from ...kernels import parallel
from ...kernels.checks import require_count
from ..tables import surface_albedo
from .grid_walk import Medium
from .light_sources import Sources
from .strand_grid import StrandGrid
from .world_light import world_of

_LEAST_PATHS = 1024  # fewer are not worth a thread
_AT_ONCE = 8  # lines that a processor compares with a ray by SIMD instructions


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Everything that lights hair, except hair: surfaces, lamps and the world.

    corners: (3 F, 3) of triangles [m]; normals: (3 F, 3) at corners, unit, or zero for the triangle's own;
    albedo: (F, 3) base colors; lamps: (N,) records with the fields of `Light` in shaders/light/lights.glsl; importance:
    (N,) mean irradiance of lamps; world: (H, W, 3) radiance, an equirectangular picture as in
    core/imaging/environment.py; gloss: (F, 3) roughness, metallic, and reflectance at normal incidence of triangles,
    None if all are matte; is_seen: (F,) bool, whether triangles hide hair from the viewer, None if all do; patterns:
    (L, H, W, 3) light of each `pattern_layer` of lamps, by latitude and longitude around the axes of the lamp, None if
    no lamp has a pattern.
    """

    corners: np.ndarray
    normals: np.ndarray
    albedo: np.ndarray
    lamps: np.ndarray
    importance: np.ndarray
    world: np.ndarray
    gloss: np.ndarray | None = None
    is_seen: np.ndarray | None = None
    patterns: np.ndarray | None = None


def launch(kernel: wp.Kernel, count: int, inputs: list[Any], device: wp.DeviceLike) -> None:
    """Run a kernel of `count` paths on all cores; its last argument is the first path of a share."""
    parts = parallel.part_count(count, device, _LEAST_PATHS)
    if count:
        parallel.launch_shares(kernel, count, inputs, [[] for _ in range(parts)], device)


def mesh_of(corners: np.ndarray) -> wp.Mesh | None:
    """Return a `wp.Mesh` of triangles, None without triangles."""
    corners = np.ascontiguousarray(corners, np.float32).reshape(-1, 3)
    if not len(corners):
        return None
    return wp.Mesh(wp.array(corners, dtype=wp.vec3), wp.array(np.arange(len(corners), dtype=np.int32), dtype=int))


def medium_of(
    grid: StrandGrid, mesh: wp.Mesh | None, normals: np.ndarray, albedo: np.ndarray, gloss: np.ndarray | None = None
) -> Medium:
    """Return the `Medium` of a grid and the triangles of a mesh, on the current device, which must be the grid's.

    The other arguments are those of `Surroundings`.
    """
    corner_count = 0 if mesh is None else len(mesh.indices)
    gloss = np.zeros((corner_count // 3, 3)) if gloss is None else gloss
    require_count("surface gloss", len(gloss), corner_count // 3)
    require_count("surface normals", len(normals), corner_count)
    require_count("surface colors", len(albedo), corner_count // 3)
    medium = Medium()
    medium.corner, medium.voxel, medium.shape = wp.vec3(*grid.corner.tolist()), grid.voxel, wp.vec3i(*grid.shape)
    cells = grid.cells
    medium.along_voxel = cells.along_voxel
    medium.at_once = _AT_ONCE if grid.device.is_cpu else 1
    medium.widths = wp.vec4(*cells.widths.tolist())
    medium.bricks, medium.starts, medium.segments, medium.lines = (
        cells.bricks,
        cells.starts,
        cells.segments,
        cells.lines,
    )
    medium.points, medium.sigma_a, medium.radii = grid.points, grid.sigma_a, grid.radii
    medium.strands, medium.roughness, medium.fibres = grid.strands, grid.roughness, grid.fibres
    medium.scales, medium.fibre_rows = grid.scales, grid.fibre_rows
    medium.mesh, medium.has_mesh = wp.uint64(0) if mesh is None else mesh.id, int(mesh is not None)
    medium.normals, medium.albedo, medium.gloss = (vectors(values) for values in (normals, albedo, gloss))
    medium.reflected = wp.array(surface_albedo.table(), dtype=wp.vec4)
    return medium


def unlit_medium_of(grid: StrandGrid, mesh: wp.Mesh | None) -> Medium:
    """Return the `Medium` of strands and a mesh whose triangles only occlude strands."""
    corner_count = 0 if mesh is None else len(mesh.indices)
    return medium_of(grid, mesh, np.zeros((corner_count, 3)), np.zeros((corner_count // 3, 3)))


def sources_of(surroundings: Surroundings, faint: float) -> Sources:
    """Return the lamps and the world on the current device; faint: as in `Sources`."""
    lamps = surroundings.lamps
    require_count("lamps", len(surroundings.importance), len(lamps))
    sources = Sources()
    sources.count = len(lamps)
    sources.kind = wp.array(lamps["kind"].astype(np.int32), dtype=int)
    sources.position, sources.axis, sources.power = (
        vectors(lamps[name][:, :3]) for name in ("position", "axis", "power")
    )
    shape = np.stack([lamps[name] for name in ("radius", "cos_cone", "blend", "casts_shadow")], axis=-1)
    sources.shape = wp.array(shape.astype(np.float32).reshape(-1, 4), dtype=wp.vec4)
    patterns = np.zeros((0, 1, 1, 3)) if surroundings.patterns is None else surroundings.patterns
    layers = lamps["pattern_layer"].astype(np.int32)
    if layers.max(initial=0) > len(patterns):
        raise ValueError(f"a lamp has pattern {layers.max()} of {len(patterns)}")
    sources.pattern, sources.pattern_rows = wp.array(layers, dtype=int), patterns.shape[1]
    # Records store the axes in columns: see `uniforms.Block`.
    axes = np.ascontiguousarray(lamps["pattern"][:, :, :3], np.float32)
    axes[:, :3] = axes[:, :3].swapaxes(1, 2)
    sources.pattern_axes = wp.array(axes, dtype=wp.vec3, shape=(len(lamps), 4))
    rows = np.ascontiguousarray(patterns, np.float32).reshape(-1, patterns.shape[2], 3)
    sources.patterns = wp.array(rows, dtype=wp.vec3, shape=rows.shape[:2])
    # Give every lamp a non-zero probability: the irradiance may differ elsewhere.
    importance = np.asarray(surroundings.importance, float)
    chance = importance + 0.1 * importance.mean() + 1e-12 if len(lamps) else importance
    sources.chance = wp.array((chance / max(chance.sum(), 1e-30)).astype(np.float32), dtype=float)
    sources.world, sources.faint = world_of(surroundings.world), faint
    return sources


def vectors(values: np.ndarray) -> wp.array:
    """Return numbers (..., 3) as an array of vectors."""
    return wp.array(np.ascontiguousarray(values, np.float32).reshape(-1, 3), dtype=wp.vec3)
