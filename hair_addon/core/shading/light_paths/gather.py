# SPDX-License-Identifier: GPL-3.0-or-later
"""Light among strands: paths from visible strands through a grid of all strands, summed by voxel.

Each path measures the light that its strand scatters to the viewer, after any number of events. Two other sums are
gathered: the light that the same strands would scatter in uniform light, and their light as drawn without paths: dual
scattering, with sharp shadows. From these three sums `voxel_means` computes how each strand of a voxel is shaded, so
that the mean light of the voxel is that of the paths. The light that lamps cast at once on the first strand is also
summed at sample points along strands, because it differs between neighboring strands: `strand_nodes`.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import warp as wp

from ...kernels import kernel_cache
from ...kernels.checks import require_count, require_indices
from ...long_work import Progress, no_progress, part_of
from . import grid_walk, light_texels, start_density, start_places, strand_nodes, view, voxel_means, voxel_sums
from .fibre_walk import even_return, turn
from .grid_walk import PASSED, STRAND, Medium, fibre_of, on_axis, walk
from .lamp_light import Event, light_at_hit, light_at_once, light_by_share
from .light_sources import Sources, across
from .media import Surroundings, launch, medium_of, mesh_of, sources_of, unlit_medium_of
from .seen_rays import Seen
from .start_places import start
from .strand_grid import StrandGrid
from .surface_walk import surface_of, surface_turn
from .world_light import world_radiance

FOLLOWING = "Following light"  # name of the step for progress

wp.set_module_options({"enable_backward": False, "fast_math": True})

_MOST_EVENTS = wp.constant(1000)
_DIM = wp.constant(0.1)  # weight below which paths end at random
_FAR = wp.constant(grid_walk.FAR)
_KNOWN = 0.015  # relative standard error of the mean light below which no more paths are traced
_FAINT = 0.3  # fraction of the mean drawn light below which shadows are traced only at random
_SHARES, _LEAST_SHARE = 8, 8_192  # paths between progress reports on a CPU: a fraction of all paths, and the minimum
_MOST_TURNS = 64  # passes over the same hair, each with its own random numbers
_SPARE = 1.1  # factor of additional paths: the error is an estimate, and each further pass has overhead
_LEAST_TURN = 0.125  # minimum paths of a further pass, as a fraction of the previous paths


@wp.kernel
def _gather(
    medium: Medium,
    sources: Sources,
    seen_in: view.ViewOnDevice,
    segments: wp.array[int],
    keys: wp.array[int],
    out_position: wp.array[wp.vec3],
    out_light: wp.array[wp.vec3],
    out_even: wp.array[wp.vec3],
    out_at_once: wp.array[wp.vec3],
    out_later: wp.array[wp.vec3],
    out_world: wp.array[wp.vec3],
    first: int,
):
    path = first + wp.tid()
    hit, direction, state = start(medium, seen_in, segments[path], keys[path])
    weight = wp.vec3(1.0, 1.0, 1.0)
    light = wp.vec3(0.0, 0.0, 0.0)
    at_once = wp.vec3(0.0, 0.0, 0.0)
    of_world = wp.vec3(0.0, 0.0, 0.0)
    event = int(0)
    while event < _MOST_EVENTS:
        if hit.kind == PASSED:
            event = _MOST_EVENTS
        else:
            here = Event()
            here.position = hit.position
            here.own = -1
            here.weight = weight
            # A separate random sequence: with other lamps a path takes the same directions.
            lamp_state = wp.rand_init(1 + event, keys[path])
            if hit.kind == STRAND:
                here.fibre = fibre_of(medium, hit.index)
                here.facing = -direction
                here.own = medium.strands[hit.index]
                here.offset = -hit.offset
                if event == 0:
                    out_position[path] = on_axis(medium, hit.index, hit.position)
                    out_even[path] = even_return(here.fibre, here.facing)
                    light_there, lamp_state = light_at_once(medium, sources, here, lamp_state)
                    at_once = light_there
                else:
                    light_there, lamp_state = light_by_share(medium, sources, here, lamp_state)
                direction, weight, after = turn(here.fibre, here.facing, weight, here.offset, state)
                state = after
            else:
                here.facing = -direction
                here.position = hit.position - direction * (5e-5 * medium.voxel)
                color, gloss = medium.albedo[hit.index], medium.gloss[hit.index]
                here.surface = surface_of(hit.normal, here.facing, color, gloss, medium.reflected)
                light_there, lamp_state = light_by_share(medium, sources, here, lamp_state)
                direction, weight, after = surface_turn(here.surface, across(hit.normal), weight, state)
                state = after
            light += light_there
            event += 1
            brightest = wp.max(weight)
            if brightest < _DIM:
                if wp.randf(state) * _DIM >= brightest:
                    event = _MOST_EVENTS
                weight = weight * (_DIM / wp.max(brightest, 1e-12))
            if event < _MOST_EVENTS:
                hit = walk(medium, here.position, direction, _FAR, here.own)
                light_there, lamp_state = light_at_hit(medium, sources, here, direction, hit, lamp_state)
                found = wp.cw_mul(weight, light_there)
                light += found
                if hit.kind == PASSED and sources.world.is_uneven == 0:
                    from_world = wp.cw_mul(weight, world_radiance(sources.world, direction))
                    of_world += from_world
                    found -= from_world
                if event == 1:
                    at_once += found
    out_light[path] = light
    out_at_once[path] = at_once
    out_later[path] = light - at_once - of_world
    out_world[path] = of_world


@wp.kernel
def _even(
    medium: Medium,
    seen_in: view.ViewOnDevice,
    segments: wp.array[int],
    places: wp.array[wp.vec3],
    out_even: wp.array[wp.vec3],
    first: int,
):
    sample = first + wp.tid()
    x, y, _area = view.seen_at(seen_in, places[sample])
    out_even[sample] = even_return(fibre_of(medium, segments[sample]), -view.direction_at(seen_in, x, y))


@wp.kernel
def _weigh(weights: wp.array[float], power: float, values: wp.array[wp.vec3]):
    path = wp.tid()
    values[path] = wp.pow(weights[path], power) * values[path]


def gather(
    grid: StrandGrid,
    surroundings: Surroundings,
    seen: Seen,
    path_count: int,
    seed: int = 0,
    most_paths: int = 0,
    progress: Progress = no_progress,
    noise: float = math.inf,
) -> "PathSums":
    """Return the sums of paths in a view.

    About `path_count` paths start on visible hair. Further passes add the number of paths that reduces the relative
    standard error of the mean light to 1.5 %, and that of visible voxels to `noise`, by estimate, at most as many as
    before, up to `most_paths` in total: in dark hair few paths reach a lamp.
    """
    light = PathSums(grid, surroundings)
    light.see(seen)
    if not len(seen.segments):
        return light
    tried, turn, more = 0, 0, path_count
    while True:
        light.follow(more, seed * _MOST_TURNS + turn, part_of(progress, tried / (tried + more), 1.0))
        tried, turn = tried + more, turn + 1
        wanted = light.wanted_for(noise)  # factor of the number of paths
        more = int(tried * min(max(_SPARE * wanted - 1.0, _LEAST_TURN), 1.0))
        if wanted < 1.0 or tried + more > most_paths:
            return light


class PathSums:
    """Sums of `gather` over the paths of any number of views, pass by pass.

    The sums of a voxel are RGB: over paths, their light and the light in uniform light; over the picture's samples, the
    light drawn without paths and the light in uniform light.

    taken: number of paths, reduced where sums have faded.
    """

    def __init__(self, grid: StrandGrid, surroundings: Surroundings) -> None:
        self.grid, self.taken = grid, 0.0
        self._sums = voxel_sums.VoxelSums(grid)
        self._nodes = strand_nodes.NodeSums(grid)
        # Only nodes need the parts of light.
        self._parts = voxel_sums.VoxelSums(grid, strand_nodes.CHANNELS) if len(self._nodes) else None
        self._total = self._squares = 0.0
        self._seen: Seen | None = None
        self._voxel_count = 0  # with visible hair
        self._surroundings = surroundings
        with wp.ScopedDevice(grid.device):
            self._mesh = mesh_of(surroundings.corners)
            of_surfaces = surroundings.normals, surroundings.albedo, surroundings.gloss
            self._medium = medium_of(grid, self._mesh, *of_surfaces)
            self._in_sight, self._hiding = _sight_of(grid, surroundings) or (self._medium, self._mesh)

    def see(self, seen: Seen, weight: float = 1.0) -> None:
        """Start further paths in another view: multiply the sums by a weight, and add the light drawn in the view.

        An exception raised by a pause of `parallel.on_one_core` leaves everything unchanged.
        """
        count = len(seen.segments)
        require_indices("segments", seen.segments.numpy(), len(self.grid.points) - 1)
        for name in ("places", "drawn"):
            require_count(name, len(getattr(seen, name)), count)
        with wp.ScopedDevice(self.grid.device):
            even = self._start_in(seen) if count else None
            if weight != 1.0:
                self._fade(weight)
            if even is not None:
                self._sums.add(seen.places, seen.segments, seen.drawn, even, 6)
                different = {id(of_hair): of_hair for of_hair in self._sums.of_systems()}
                start_density.set_levels(self._levels, list(different.values()))
        self._seen = seen

    def _start_in(self, seen):
        """Prepare paths from a view with visible hair, and return the light of its samples in uniform light."""
        even = _even_there(self._medium, seen.view, seen.segments, seen.places)
        faint = _FAINT * voxel_sums.brightness(seen.drawn)[0] / len(seen.segments)
        self._sources = sources_of(self._surroundings, faint)
        self._levels, self._voxel_count = start_places.voxels_of(self._medium, seen.places)
        self._areas = None  # `start_places.areas_of` the levels, computed with the next paths
        self._is_even = False
        self._found_squares = np.zeros(2)  # of the light of paths, and of the same with even density
        return even

    def follow(self, count: int, seed: int, progress: Progress = no_progress) -> None:
        """Trace about `count` paths from visible hair, and add them to the sums.

        The sums change only at the end, so an exception raised by `progress`, or by a pause, leaves them unchanged.
        """
        if self._seen is None or not len(self._seen.segments):
            return
        with wp.ScopedDevice(self.grid.device):
            if self._areas is None:
                self._areas = start_places.areas_of(self._in_sight, self._seen, self._levels)
            starts = start_places.of_seen(self._in_sight, self._seen, self._levels, self._areas, count, seed)
            traced = _traced(self._medium, self._sources, self._seen.view, starts, progress)
            positions, light, even, *parts = traced
            if self._parts is not None:
                # Sums of nodes are not added to others, so paths need no weights, and more paths are known better.
                self._nodes.add(starts.segments, positions, parts[0], even)
            # Squares of light with half of the weight's power are those that paths of even density would have.
            _multiply((light,), starts.weights, 0.5)
            even_squares = voxel_sums.brightness(light)[1]
            _multiply((light,), starts.weights, 0.5)
            _multiply((even, *parts), starts.weights, 1.0)
            self._sums.add(positions, starts.segments, light, even, 0)
            if self._parts is not None:
                for index, part in enumerate(parts):
                    self._parts.add(positions, starts.segments, part, even, 6 * index)
            total, squares = voxel_sums.brightness(light)
            self._compare_density(squares, even_squares)
        self._total, self._squares, self.taken = self._total + total, self._squares + squares, self.taken + len(light)

    def _compare_density(self, squares, even_squares):
        """Start further paths with even density unless other density reduces the squares of their light enough."""
        self._found_squares += np.array([squares, even_squares])
        if not self._is_even and self._found_squares[0] > start_density.WORTH * self._found_squares[1]:
            start_density.set_even(self._levels)
            self._areas, self._is_even = None, True

    @property
    def wanted(self) -> float:
        """The factor of paths that, by estimate, reduces the relative standard error of the mean light to 1.5 %."""
        return (_standard_error(self._total, self._squares, self.taken) / _KNOWN) ** 2

    def wanted_for(self, noise: float) -> float:
        """Return the greater of `wanted` and the factor of paths that, by estimate, reduces the relative standard error
        of the light of visible voxels to `noise`, with the weight of larger voxels.
        """
        if self._total <= 0.0:
            return math.inf
        paths = (self._variance / noise**2 - self.prior) * self._voxel_count
        return max(self.wanted, paths / self.taken)

    @property
    def prior(self) -> float:
        """The weight of larger voxels, in paths, for `voxel_means.shares`."""
        return voxel_means.prior_of(self.taken / max(self._voxel_count, 1))

    @property
    def _variance(self):
        """Variance of a path's light, relative to the square of its mean."""
        return _standard_error(self._total, self._squares, self.taken) ** 2 * self.taken

    def _fade(self, weight):
        for sums in (self._sums, self._parts, self._nodes):
            if sums is not None:
                sums.scale(weight)
        self._total, self._squares, self.taken = weight * self._total, weight * self._squares, weight * self.taken

    def of_systems(self) -> list[wp.array4d[wp.float64]]:
        """Return sums (Z, Y, X, 12) of each hair system: the same object for linked hair."""
        return self._sums.of_systems()

    def texels(
        self, former: "PathSums | None" = None, weight: float = 0.0, shift: np.ndarray | float = 0.0
    ) -> list[np.ndarray]:
        """Return `light_texels.packed` of each hair system: the same object for linked hair.

        former: earlier sums on this device with the same number of systems, which are added with a weight; shift: (3,)
        motion of the hair since then [m].
        """
        sums, taken = self._sums, self.taken
        if former is not None and weight > 0.0:
            sums, taken = voxel_sums.VoxelSums(self.grid), taken + weight * former.taken
            sums.carry(self._sums, 1.0, 0.0)
            sums.carry(former._sums, weight, shift)
        count, origin = max(int(taken), 1), self.grid.origin
        prior = voxel_means.prior_of(taken / max(self._voxel_count, 1))
        found = of_each(lambda of_hair: voxel_means.shares(of_hair, count, origin, prior), sums.of_systems())
        parts, paths = [] if self._parts is None else self._parts.of_systems(), max(int(self.taken), 1)

        def of_nodes(system):
            if not self._nodes.has(system):
                return None
            return self._nodes.texels(system, *voxel_means.smooth_box(parts[system], paths, origin, self.prior))

        # Linked hair has no nodes.
        nodes = {id(voxels): of_nodes(system) for system, voxels in enumerate(found)}
        return of_each(lambda voxels: light_texels.packed(voxels, nodes[id(voxels)]), found)


