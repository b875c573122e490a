# SPDX-License-Identifier: GPL-3.0-or-later
"""Light among strands: paths from seen strands through a grid of all, gathered by voxel.

Each path finds all light that its strand sends to the viewer, after any number of events. Beside it is what the same
strands would send back of even light, and what is drawn of them without paths: dual scattering, with sharp shadows. Of
these three `voxel_means` tells how each strand of a voxel is shaded, so that their mean is that of
the paths.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from ...kernels import parallel
from ...kernels.checks import require_count, require_indices
from ..tables import surface_albedo
from . import grid_walk, light_cache, start_places
from .fibre_walk import even_return, turn
from .grid_walk import PASSED, STRAND, Medium, fibre_of, walk
from .lamp_light import Event, light_at_once, light_by_share, light_met
from .light_cache import LightCache, cached, layer_at
from .light_sources import Sources, across
from .start_places import HIDDEN, StartsOnDevice, start
from .strand_grid import CELLS_A_VOXEL, StrandGrid
from .surface_walk import surface_of, surface_turn
from .world_light import world_of

wp.set_module_options({"enable_backward": False, "fast_math": True})

_MOST_EVENTS = wp.constant(1000)
_DIM = wp.constant(0.1)  # weight below which paths are left out at random
_FAR = wp.constant(grid_walk.FAR)
_LEAST_PATHS = 4096  # fewer are not worth a thread
_EVENTS = 3  # on strands that a path has of its own before the rest of its light is that of the cache
_CACHE_PATHS = 0.2  # for each path of what is seen
_LEAST_CACHE_PATHS = 8192
_CACHE_EVENTS = 8  # of a path that count as places where others could start
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
class Seen:
    """Strands that a viewer sees, in N rays: where paths start."""

    segments: np.ndarray  # (N,) of a grid
    positions: np.ndarray  # (N, 3) [m] of points of the rays, beyond which nothing hides the strands
    directions: np.ndarray  # (N, 3) unit vectors towards the viewer
    areas: np.ndarray  # (N,) [m²] across each ray, where it meets its segment, that it stands for
    drawn: np.ndarray  # (N, 3) radiance that is drawn of them without paths


@wp.kernel
def _gather(
    medium: Medium,
    sources: Sources,
    starts: StartsOnDevice,
    cache: LightCache,
    out_position: wp.array2d[wp.vec3],
    out_light: wp.array2d[wp.vec3],
    out_even: wp.array2d[wp.vec3],
    out_layer: wp.array2d[int],
    first: int,
):
    path = first + wp.tid()
    met, direction, state = start(medium, starts, path)
    weight = wp.vec3(1.0, 1.0, 1.0)
    light = wp.vec3(0.0, 0.0, 0.0)
    event = int(0)
    on_strands = int(0)
    while event < _MOST_EVENTS:
        if met.kind == HIDDEN or met.kind == PASSED:
            event = _MOST_EVENTS
        elif met.kind == STRAND and on_strands == cache.events:
            fibre = fibre_of(medium, met.index)
            even = even_return(fibre, -direction)
            ratio = cached(cache, medium.strands[met.index], -wp.dot(direction, fibre.tangent), met.position)
            light += wp.cw_mul(weight, wp.cw_mul(even, ratio))
            event = _MOST_EVENTS
        else:
            here = Event()
            here.position = met.position
            here.own = -1
            here.weight = weight
            # Numbers of their own: with other lamps a path goes the same way.
            lamp_state = wp.rand_init(1 + event, starts.keys[path])
            if met.kind == STRAND:
                here.fibre = fibre_of(medium, met.index)
                here.facing = -direction
                here.own = medium.strands[met.index]
                here.offset = -met.offset
                if on_strands < out_even.shape[0]:
                    out_position[on_strands, path] = met.position
                    out_even[on_strands, path] = wp.cw_mul(weight, even_return(here.fibre, here.facing))
                    out_light[on_strands, path] = -light
                    out_layer[on_strands, path] = layer_at(cache, here.own, wp.dot(here.facing, here.fibre.tangent))
                if event == 0:
                    light_there, lamp_state = light_at_once(medium, sources, here, lamp_state)
                else:
                    light_there, lamp_state = light_by_share(medium, sources, here, lamp_state)
                direction, weight, after = turn(here.fibre, here.facing, weight, here.offset, state)
                state = after
                on_strands += 1
            else:
                here.facing = -direction
                here.position = met.position - direction * (1e-4 * medium.least_cell)
                color, gloss = medium.albedo[met.index], medium.gloss[met.index]
                here.surface = surface_of(met.normal, here.facing, color, gloss, medium.reflected)
                light_there, lamp_state = light_by_share(medium, sources, here, lamp_state)
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
                light_there, lamp_state = light_met(medium, sources, here, direction, met, lamp_state)
                light += wp.cw_mul(weight, light_there)
    for known in range(wp.min(on_strands, out_light.shape[0])):
        out_light[known, path] = out_light[known, path] + light


def gather(
    grid: StrandGrid,
    surroundings: Surroundings,
    seen: Seen,
    path_count: int,
    seed: int = 0,
    device: wp.DeviceLike = "cpu",
    most_paths: int = 0,
) -> tuple[np.ndarray, int]:
    """(systems, Z, Y, X, 9) float64 by voxel: sums over paths of RGB, their light, what even light would give, and what
    is drawn without paths; and how many paths.

    About `path_count` start on the segments that are seen, those of them that are in sight. As many as there were
    follow again and again, until the standard error of their mean light is 1.5 % of it, or there would be more than
    `most_paths`: few paths of dark hair find a lamp.
    """
    count = len(seen.segments)
    require_indices("segments", seen.segments, len(grid.points) - 1)
    for name in ("positions", "directions", "areas", "drawn"):
        require_count(name, len(getattr(seen, name)), count)
    systems = grid.systems[grid.strands]
    drawn = _by_voxel(grid, _places(grid, seen), systems[seen.segments], len(grid.kept), seen.drawn)
    if not count:
        return np.concatenate([np.zeros((*drawn.shape[:-1], 6)), drawn], axis=-1), 0
    with wp.ScopedDevice(device):
        mesh = mesh_of(surroundings.corners)
        medium = medium_of(grid, mesh, surroundings.normals, surroundings.albedo, surroundings.gloss)
        sources = _sources(surroundings)
        cache = _cache(grid, medium, sources, path_count, seed, device)
        sums, total, squares, taken, tried, turn = 0.0, 0.0, 0.0, 0, 0, 0
        while True:
            more = max(tried, path_count)
            starts = start_places.of_seen(grid, seen, more, seed * _MOST_TURNS + turn)
            positions, light, even, _layers = (found[0] for found in _traced(medium, sources, starts, cache, 1, device))
            is_seen = even.max(axis=-1) > 0.0
            found = np.concatenate([light, even], axis=-1)[is_seen]
            sums = sums + _by_voxel(grid, positions[is_seen], systems[starts.segments[is_seen]], len(grid.kept), found)
            brightness = found[:, :3].sum(axis=1, dtype=np.float64)
            total, squares = total + float(brightness.sum()), squares + float(np.square(brightness).sum())
            taken += len(found)
            tried, turn = tried + more, turn + 1
            if 2 * tried > most_paths or _standard_error(total, squares, taken) < _KNOWN:
                return np.concatenate([sums, drawn * (taken / count)], axis=-1), taken


def _cache(grid, medium, sources, path_count, seed, device):
    """`LightCache` of light among all strands, those that nobody sees as well."""
    starts = start_places.anywhere(grid, max(int(_CACHE_PATHS * path_count), _LEAST_CACHE_PATHS), seed)
    found = _traced(medium, sources, starts, light_cache.none(grid), _CACHE_EVENTS, device)
    is_event = found[2].max(axis=-1) > 0.0
    positions, light, even, layers = (values[is_event] for values in found)
    count = len(grid.kept) * light_cache.SINES
    sums = _by_voxel(grid, positions, layers, count, np.concatenate([light, even], axis=-1))
    return light_cache.of(grid, sums, len(positions), _EVENTS)


def _traced(medium, sources, starts, cache, kept, device):
    """Of paths, at each of the first `kept` strands that they meet: places, light from there on, and what even light
    would give, both by the path's weight there, (kept, N, 3) each, without even light where there is no such strand;
    and the layers of the cache, (kept, N).
    """
    shape = (kept, len(starts.segments))
    found = [*(wp.zeros(shape, dtype=wp.vec3) for _ in range(3)), wp.zeros(shape, dtype=int)]
    inputs = [medium, sources, start_places.on_device(starts), cache, *found]
    launch(_gather, len(starts.segments), inputs, device)
    return [array.numpy() for array in found]


def _standard_error(total, squares, count):
    """Of the mean of values with a sum and a sum of squares, as a part of it."""
    return np.sqrt(max(squares - total * total / count, 0.0)) / total if total > 0.0 else np.inf


def _places(grid, seen):
    """(N, 3) points of segments that are nearest to the rays that see them."""
    start, end = grid.points[seen.segments].astype(np.float64), grid.points[seen.segments + 1]
    along = end - start
    normal = np.cross(seen.directions, along)
    squared = np.maximum((normal**2).sum(axis=1, keepdims=True), 1e-30)
    beside = np.cross(start - seen.positions, seen.directions)
    return start + np.clip((beside * normal).sum(axis=1, keepdims=True) / squared, 0.0, 1.0) * along


def _by_voxel(grid, positions, layers, layer_count, values):
    """(layers, Z, Y, X, C) sums of values (N, C) at positions (N, 3) of layers (N,), such as of each hair."""
    x, y, z = grid.voxels
    at = ((positions - grid.corner) / (grid.cell * CELLS_A_VOXEL)).astype(int).clip(0, np.array([x, y, z]) - 1)
    voxel = ((layers * z + at[:, 2]) * y + at[:, 1]) * x + at[:, 0]
    sums = [np.bincount(voxel, weights=column, minlength=layer_count * x * y * z) for column in values.T]
    return np.stack(sums, axis=-1).reshape(layer_count, z, y, x, -1)


def launch(kernel: wp.Kernel, count: int, inputs: list[Any], device: wp.DeviceLike) -> None:
    shares = parallel.share_count(count, wp.get_device(device), _LEAST_PATHS)
    if count:
        parallel.launch_shares(kernel, count, inputs, [[] for _ in range(shares)], device)


def mesh_of(corners: np.ndarray) -> wp.Mesh | None:
    """A `wp.Mesh` of triangles, None without."""
    corners = np.ascontiguousarray(corners, np.float32).reshape(-1, 3)
    if not len(corners):
        return None
    return wp.Mesh(wp.array(corners, dtype=wp.vec3), wp.array(np.arange(len(corners), dtype=np.int32), dtype=int))


def medium_of(
    grid: StrandGrid, mesh: wp.Mesh | None, normals: np.ndarray, albedo: np.ndarray, gloss: np.ndarray | None = None
) -> Medium:
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
