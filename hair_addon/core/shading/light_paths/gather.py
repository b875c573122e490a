# SPDX-License-Identifier: GPL-3.0-or-later
"""Light among strands: paths from the viewer through a grid of their pieces, gathered at the strands that are seen.

Light of lamps that meets a seen strand without having met anything is left out: it is drawn with sharp shadows. All
other light is here: what strands, surfaces and the world send to the seen strands, after any number of events. Beside
it is what the same strands would send back of even light: by the ratio of both each strand of a voxel is shaded as
itself, and their mean is that of the paths.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp

from ...kernels import parallel
from ...kernels.checks import require_count
from . import grid_walk
from .fibre_walk import PI, even_return, turn, value
from .grid_walk import PASSED, STRAND, Medium, fibre_of, walk
from .light_sources import Sources, lit_by, on_disk, world_radiance
from .strand_grid import CELLS_A_VOXEL, StrandGrid

wp.set_module_options({"enable_backward": False, "fast_math": True})

_MOST_EVENTS = wp.constant(1000)
_DIM = wp.constant(0.1)  # weight below which paths are left out at random
_FAR = wp.constant(grid_walk.FAR)
_VOXEL = wp.constant(float(CELLS_A_VOXEL))
_LEAST_PATHS = 4096  # fewer are not worth a thread


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What lights hair beside itself: surfaces, lamps and the world.

    corners: (3 F, 3) of triangles [m]; albedo: (F, 3) of them, diffuse; lamps: (N,) records with the fields of `Light`
    in shaders/include/lights.glsl; drawn_count: of how many, the first, light on seen strands is left out; importance:
    (N,) of lamps, their mean irradiance; world: (H, W, 3) radiance without lamps, a picture of longitude and latitude
    as core/imaging/environment.py takes it apart.
    """

    corners: np.ndarray
    albedo: np.ndarray
    lamps: np.ndarray
    drawn_count: int
    importance: np.ndarray
    world: np.ndarray


@dataclass(frozen=True, eq=False)
class Rays:
    """Rays of a picture: near + x near_x + y near_y to far + x far_x + y far_y, x and y from 0 to 1; (3,) each [m]."""

    near: np.ndarray
    near_x: np.ndarray
    near_y: np.ndarray
    far: np.ndarray
    far_x: np.ndarray
    far_y: np.ndarray


@wp.struct
class _Rays:
    near: wp.vec3
    near_x: wp.vec3
    near_y: wp.vec3
    far: wp.vec3
    far_x: wp.vec3
    far_y: wp.vec3
    side: int  # rays along each of x and y


@wp.func
def _light_of_lamps(
    medium: Medium, sources: Sources, first: int, position: wp.vec3, normal: wp.vec3, own: int, random: wp.uint32
):
    """(direction, irradiance, random state) of a lamp's light that arrives; normal: of a surface, 0 on strand `own`."""
    lit, state = lit_by(sources, first, position, 0.5 * medium.least_cell, random)
    arriving = lit.irradiance
    if wp.dot(normal, normal) > 0.0:
        arriving = arriving * (wp.max(wp.dot(normal, lit.direction), 0.0) / PI)
    if lit.casts_shadow > 0 and wp.max(arriving) > 0.0:
        met, after = walk(medium, position, lit.direction, lit.distance, own, state)
        state = after
        if met.kind != PASSED:
            arriving = wp.vec3(0.0, 0.0, 0.0)
    return lit.direction, arriving, state


@wp.func
def _off_surface(normal: wp.vec3, random: wp.uint32):
    """(direction of light that a diffuse surface sends back, random state)."""
    state = random
    squared = wp.randf(state)
    turned = wp.randf(state)
    direction = on_disk(normal, 1.0, squared, turned) + wp.sqrt(wp.max(0.0, 1.0 - squared)) * normal
    return wp.normalize(direction), state


