# SPDX-License-Identifier: GPL-3.0-or-later
"""Light among strands: paths from seen strands through a grid of all, gathered by voxel.

Each path finds all light that its strand sends to the viewer, after any number of events. Beside it is what the same
strands would send back of even light, and what is drawn of them without paths: dual scattering, with sharp shadows. Of
these three `voxel_means` tells how each strand of a voxel is shaded, so that their mean is that of
the paths.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp

from ...kernels import parallel
from ...kernels.checks import require_count, require_indices
from ..tables import surface_albedo
from . import grid_walk
from .fibre_walk import even_return, turn
from .grid_walk import PASSED, STRAND, Medium, fibre_of, seen_place, walk
from .lamp_light import Event, light_at_once, light_by_share, light_met
from .light_sources import Sources, across
from .strand_grid import CELLS_A_VOXEL, StrandGrid
from .surface_walk import surface_of, surface_turn
from .world_light import world_of

wp.set_module_options({"enable_backward": False, "fast_math": True})

_MOST_EVENTS = wp.constant(1000)
_DIM = wp.constant(0.1)  # weight below which paths are left out at random
_FAR = wp.constant(grid_walk.FAR)
_LEAST_PATHS = 4096  # fewer are not worth a thread
_KNOWN = 0.015  # standard error of the mean light, as a part of it, below which no more paths are taken
_MOST_TURNS = 64  # of paths from the same places, each as many as all before


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What lights hair beside itself: surfaces, lamps and the world.

    corners: (3 F, 3) of triangles [m]; normals: (3 F, 3) there, unit, or zero where they are the triangles' own;
    albedo: (F, 3) base colors of them; lamps: (N,) records with the fields of `Light` in shaders/include/lights.glsl;
    importance: (N,) of lamps, their mean irradiance; world: (H, W, 3) radiance, a picture of longitude
    and latitude as core/imaging/environment.py takes it apart; gloss: (F, 3) of triangles, roughness, metallic, and
    reflectance at normal incidence, without it all are matt.
    """

    corners: np.ndarray
    normals: np.ndarray
    albedo: np.ndarray
    lamps: np.ndarray
    importance: np.ndarray
    world: np.ndarray
    gloss: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Rays:
    """Rays of a picture: near + x near_x + y near_y to far + x far_x + y far_y, x and y from 0 to 1; (3,) each [m]."""

    near: np.ndarray
    near_x: np.ndarray
    near_y: np.ndarray
    far: np.ndarray
    far_x: np.ndarray
    far_y: np.ndarray


@dataclass(frozen=True, eq=False)
class Seen:
    """Strands that a viewer sees, in N rays: where paths start."""

    segments: np.ndarray  # (N,) of a grid
    positions: np.ndarray  # (N, 3) [m] of any points of the rays
    directions: np.ndarray  # (N, 3) unit vectors towards the viewer
    drawn: np.ndarray  # (N, 3) radiance that is drawn of them without paths


@wp.struct
class _Rays:
    near: wp.vec3
    near_x: wp.vec3
    near_y: wp.vec3
    far: wp.vec3
    far_x: wp.vec3
    far_y: wp.vec3
    side: int  # rays along each of x and y


@wp.kernel
def _find(
    medium: Medium,
    rays: _Rays,
    seed: int,
    out_segment: wp.array[int],
    out_position: wp.array[wp.vec3],
    out_viewer: wp.array[wp.vec3],
    first: int,
):
    path = first + wp.tid()
    state = wp.rand_init(seed, path)
    x = (float(path % rays.side) + wp.randf(state)) / float(rays.side)
    y = (float(path / rays.side) + wp.randf(state)) / float(rays.side)
    position = rays.near + x * rays.near_x + y * rays.near_y
    direction = wp.normalize(rays.far + x * rays.far_x + y * rays.far_y - position)
    met = walk(medium, position, direction, _FAR, -1)
    out_segment[path] = -1
    if met.kind == STRAND:
        out_segment[path] = met.index
    out_position[path] = met.position
    out_viewer[path] = -direction