def of_each(make: Callable[[Any], Any], values: Sequence[Any]) -> list[Any]:
    """Return make(value) of each value, computed once for each object, as linked hair has common sums."""
    made = {id(value): value for value in values}
    made = {key: make(value) for key, value in made.items()}
    return [made[id(value)] for value in values]


def _sight_of(grid, surroundings):
    """Return (`Medium` with the visible surfaces, their mesh) if some surfaces are invisible.

    None if all are visible.
    """
    if surroundings.is_seen is None or surroundings.is_seen.all():
        return None
    require_count("visibilities of surfaces", len(surroundings.is_seen), len(surroundings.corners) // 3)
    mesh = mesh_of(surroundings.corners.reshape(-1, 3, 3)[surroundings.is_seen])
    return unlit_medium_of(grid, mesh), mesh


def _even_there(medium, seen_in, segments, places):
    """Return the light (N,) RGB of samples in uniform light."""
    found, device = wp.zeros(len(segments), dtype=wp.vec3), medium.points.device
    launch(_even, len(found), [medium, view.on_device(seen_in), segments, places, found], device)
    return found


def _traced(medium, sources, seen_in, starts, progress):
    """Trace paths, and return their start places, their light, the light in uniform light, the light that lamps
    cast at once on the first strand, and later light, (N,) each.
    """
    count, seen_here, device = len(starts.segments), view.on_device(seen_in), medium.points.device
    found = [wp.zeros(count, dtype=wp.vec3) for _ in range(6)]
    # On a GPU a share takes about as long as all paths.
    share = max(count // _SHARES, _LEAST_SHARE) if device.is_cpu else max(count, 1)
    for first in range(0, count, share):  # none if no place is visible: Warp has no empty slices
        some = slice(first, min(first + share, count))
        rows = [array[some] for array in (starts.segments, starts.keys, *found)]
        launch(_gather, len(rows[0]), [medium, sources, seen_here, *rows], device)
        progress(FOLLOWING, some.stop / count)
    return found


def _multiply(values, weights, power):
    for of_paths in values:
        kernel_cache.launch(_weigh, len(weights), [weights, power, of_paths], [], weights.device)


def _standard_error(total, squares, count):
    """Return the relative standard error of the mean of values with this sum and sum of squares."""
    return np.sqrt(max(squares - total * total / count, 0.0)) / total if total > 0.0 else np.inf