@wp.kernel
def _gather(
    medium: Medium,
    sources: Sources,
    rays: _Rays,
    seed: int,
    voxels: wp.vec3i,
    out_voxel: wp.array[int],
    out_light: wp.array[wp.vec3],
    out_even: wp.array[wp.vec3],
    first: int,
):
    path = first + wp.tid()
    state = wp.rand_init(seed, path)
    x = (float(path % rays.side) + wp.randf(state)) / float(rays.side)
    y = (float(path / rays.side) + wp.randf(state)) / float(rays.side)
    position = rays.near + x * rays.near_x + y * rays.near_y
    direction = wp.normalize(rays.far + x * rays.far_x + y * rays.far_y - position)
    weight = wp.vec3(1.0, 1.0, 1.0)
    light = wp.vec3(0.0, 0.0, 0.0)
    event = int(0)
    own = int(-1)
    while event < _MOST_EVENTS:
        met, after = walk(medium, position, direction, _FAR, own, state)
        state = after
        if met.kind == PASSED:
            if event > 0:
                light += wp.cw_mul(weight, world_radiance(sources, direction))
            event = _MOST_EVENTS
        elif met.kind == STRAND:
            fibre = fibre_of(medium, met.index)
            viewer = -direction
            position = met.position
            own = medium.strands[met.index]
            first_lamp = int(0)
            if event == 0:
                at = wp.cw_div(position - medium.corner, medium.cell) / _VOXEL
                vx = wp.clamp(int(at[0]), 0, voxels[0] - 1)
                vy = wp.clamp(int(at[1]), 0, voxels[1] - 1)
                vz = wp.clamp(int(at[2]), 0, voxels[2] - 1)
                out_voxel[path] = ((medium.systems[met.index] * voxels[2] + vz) * voxels[1] + vy) * voxels[0] + vx
                out_even[path] = even_return(fibre, viewer)
                first_lamp = sources.drawn_count
            if first_lamp < sources.count:
                towards, arriving, after = _light_of_lamps(
                    medium, sources, first_lamp, position, wp.vec3(0.0, 0.0, 0.0), own, state
                )
                state = after
                if wp.max(arriving) > 0.0:
                    h = 2.0 * wp.randf(state) - 1.0
                    light += wp.cw_mul(wp.cw_mul(weight, arriving), value(fibre, viewer, towards, h))
            direction, weight, after = turn(fibre, viewer, weight, state)
            state = after
        elif event == 0:
            event = _MOST_EVENTS  # a surface is seen
        else:
            position = met.position + met.normal * (1e-4 * medium.least_cell)
            own = -1
            weight = wp.cw_mul(weight, medium.albedo[met.index])
            if sources.count > 0:
                towards, arriving, after = _light_of_lamps(medium, sources, 0, position, met.normal, own, state)
                state = after
                light += wp.cw_mul(weight, arriving)
            direction, after = _off_surface(met.normal, state)
            state = after
        event += 1
        brightest = wp.max(weight)
        if brightest < _DIM:
            if wp.randf(state) * _DIM >= brightest:
                event = _MOST_EVENTS
            weight = weight * (_DIM / wp.max(brightest, 1e-12))
    out_light[path] = light