@wp.kernel
def _gather(
    medium: Medium,
    sources: Sources,
    seen_segments: wp.array[int],
    seen_positions: wp.array[wp.vec3],
    seen_viewers: wp.array[wp.vec3],
    seed: int,
    out_position: wp.array[wp.vec3],
    out_light: wp.array[wp.vec3],
    out_even: wp.array[wp.vec3],
    first: int,
):
    path = first + wp.tid()
    state = wp.rand_init(seed, path)
    direction = -seen_viewers[path]
    met = seen_place(medium, seen_segments[path], seen_positions[path], direction, 2.0 * wp.randf(state) - 1.0)
    out_position[path] = met.position
    weight = wp.vec3(1.0, 1.0, 1.0)
    light = wp.vec3(0.0, 0.0, 0.0)
    event = int(0)
    while event < _MOST_EVENTS:
        if met.kind == PASSED:
            event = _MOST_EVENTS
        else:
            here = Event()
            here.position = met.position
            here.own = -1
            here.weight = weight
            if met.kind == STRAND:
                here.fibre = fibre_of(medium, met.index)
                here.facing = -direction
                here.own = medium.strands[met.index]
                here.offset = -met.offset
                if event == 0:
                    out_even[path] = even_return(here.fibre, here.facing)
                    light_there, after = light_at_once(medium, sources, here, state)
                else:
                    light_there, after = light_by_share(medium, sources, here, state)
                state = after
                direction, weight, after = turn(here.fibre, here.facing, weight, here.offset, state)
                state = after
            else:
                here.facing = -direction
                here.position = met.position - direction * (1e-4 * medium.least_cell)
                color, gloss = medium.albedo[met.index], medium.gloss[met.index]
                here.surface = surface_of(met.normal, here.facing, color, gloss, medium.reflected)
                light_there, after = light_by_share(medium, sources, here, state)
                state = after
                direction, weight, after = surface_turn(here.surface, across(met.normal), weight, state)
                state = after
            light += light_there
            event += 1
            brightest = wp.max(weight)
            if brightest < _DIM:
                if wp.randf(state) * _DIM >= brightest:
                    event = _MOST_EVENTS
                weight = weight * (_DIM / wp.max(brightest, 1e-12))
            if event < _MOST_EVENTS:
                met = walk(medium, here.position, direction, _FAR, here.own)
                light_there, after = light_met(medium, sources, here, direction, met, state)
                state = after
                light += wp.cw_mul(weight, light_there)
    out_light[path] = light


