# SPDX-License-Identifier: GPL-3.0-or-later
"""Warp kernels run as compute programs write the same values as Warp on the processor."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp

from hair_addon.blender.gpu import kernel_programs
from hair_addon.blender.gpu.programs import uniforms
from hair_addon.core.imaging import lamps
from hair_addon.core.shading.light_paths import gather, media, seen_rays, start_places, view, voxel_sums
from tests.core.shading.light_paths.test_gather import (
    ALONG_Y,
    FLOOR,
    LAMP,
    grid_of,
    strands_in_a_box,
    sun,
    surroundings,
)

wp.set_module_options({"enable_backward": False})

COUNT = 3000
_HALF = wp.constant(0.5)


@wp.struct
class _Pair:
    """A struct with a member that is another struct."""

    first: wp.vec3
    second: float


@wp.struct
class _Given:
    numbers: wp.array2d[float]
    vectors: wp.array[wp.vec3]
    words: wp.array[wp.uint32]
    shape: wp.vec3i
    factor: float


@pytest.fixture(autouse=True)
def on_the_processor():
    """Create the compared arrays on the processor, also on a computer with CUDA."""
    with wp.ScopedDevice("cpu"):
        yield


@wp.func
def _both(given: _Given, index: int, half: float):
    """Hold two values, one of them a struct."""
    pair = _Pair()
    pair.first = given.vectors[index]
    if half > _HALF:
        pair.second = given.factor
        return pair, -1
    elif half > 0.25:
        pair.second = 2.0 * given.factor
        return pair, 0
    return pair, given.shape[index % 3]


@wp.func
def _doubled(values: wp.array2d[float], row: int):
    total = float(0.0)
    for column in range(values.shape[1]):
        total += values[row, column]
    return 2.0 * total


@wp.kernel
def _everything(
    given: _Given,
    seeds: wp.array[int],
    first: int,
    out_random: wp.array[float],
    out_vector: wp.array[wp.vec3],
    out_whole: wp.array[int],
    out_bits: wp.array[wp.uint32],
):
    index = first + wp.tid()
    state = wp.rand_init(3, seeds[index])
    out_random[index] = wp.randf(state) - wp.randf(state)
    pair, whole = _both(given, index, wp.randf(state))
    x = 2.0 * wp.randf(state) - 1.0
    turned = wp.vec3(wp.asin(x), wp.atan2(x, pair.first[0]), wp.sign(x) * wp.pow(wp.abs(x), 3.0))
    turned = wp.cw_mul(turned, wp.normalize(wp.cross(pair.first, wp.vec3(0.0, 0.0, 1.0))))
    for axis in range(3):
        turned[axis] = turned[axis] + pair.second * wp.where(x < 0.0 and axis > 0, 1.0, -1.0)
    out_vector[index] = turned / (1.0 + wp.max(pair.first)) + wp.vec3(_doubled(given.numbers, index), 0.0, 0.0)
    low = int(0)
    while low * low < index and not low > 50:
        low += 1
    out_whole[index] = whole - 7 * low / 2 + seeds[index]
    out_bits[index] = (given.words[index] >> wp.uint32(3)) ^ (given.words[index] << wp.uint32(5))


def run_in_warp(kernel, count, given, written):
    """Return {array: values} of a kernel on the processor."""
    found = {name: wp.zeros(count, dtype=kind) for name, kind in written.items()}
    arguments = [(given | found)[argument.label] for argument in kernel.adj.args]
    wp.launch(kernel, dim=count, inputs=arguments, device="cpu")
    return {name: array.numpy() for name, array in found.items()}


def test_a_kernel_writes_what_warp_writes(rng):
    given = _Given()
    given.numbers = wp.array(rng.normal(size=(COUNT, 5)).astype(np.float32), dtype=float)
    given.vectors = wp.array(rng.uniform(0.1, 1.0, (COUNT, 3)).astype(np.float32), dtype=wp.vec3)
    given.words = wp.array(rng.integers(0, 2**32, COUNT).astype(np.uint32), dtype=wp.uint32)
    given.shape, given.factor = wp.vec3i(5, -6, 70_000_001), 0.75
    seeds = wp.array(rng.integers(-(2**31), 2**31, COUNT).astype(np.int32), dtype=int)
    parameters = {"given": given, "seeds": seeds, "first": 0}
    written = {"out_random": float, "out_vector": wp.vec3, "out_whole": int, "out_bits": wp.uint32}
    expected = run_in_warp(_everything, COUNT, parameters, written)
    prepared = kernel_programs.prepare(_everything, parameters)
    assert prepared._buffer is not uniforms.uniform_buffer(prepared.record)  # `run` would change a shared buffer
    found = prepared.run(COUNT)
    for name in ("out_random", "out_whole", "out_bits"):
        np.testing.assert_array_equal(found[name], expected[name], name)
    np.testing.assert_allclose(found["out_vector"], expected["out_vector"], rtol=2e-5, atol=2e-5)


@wp.kernel
def _trace(
    mesh: wp.uint64,
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    out_face: wp.array[int],
    out_place: wp.array[wp.vec3],
    out_normal: wp.array[wp.vec3],
):
    ray = wp.tid()
    found = wp.mesh_query_ray(mesh, origins[ray], directions[ray], 3.0)
    out_face[ray] = -1
    if found.result:
        out_face[ray] = found.face
        out_place[ray] = wp.vec3(found.u, found.v, found.t)
        out_normal[ray] = found.normal


def test_rays_hit_the_triangles_that_they_hit_in_warp(rng):
    corners = (rng.uniform(-1.0, 1.0, (700, 1, 3)) + rng.normal(scale=0.1, size=(700, 3, 3))).astype(np.float32)
    mesh = media.mesh_of(corners)
    directions = rng.normal(size=(COUNT, 3))
    directions[:30] = np.repeat([*np.eye(3), *-np.eye(3)], 5, axis=0)  # along the axes
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    rays = [wp.array(values.astype(np.float32), dtype=wp.vec3) for values in (rng.normal(size=(COUNT, 3)), directions)]
    given = {"mesh": mesh.id, "origins": rays[0], "directions": rays[1]}
    expected = run_in_warp(_trace, COUNT, given, {"out_face": int, "out_place": wp.vec3, "out_normal": wp.vec3})
    found = kernel_programs.prepare(_trace, given, corners).run(COUNT)
    assert (expected["out_face"] >= 0).sum() > COUNT // 8
    is_same = found["out_face"] == expected["out_face"]
    assert (~is_same).sum() <= 2  # of triangles that cross in front of a ray
    for name in ("out_place", "out_normal"):
        np.testing.assert_allclose(found[name][is_same], expected[name][is_same], atol=2e-4, err_msg=name)


def lit_scene(rng, sigma_a):
    """Return (grid, surroundings): strands in a box on a glossy floor, lit by four kinds of lamps and an uneven
    world.
    """
    grid = grid_of(strands_in_a_box(rng, 300), sigma_a, voxel_count=625)
    near = np.zeros(2, LAMP)
    near["kind"], near["radius"], near["casts_shadow"] = [lamps.POINT, lamps.AREA], [0.1, 0.5], 1
    near["position"][:, :3], near["axis"][:, :3] = [(1.5, -1.5, 1.0), (-1.5, -1.0, 0.5)], [(0, 0, 1), (0.8, 0.6, 0)]
    near["power"][:, :3] = 20.0
    light = surroundings(FLOOR, [(0.6, 0.5, 0.4)], np.concatenate([sun((0.0, 1.0, 0.0)), near]))
    world = np.full((8, 16, 3), 0.2)
    world[5, 5] = 30.0
    return grid, replace(light, world=world, gloss=np.array([[0.4, 0.2, 0.05]]))


def paths_of(grid, light, count):
    """Return ({parameter: value} of `gather._gather`, number of paths, the mesh, which Warp knows while it is
    referenced).
    """
    seen, mesh = seen_rays.seen_by(grid, light.corners, ALONG_Y, count), media.mesh_of(light.corners)
    medium = media.medium_of(grid, mesh, light.normals, light.albedo, light.gloss)
    levels, _voxel_count = start_places.voxels_of(medium, seen.places)
    areas = start_places.areas_of(medium, seen, levels)
    starts = start_places.of_seen(medium, seen, levels, areas, count, 0)
    given = {
        "medium": medium,
        "sources": media.sources_of(light, 0.01),
        "seen_in": view.on_device(seen.view),
        "first": 0,
    }
    given |= {name: getattr(starts, name) for name in ("segments", "keys")}
    return given, len(starts.segments), mesh


GATHERED = dict.fromkeys(("out_position", "out_light", "out_even", "out_at_once", "out_later", "out_world"), wp.vec3)


def test_paths_of_light_are_those_of_the_processor(rng):
    """Paths on the GPU have the same starts and random numbers as on the processor.

    Each scattering event magnifies rounding a hundredfold, so some paths diverge. The others carry the same light, and
    the mean is equal within its error.
    """
    grid, light = lit_scene(rng, (0.1, 0.3, 1.0))
    given, count, _mesh = paths_of(grid, light, 3000)
    expected = run_in_warp(gather._gather, count, given, GATHERED)
    corners = light.corners.reshape(-1, 3, 3)
    prepared = kernel_programs.prepare(gather._gather, given, corners)
    found = prepared.run(count)
    np.testing.assert_allclose(found["out_position"], expected["out_position"], atol=1e-6)
    np.testing.assert_allclose(found["out_even"], expected["out_even"], atol=2e-6)
    difference = (found["out_light"] - expected["out_light"]).astype(float)
    is_same = np.abs(difference).max(axis=1) < 1e-3 * (1e-3 + expected["out_light"].max(axis=1))
    assert is_same.mean() > 0.75
    by_voxel, squared = voxel_sums.VoxelSums(grid), voxel_sums.VoxelSums(grid)
    places, *lights = (
        media.vectors(values) for values in (expected["out_position"], found["out_light"], expected["out_light"])
    )
    by_voxel.add(places, given["segments"], *lights, 0)
    squared.add(places, given["segments"], *[media.vectors(difference**2)] * 2, 0)
    sums, (squares, _) = (np.split(of.of_systems()[0].numpy()[..., :6], 2, axis=-1) for of in (by_voxel, squared))
    is_used = sums[1].sum(axis=-1) > 0.0
    assert is_used.sum() > 50
    off = (sums[0] - sums[1])[is_used] / np.sqrt(squares[is_used] + (1e-4 * sums[1][is_used]) ** 2)
    assert np.sqrt((off**2).mean()) < 1.3  # in standard deviations of the paths that part
    np.testing.assert_array_less(np.abs(difference.sum(axis=0)), 4.0 * np.sqrt((difference**2).sum(axis=0)))
    # In parts, as a viewport follows them: the same bits.
    np.testing.assert_array_equal(prepared.run(700, first=1000)["out_light"], found["out_light"][1000:1700])


def test_light_of_one_event_is_the_same_to_rounding(rng):
    """The light of one scattering event is the same to rounding, on black hair that leaves almost no light for more
    events.
    """
    grid, light = lit_scene(rng, (1e4, 1e4, 1e4))
    light = surroundings(lamps=light.lamps)
    given, count, _mesh = paths_of(grid, light, 1000)
    expected = run_in_warp(gather._gather, count, given, GATHERED)["out_light"]
    found = kernel_programs.prepare(gather._gather, given).run(count)["out_light"]
    assert expected.mean() > 0.001
    off = np.abs(found - expected).max(axis=1) / np.maximum(expected.max(axis=1), expected.mean())
    assert (off < 1e-3).mean() > 0.97


def test_places_in_sight_are_those_of_the_processor(rng):
    grid, light = lit_scene(rng, (0.1, 0.3, 1.0))
    given, _count, _mesh = paths_of(grid, light, 2000)
    segments = np.flatnonzero(np.diff(grid.strands.numpy()) == 0).astype(np.int32)
    keys = wp.array(rng.integers(-(2**31), 2**31, len(segments)).astype(np.int32), dtype=int)
    given = {
        "medium": given["medium"],
        "view": given["seen_in"],
        "segments": wp.array(segments),
        "keys": keys,
        "first": 0,
    }
    expected = run_in_warp(start_places._see, len(segments), given, {"out_is_seen": int})["out_is_seen"]
    found = kernel_programs.prepare(start_places._see, given, light.corners.reshape(-1, 3, 3)).run(len(segments))
    assert 100 < expected.sum() < len(segments) - 100
    assert (found["out_is_seen"] != expected).sum() <= 2