def gather(
    grid: StrandGrid,
    surroundings: Surroundings,
    rays: Rays,
    path_count: int,
    system_count: int = 1,
    seed: int = 0,
    device: wp.DeviceLike = "cpu",
) -> np.ndarray:
    """(systems, Z, Y, X, 6) float64 by voxel: sums over paths of their light RGB, and of what even light would give.

    path_count: of rays over the picture, rounded to a square; system_count: how many hair systems the grid is of.
    """
    side = max(1, round(path_count**0.5))
    with wp.ScopedDevice(device):
        mesh = _mesh(surroundings)
        medium, sources = _medium(grid, surroundings, mesh), _sources(surroundings)
        voxel = wp.full(side * side, -1, dtype=int)
        light, even = (wp.zeros(side * side, dtype=wp.vec3) for _ in range(2))
        corners = [wp.vec3(*map(float, getattr(rays, name))) for name in ("near", "near_x", "near_y")]
        corners += [wp.vec3(*map(float, getattr(rays, name))) for name in ("far", "far_x", "far_y")]
        lens = _Rays()
        lens.near, lens.near_x, lens.near_y, lens.far, lens.far_x, lens.far_y = corners
        lens.side = side
        inputs = [medium, sources, lens, seed, wp.vec3i(*grid.voxels), voxel, light, even]
        shares = parallel.share_count(side * side, wp.get_device(device), _LEAST_PATHS)
        parallel.launch_shares(_gather, side * side, inputs, [[] for _ in range(shares)], device)
        found, light, even = (array.numpy() for array in (voxel, light, even))
    is_hair = found >= 0
    count = system_count * int(np.prod(grid.voxels))
    channels = [*light[is_hair].T, *even[is_hair].T]
    sums = [np.bincount(found[is_hair], weights=values, minlength=count) for values in channels]
    return np.stack(sums, axis=-1).reshape(system_count, *grid.voxels[::-1], 6)


def _mesh(surroundings):
    """A `wp.Mesh` of the triangles, None without."""
    corners = np.ascontiguousarray(surroundings.corners, np.float32).reshape(-1, 3)
    require_count("surface colors", 3 * len(surroundings.albedo), len(corners))
    if not len(corners):
        return None
    return wp.Mesh(wp.array(corners, dtype=wp.vec3), wp.array(np.arange(len(corners), dtype=np.int32), dtype=int))


def _medium(grid, surroundings, mesh):
    medium = Medium()
    medium.corner, medium.cell = wp.vec3(*grid.corner.tolist()), wp.vec3(*grid.cell.tolist())
    medium.shape, medium.density = wp.vec3i(*grid.shape), float(grid.area / np.prod(grid.cell))
    medium.least_cell = float(grid.cell.min())
    medium.starts = wp.array(grid.starts, dtype=int)
    medium.tangents = wp.array(grid.tangents, dtype=wp.vec3)
    medium.sigma_a = wp.array(grid.sigma_a, dtype=wp.vec3)
    medium.roughness = wp.array(grid.roughness, dtype=float)
    medium.fibres, medium.systems, medium.strands = (
        wp.array(indices, dtype=int) for indices in (grid.fibres, grid.systems, grid.strands)
    )
    medium.fibre_rows = wp.array(grid.fibre_rows, dtype=float)
    medium.mesh, medium.has_mesh = wp.uint64(0) if mesh is None else mesh.id, int(mesh is not None)
    medium.albedo = _vectors(surroundings.albedo)
    return medium


def _sources(surroundings):
    lamps = surroundings.lamps
    require_count("lamps", len(surroundings.importance), len(lamps))
    sources = Sources()
    sources.count, sources.drawn_count = len(lamps), min(surroundings.drawn_count, len(lamps))
    sources.kind = wp.array(lamps["kind"].astype(np.int32), dtype=int)
    sources.position, sources.axis, sources.power = (
        _vectors(lamps[name][:, :3]) for name in ("position", "axis", "power")
    )
    shape = np.stack([lamps[name] for name in ("radius", "cos_cone", "blend", "casts_shadow")], axis=-1)
    sources.shape = wp.array(shape.astype(np.float32).reshape(-1, 4), dtype=wp.vec4)
    # None without a chance: the irradiance elsewhere may be another.
    importance = np.asarray(surroundings.importance, float)
    chance = importance + 0.1 * importance.mean() + 1e-12 if len(lamps) else importance
    sources.chance = wp.array((chance / max(chance.sum(), 1e-30)).astype(np.float32), dtype=float)
    sources.world = wp.array(np.ascontiguousarray(surroundings.world, np.float32), dtype=wp.vec3)
    return sources


def _vectors(values):
    return wp.array(np.ascontiguousarray(values, np.float32).reshape(-1, 3), dtype=wp.vec3)