def seen_by(
    grid: StrandGrid, corners: np.ndarray, rays: Rays, path_count: int, seed: int = 0, device: wp.DeviceLike = "cpu"
) -> Seen:
    """The strands that rays meet before a surface, triangles of corners (3 F, 3): nothing is drawn of them yet.

    path_count: of rays over the picture, rounded to a square; those that meet no strand are left out.
    """
    side = max(1, round(path_count**0.5))
    with wp.ScopedDevice(device):
        mesh = _mesh(corners)
        medium = _medium(grid, mesh, np.zeros((len(corners), 3)), np.zeros((len(corners) // 3, 3)))
        segments = wp.full(side * side, -1, dtype=int)
        positions, viewers = (wp.zeros(side * side, dtype=wp.vec3) for _ in range(2))
        lens = _Rays()
        for name in ("near", "near_x", "near_y", "far", "far_x", "far_y"):
            setattr(lens, name, wp.vec3(*map(float, getattr(rays, name))))
        lens.side = side
        inputs = [medium, lens, seed, segments, positions, viewers]
        _launch(_find, side * side, inputs, device)
        found, positions, viewers = (array.numpy() for array in (segments, positions, viewers))
    is_hair = found >= 0
    count = int(is_hair.sum())
    return Seen(found[is_hair], positions[is_hair], viewers[is_hair], np.zeros((count, 3), np.float32))


def gather(
    grid: StrandGrid,
    surroundings: Surroundings,
    seen: Seen,
    seed: int = 0,
    device: wp.DeviceLike = "cpu",
    most_paths: int = 0,
) -> tuple[np.ndarray, int]:
    """(systems, Z, Y, X, 9) float64 by voxel: sums over paths of RGB, their light, what even light would give, and what
    is drawn without paths; and how many paths.

    One starts at each place that is seen. As many as there were follow again and again, until the standard error of
    their mean light is 1.5 % of it, or there would be more than `most_paths`: few paths of dark hair find a lamp.
    """
    count = len(seen.segments)
    require_indices("segments", seen.segments, len(grid.points) - 1)
    for name in ("positions", "directions", "drawn"):
        require_count(name, len(getattr(seen, name)), count)
    with wp.ScopedDevice(device):
        mesh = _mesh(surroundings.corners)
        medium = _medium(grid, mesh, surroundings.normals, surroundings.albedo, surroundings.gloss)
        sources = _sources(surroundings)
        sums, total, squares, times, turn = 0.0, 0.0, 0.0, 0, 0
        while True:
            more = max(times, 1)
            each = Seen(*(np.tile(values, (more, 1)[: np.ndim(values)]) for values in vars(seen).values()))
            positions, light, even = _traced(medium, sources, each, seed * _MOST_TURNS + turn, device)
            sums = sums + _by_voxel(grid, each, positions, light, even)
            brightness = light.sum(axis=1, dtype=np.float64)
            total, squares = total + float(brightness.sum()), squares + float(np.square(brightness).sum())
            times, turn = times + more, turn + 1
            taken = times * count
            if not count or 2 * taken > most_paths or _standard_error(total, squares, taken) < _KNOWN:
                return sums, taken


def _traced(medium, sources, seen, seed, device):
    """Of paths that start at what is seen: places there, light, and what even light would give, (N, 3) each."""
    places = [wp.array(seen.segments.astype(np.int32), dtype=int)]
    places += [_vectors(values) for values in (seen.positions, seen.directions)]
    found = [wp.zeros(len(seen.segments), dtype=wp.vec3) for _ in range(3)]
    _launch(_gather, len(seen.segments), [medium, sources, *places, seed, *found], device)
    return [array.numpy() for array in found]


def _standard_error(total, squares, count):
    """Of the mean of values with a sum and a sum of squares, as a part of it."""
    return np.sqrt(max(squares - total * total / count, 0.0)) / total if total > 0.0 else np.inf


def _by_voxel(grid, seen, positions, light, even):
    """(systems, Z, Y, X, 9) sums over paths."""
    x, y, z = grid.voxels
    at = ((positions - grid.corner) / (grid.cell * CELLS_A_VOXEL)).astype(int).clip(0, np.array([x, y, z]) - 1)
    system = grid.systems[grid.strands[seen.segments]]
    voxel = ((system * z + at[:, 2]) * y + at[:, 1]) * x + at[:, 0]
    most = len(grid.kept) * x * y * z
    sums = [np.bincount(voxel, weights=values, minlength=most) for values in (*light.T, *even.T, *seen.drawn.T)]
    return np.stack(sums, axis=-1).reshape(len(grid.kept), z, y, x, 9)


def _launch(kernel, count, inputs, device):
    shares = parallel.share_count(count, wp.get_device(device), _LEAST_PATHS)
    if count:
        parallel.launch_shares(kernel, count, inputs, [[] for _ in range(shares)], device)


def _mesh(corners):
    """A `wp.Mesh` of triangles, None without."""
    corners = np.ascontiguousarray(corners, np.float32).reshape(-1, 3)
    if not len(corners):
        return None
    return wp.Mesh(wp.array(corners, dtype=wp.vec3), wp.array(np.arange(len(corners), dtype=np.int32), dtype=int))


def _medium(grid, mesh, normals, albedo, gloss=None):
    corner_count = 0 if mesh is None else len(mesh.indices)
    gloss = np.zeros((corner_count // 3, 3)) if gloss is None else gloss
    require_count("surface gloss", len(gloss), corner_count // 3)
    require_count("surface normals", len(normals), corner_count)
    require_count("surface colors", len(albedo), corner_count // 3)
    medium = Medium()
    medium.corner, medium.cell = wp.vec3(*grid.corner.tolist()), wp.vec3(*grid.cell.tolist())
    medium.shape, medium.least_cell = wp.vec3i(*grid.shape), float(grid.cell.min())
    medium.starts, medium.segments = wp.array(grid.starts, dtype=int), wp.array(grid.segments, dtype=int)
    medium.points, medium.sigma_a = _vectors(grid.points), _vectors(grid.sigma_a)
    medium.radii, medium.roughness = wp.array(grid.radii, dtype=float), wp.array(grid.roughness, dtype=float)
    medium.strands, medium.fibres = wp.array(grid.strands, dtype=int), wp.array(grid.fibres, dtype=int)
    medium.fibre_rows = wp.array(grid.fibre_rows, dtype=float)
    medium.mesh, medium.has_mesh = wp.uint64(0) if mesh is None else mesh.id, int(mesh is not None)
    medium.normals, medium.albedo, medium.gloss = (_vectors(values) for values in (normals, albedo, gloss))
    medium.reflected = wp.array(surface_albedo.table(), dtype=wp.vec4)
    return medium


def _sources(surroundings):
    lamps = surroundings.lamps
    require_count("lamps", len(surroundings.importance), len(lamps))
    sources = Sources()
    sources.count = len(lamps)
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
    sources.world = world_of(surroundings.world)
    return sources


def _vectors(values):
    return wp.array(np.ascontiguousarray(values, np.float32).reshape(-1, 3), dtype=wp.vec3)
