# SPDX-License-Identifier: GPL-3.0-or-later
"""Light among strands satisfies the laws of closed and of simple scenes, and agrees with a separate random walk."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp

from hair_addon.core.errors import HairError
from hair_addon.core.imaging import lamps
from hair_addon.core.kernels import parallel
from hair_addon.core.shading.fibre import energy_conserving
from hair_addon.core.shading.light_paths import gather, media, seen_rays, strand_grid, view, voxel_means
from hair_addon.core.shading.tables import lookup_tables
from tests.core.shading.tables.test_light_in_fur import walked

_NUMBERS = [(name, "f4") for name in ("radius", "cos_cone", "blend")]
_VECTORS = [(name, "f4", 4) for name in ("position", "axis", "power")]
_PATTERN = [("pattern", "f4", (4, 4)), ("pattern_layer", "i4")]
LAMP = np.dtype([("kind", "i4"), *_VECTORS, *_NUMBERS, ("casts_shadow", "i4"), *_PATTERN])
NO_LAMPS = np.zeros(0, LAMP)
WHITE, BLACK = (0.0, 0.0, 0.0), (1e4, 1e4, 1e4)


def level_view(middle, along, up, size, depth):
    """Return a `View` without perspective: size (2,) [m] around a middle on its near plane, depth [m] along a
    direction.
    """
    axes = np.stack([np.cross(along, up), up, along])
    scaled = axes / (0.5 * np.array([*size, depth]))[:, None]
    to_clip = np.eye(4)
    to_clip[:3, :3] = scaled
    to_clip[:3, 3] = -scaled @ np.array(middle) - [0.0, 0.0, 1.0]
    return view.View(to_clip)


ALONG_Y = level_view((0.0, -4.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (2.0, 2.0), 8.0)


def grid_of(points, sigma_a, radius=0.004, settings=None, radial=None, **details):
    count, settings = len(points), settings or lookup_tables.Settings(mode="energy")
    strands = strand_grid.Strands(
        points.astype(np.float32),
        np.broadcast_to(np.float32(radius), points.shape[:2]),
        lambda _chosen: np.broadcast_to(sigma_a, (1, 2, 3)),
        np.zeros(points.shape[1]),
        np.full(count, settings.roughness),
        np.zeros(count, int),
        radial=radial,
    )
    return strand_grid.build([strands], [settings], **details)


def strands_in_a_box(rng, count=1500):
    along = rng.normal(size=(count, 3))
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    middles = rng.uniform(-0.5, 0.5, (count, 3))
    return middles[:, None] + np.linspace(-0.3, 0.3, 4)[:, None] * along[:, None]


def surroundings(corners=(), albedo=(), lamps=NO_LAMPS, world=0.0, normal=(0.0, 0.0, 1.0)):
    corners = np.array(corners, float).reshape(-1, 3)
    albedo = np.array(albedo, float).reshape(-1, 3)
    normals = np.tile(normal, (len(corners), 1))
    return media.Surroundings(corners, normals, albedo, lamps, np.ones(len(lamps)), np.full((1, 1, 3), world))


def sun(axis, power=3.0):
    lamp = np.zeros(1, LAMP)
    lamp["kind"], lamp["axis"][0, :3], lamp["power"][0, :3], lamp["casts_shadow"] = lamps.SUN, axis, power, 1
    return lamp


def gathered(*args, **details):
    """Return (systems, Z, Y, X, 12) sums and the number of paths."""
    sums = gather.gather(*args, **details)
    return np.stack([of_hair.numpy() for of_hair in sums.of_systems()]), int(sums.taken)


def by_voxel(sums):
    """Return (Z, Y, X, N) numbers as `voxel_means` takes them."""
    return wp.array(sums, dtype=wp.float64, device="cpu")


def found_by(grid, light, seen_in, path_count, seed=0):
    """Return what paths find on hair in a view."""
    seen = seen_rays.seen_by(grid, light.corners, seen_in, path_count, seed)
    return gathered(grid, light, seen, len(seen.segments), seed)[0]


def ratio(sums):
    return sums[..., :3].sum(axis=(0, 1, 2, 3)) / sums[..., 3:6].sum(axis=(0, 1, 2, 3))


FLOOR = [(-3, -3, -0.6), (3, -3, -0.6), (0, 5, -0.6)]


def test_white_hair_on_a_white_floor_is_lost_in_a_white_world(rng):
    grid = grid_of(strands_in_a_box(rng), WHITE, voxel_count=2_500)
    found = found_by(grid, surroundings(FLOOR, [(1.0, 1.0, 1.0)], world=0.7), ALONG_Y, 10_000)
    np.testing.assert_allclose(ratio(found), 0.7, rtol=1e-3)


def test_paths_count_for_the_voxels_of_axes_where_their_light_is_looked_up():
    """Paths start on both sides of a border of voxels, on the surface of a wide strand, and count on its axis."""
    axis = np.array([[[-0.5, 0.02, 0.02], [0.5, 0.02, 0.02]]])
    grid = grid_of(axis, BLACK, radius=0.1)
    (found,) = found_by(grid, surroundings(world=0.7), ALONG_Y, 10_000)
    z, y, _x = np.nonzero(found[..., 3])
    _x, row, layer = np.floor((axis[0, 0] - grid.corner) / grid.voxel)
    assert len(y) and (y == row).all() and (z == layer).all()


def test_paths_are_the_same_again(rng):
    grid = grid_of(strands_in_a_box(rng, 300), (0.1, 0.3, 1.0), voxel_count=625)
    light = surroundings(lamps=sun((0.0, 1.0, 0.0)), world=0.2)
    first, again = (found_by(grid, light, ALONG_Y, 20_000) for _ in range(2))
    np.testing.assert_array_equal(first, again)


def test_strands_scatter_by_their_own_radial_roughness(rng):
    """Strands with a radial roughness of their own find, bit for bit, the light of settings with this roughness."""
    points, light = strands_in_a_box(rng, 300), surroundings(lamps=sun((0.0, 1.0, 0.0)), world=0.2)
    settings = lookup_tables.Settings(mode="energy", radial_roughness=0.8)
    grids = [
        grid_of(points, (0.1, 0.3, 1.0), settings=settings, voxel_count=625),
        grid_of(points, (0.1, 0.3, 1.0), radial=np.full(300, 0.8), voxel_count=625),
        grid_of(points, (0.1, 0.3, 1.0), voxel_count=625),
    ]
    wanted, own, other = (found_by(grid, light, ALONG_Y, 5_000) for grid in grids)
    np.testing.assert_array_equal(own, wanted)
    assert not np.array_equal(other, wanted)


def test_what_ends_at_a_pause_leaves_sums_as_they_are(rng):
    """A view that is stopped at any pause adds neither light nor paths to the sums."""
    grid = grid_of(strands_in_a_box(rng, 300), (0.1, 0.2, 0.3), device="cpu")
    light = surroundings(world=1.0)
    other_view = level_view((-4.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (2.0, 2.0), 8.0)
    here, there = (seen_rays.seen_by(grid, np.zeros((0, 3)), seen_in, 900) for seen_in in (ALONG_Y, other_view))
    found = []
    for stops in (False, True):
        sums = gather.PathSums(grid, light)
        sums.see(here)
        works = (2, lambda sums=sums: sums.see(there, 0.5)), (12, lambda sums=sums: sums.follow(500, 1))
        for most, work in works if stops else ():
            for number in range(most):
                left = iter(range(number))

                def pause(left=left):
                    if next(left, None) is None:
                        raise InterruptedError

                with pytest.raises(InterruptedError), parallel.on_one_core(pause):
                    work()
        sums.follow(500, 2)
        found.append((sums.taken, sums.texels()))
    assert found[0][0] == found[1][0] > 0
    np.testing.assert_array_equal(found[0][1], found[1][1])


def test_faint_light_counts_as_much_in_the_mean(rng):
    """Faint light counts as much in the mean: where drawn light is thirty times as bright as the paths', nearly all
    is the paths'.
    """
    grid = grid_of(strands_in_a_box(rng, 300), (0.1, 0.3, 1.0), voxel_count=625)
    light = surroundings(lamps=np.concatenate([sun((0.0, 1.0, 0.0)), sun((0.6, 0.8, 0.0), 1.0), sun((0.0, 0.6, -0.8))]))
    seen = seen_rays.seen_by(grid, light.corners, ALONG_Y, 20_000)
    exact = gathered(grid, light, replace(seen, drawn=wp.zeros_like(seen.drawn)), 60_000)[0]
    for factor, tolerance in ((1.0, 0.025), (30.0, 0.06)):
        drawn = wp.full_like(seen.drawn, factor * ratio(exact).mean())
        found = gathered(grid, light, replace(seen, drawn=drawn), 60_000, seed=1)[0]
        np.testing.assert_allclose(ratio(found), ratio(exact), rtol=tolerance)


def test_light_of_voxels_and_what_they_keep_of_the_drawn_is_that_of_paths(rng):
    """In every voxel and channel the light is that of paths; drawn light is kept as far as it resembles it."""
    grid = grid_of(strands_in_a_box(rng, 300), (0.1, 0.3, 1.0), voxel_count=625)
    light = surroundings(lamps=sun((0.0, 1.0, 0.0)), world=0.2)
    seen = seen_rays.seen_by(grid, light.corners, ALONG_Y, 20_000)
    (alone,) = gathered(grid, light, seen, 20_000)[0]
    lights, even = alone[..., :3], alone[..., 3:6]
    for drawn, low, high in (
        (0.0 * lights, 0.0, 1.0),
        (0.5 * lights, 1.0, 1.0),
        (2.0 * lights, 0.5, 0.5),
        (lights + even, 0.5, 1.0),
        (even, 0.0, 1e-6),
        (even * rng.random(even.shape), 0.0, 0.1),
    ):
        sums = np.concatenate([lights, even, drawn, even], axis=-1)
        found = voxel_means.shares(by_voxel(sums), 10**9)
        there = found[..., :3] * sums[..., 3:6] + found[..., 3:] * sums[..., 6:9]
        np.testing.assert_allclose(there, sums[..., :3], atol=1e-3 * sums.max())
        kept = found[..., 3][sums[..., 3] > 0.0]
        assert kept.min() >= 0.0 and kept.max() <= 1.0
        assert low - 1e-6 <= voxel_means.explained_part(by_voxel(sums)) <= high + 1e-6


def test_the_nearest_strand_is_met(rng):
    """A ray among bent strands hits the nearest one, by comparison with all segments without a grid."""
    points = strands_in_a_box(rng, 60)
    points += 0.03 * rng.normal(size=points.shape)
    grid = grid_of(points, BLACK, 0.02, voxel_count=375)
    segments, places = seen_rays.hits_of(grid, np.zeros((0, 3)), ALONG_Y, 900)
    start = points[:, :-1].reshape(-1, 3)
    along = np.diff(points, axis=1).reshape(-1, 3)
    x, z = (np.stack([places[:, axis] for axis in (0, 2)], axis=0))[:, :, None]
    # A ray along y is nearest to the axis where its place in the x-z plane is, and enters the cylinder before that.
    flat = along[:, [0, 2]]
    squared, lengths = (flat**2).sum(axis=1), (along**2).sum(axis=1)
    part = ((x - start[:, 0]) * flat[:, 0] + (z - start[:, 2]) * flat[:, 1]) / squared
    beside = ((x - start[:, 0]) * flat[:, 1] - (z - start[:, 2]) * flat[:, 0]) / np.sqrt(squared)
    is_near = np.abs(beside) < 0.0199  # but for rounding
    back = np.sqrt(np.maximum(0.02**2 - beside**2, 0.0) * lengths / squared)
    y = start[:, 1] + part * along[:, 1] - back
    part = part - back * along[:, 1] / lengths
    y = np.where(is_near & (part > 0.001) & (part < 0.999), y, np.inf)
    # Fillings of bends are nearer in rare cases.
    assert (places[:, 1] < y.min(axis=1) + 1e-4).all()
    is_segment = places[:, 1] > y.min(axis=1) - 1e-4
    assert is_segment.mean() > 0.9
    expected = start[y.argmin(axis=1)[is_segment]]
    np.testing.assert_allclose(grid.points.numpy()[segments[is_segment]], expected, atol=1e-5)


@pytest.mark.parametrize(
    ("axis", "least", "most"), [((0, 1, 0), 0.99, 1.01), ((-1, 0, 0), 0.5, 1.01), ((0, -1, 0), 0.0, 0.05)]
)
def test_a_strand_within_another_is_shaded_on_the_far_side(rng, axis, least, most):
    """Of two round strands nearly in one place, light from the viewer's side hits the first and light from behind
    the second.
    """
    alone = np.stack([np.zeros(3), np.zeros(3), np.linspace(-1.0, 1.0, 3)], axis=-1)[None]
    # Near enough that strands before them are not in view.
    seen_in = level_view((0.0, -0.03, 0.5), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.018, 0.018), 8.0)
    far, near = np.array([0.0, 0.0, 5.0]), np.array([0.0, 0.0005, 0.0])  # radii are 0.01
    before = -0.05 * np.array(axis, float)
    one, both, shaded = (
        ratio(
            found_by(
                grid_of(np.concatenate([alone, alone + other]), BLACK, 0.01, voxel_count=125),
                surroundings(lamps=sun(axis)),
                seen_in,
                40_000,
            )
        )[0]
        for other in (far, near, before)
    )
    assert least * one <= both <= most * one
    assert shaded < 0.05 * one


def test_paths_start_as_often_as_rays_meet_strands(rng):
    """Paths start as often as rays hit strands: thin short strands beside thick long ones get their share."""
    thin, thick = strands_in_a_box(rng, 4_000), strands_in_a_box(rng, 60)
    thin = thin.mean(axis=1, keepdims=True) + 0.05 * (thin - thin.mean(axis=1, keepdims=True))
    points = np.concatenate([thin, thick])
    points[: len(thin), :, 0] -= 0.6
    points[len(thin) :, :, 0] += 0.6
    radii = np.repeat([0.002, 0.02], [len(thin), len(thick)])
    grid = grid_of(points, WHITE, radii[:, None], voxel_count=2_500)
    _segments, places = seen_rays.hits_of(grid, np.zeros((0, 3)), ALONG_Y, 200_000)
    expected = (places[:, 0] < 0.0).mean()
    found = found_by(grid, surroundings(world=1.0), ALONG_Y, 3_000, seed=3)
    even = found[0, ..., 3].sum(axis=(0, 1))  # one a path
    middles = grid.corner[0] + grid.voxel * (np.arange(len(even)) + 0.5)
    assert even[middles < 0.0].sum() / even.sum() == pytest.approx(expected, abs=0.03)


def test_strands_next_to_the_camera_leave_paths_for_others(rng):
    """Strands next to the camera leave paths to others, as most of them is beside the picture or before the near
    plane.
    """
    points = strands_in_a_box(rng, 3_000)
    points[:20] -= points[:20].mean(axis=1, keepdims=True)
    points[:20] += rng.uniform(-0.05, 0.05, (20, 1, 3))
    grid = grid_of(points, WHITE, 0.002, voxel_count=2_500)
    to_clip = np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 0], [0, 1.00002, 0, -0.0200002], [0, 1.0, 0, 0]])
    seen = seen_rays.seen_by(grid, np.zeros((0, 3)), view.View(to_clip), 40_000)
    assert (seen.places.numpy()[:, 1] > 0.0099).all()
    sums, taken = gathered(grid, surroundings(world=1.0), seen, 10_000)
    assert 2_500 < taken < 11_000
    np.testing.assert_allclose(ratio(sums), 1.0, rtol=1e-3)


def test_bent_strands_have_no_gaps():
    """Bent strands have no gaps: as much of a thick ring across the rays is hit as its area says."""
    turn = np.linspace(0.0, 1.9 * np.pi, 12)
    points = np.stack([0.5 * np.cos(turn), 0.0 * turn, 0.5 * np.sin(turn)], axis=-1)[None]
    grid = grid_of(points, BLACK, 0.2, voxel_count=250)
    _segments, position = seen_rays.hits_of(grid, np.zeros((0, 3)), ALONG_Y, 40_000)
    around, out = np.arctan2(position[:, 2], position[:, 0]) % (2.0 * np.pi), np.hypot(position[:, 0], position[:, 2])
    outer = (out > 0.6) & (out < 0.66) & (around < turn[-1])
    counts = np.histogram(around[outer], bins=19, range=(0.0, turn[-1]))[0]
    assert counts.min() > 0.7 * counts.mean()


def test_thinned_strands_stop_as_much_light(rng):
    points = strands_in_a_box(rng, 3000)
    full, thin = grid_of(points, BLACK, 0.001), grid_of(points, BLACK, 0.001, segment_count=2_000)
    assert len(thin.points) < 0.5 * len(full.points)
    seen = [len(seen_rays.seen_by(grid, np.zeros((0, 3)), ALONG_Y, 40_000).segments) for grid in (full, thin)]
    assert seen[1] == pytest.approx(seen[0], rel=0.05)


def test_samples_show_the_segments_and_places_that_are_drawn(rng):
    """The picture of numbers shows segments of two systems, the second thinned out, and pixels without hair."""
    points = strands_in_a_box(rng, 30)
    grid = grid_of(points, BLACK, 0.002)
    height, width, of_strand = 20, 30, 3
    picture = rng.integers(0, 7 + 90 + 20, (height, width)).astype(np.uint32)
    picture[0, :5] = 2**31 + 8  # of surfaces
    color = rng.random((height, width, 4)).astype(np.float32)
    found = seen_rays.shown_in(grid, ALONG_Y, picture, color, [(7, 90, of_strand)])
    row, column = np.nonzero((picture >= 7) & (picture < 97))
    strand, along = np.divmod(picture[row, column].astype(int) - 7, of_strand)
    np.testing.assert_array_equal(found.segments.numpy(), 4 * strand + along)
    np.testing.assert_array_equal(found.drawn.numpy(), color[row, column, :3])
    assert found.area == pytest.approx(4.0 / picture.size)
    start, end = points[strand, along], points[strand, along + 1]
    places = found.places.numpy()
    part = ((places - start) * (end - start)).sum(axis=1) / ((end - start) ** 2).sum(axis=1)
    np.testing.assert_allclose(places, start + np.clip(part, 0.0, 1.0)[:, None] * (end - start), atol=1e-5)
    # Beside the ray through the sample's center as little as any place of the segment.
    at = np.stack([(2 * column + 1) / width - 1.0, (2 * row + 1) / height - 1.0], axis=-1)
    flat, axes = end[:, [0, 2]] - start[:, [0, 2]], [0, 2]
    nearest = np.clip(((at - start[:, axes]) * flat).sum(axis=1) / (flat**2).sum(axis=1), 0.0, 1.0)
    np.testing.assert_allclose(part, nearest, atol=1e-3)
    with pytest.raises(HairError, match="out of range"):
        seen_rays.shown_in(grid, ALONG_Y, picture, color, [(7, 93, of_strand)])


def test_samples_show_segments_of_thinned_strands(rng):
    """Every second strand of 16 segments remains, with 8 segments."""
    points = np.concatenate([strands_in_a_box(rng, 40)] * 5, axis=1)[:, :17]
    thin = grid_of(points, BLACK, 0.001, segment_count=160)
    (system,) = thin.thinned
    assert (system.stride, system.point_count) == (2, 9)
    picture = np.arange(640, dtype=np.uint32).reshape(20, 32)
    found = seen_rays.shown_in(thin, ALONG_Y, picture, np.zeros((20, 32, 4), np.float32), [(0, 640, 16)])
    strand, along = np.divmod(np.arange(640), 16)
    np.testing.assert_array_equal(found.segments.numpy(), strand // 2 * 9 + along // 2)


@pytest.mark.parametrize("height", [0.5, 2.0])
def test_a_sheet_of_strands_lets_as_much_through_as_poisson_says(height):
    """A sheet of strands transmits exp(-n) of a bright world, with n the mean number of strands that a ray crosses."""
    rng = np.random.default_rng(5)
    radius, count = 0.004, 1500
    x, z = rng.uniform(-1.2, 1.2, count), np.linspace(-1.5, 1.5, 2)
    y = rng.uniform(0.0, height, count)
    points = np.stack(np.broadcast_arrays(x[:, None], y[:, None], z[None]), axis=-1)
    grid = grid_of(points, WHITE, radius, voxel_count=6_250)
    seen = seen_rays.seen_by(grid, np.zeros((0, 3)), ALONG_Y, 40_000)
    assert len(seen.segments) / 40_000 == pytest.approx(1.0 - np.exp(-2.0 * radius * count / 2.4), abs=0.015)
    dark = found_by(grid_of(points, BLACK, radius, voxel_count=6_250), surroundings(world=1.0), ALONG_Y, 40_000)
    assert (ratio(dark) < 1.0).all()


@pytest.mark.long
def test_more_paths_are_taken_where_few_find_light(rng):
    """More paths are taken where few find light, as for a sun behind deep hair; in an even world none is added."""
    grid = grid_of(strands_in_a_box(rng, 1500), (0.1, 0.3, 1.0), voxel_count=2_500)
    behind, even = surroundings(lamps=sun((0.0, -1.0, 0.0))), surroundings(world=1.0)
    seen = seen_rays.seen_by(grid, behind.corners, ALONG_Y, 400)
    count = len(seen.segments)
    _bright, taken = gathered(grid, even, seen, count, most_paths=64 * count)
    assert taken < 64 * count
    few, many = (
        [gathered(grid, behind, seen, count, seed, most_paths=most) for seed in range(8)] for most in (0, 64 * count)
    )
    for (_few, one), (_many, all_of_them) in zip(few, many, strict=True):
        assert one == pytest.approx(count, rel=0.25) and all_of_them == pytest.approx(64 * count, rel=0.1)
    spread = [np.std([ratio(sums)[0] for sums, _taken in found]) for found in (few, many)]
    assert spread[1] < 0.3 * spread[0]


def test_no_path_starts_on_hidden_hair(rng):
    """Samples of hair that a wall hides start no path, and cause no error."""
    grid = grid_of(strands_in_a_box(rng, 200), WHITE, voxel_count=500)
    seen = seen_rays.seen_by(grid, surroundings().corners, ALONG_Y, 400)
    wall = surroundings([(-9, -2, -9), (9, -2, -9), (0, -2, 19)], [(0.5, 0.5, 0.5)], world=1.0)
    sums, taken = gathered(grid, wall, seen, len(seen.segments), most_paths=8 * len(seen.segments))
    assert taken == 0 and not sums[..., :6].any() and sums[..., 9:].any()


def test_as_many_more_paths_are_taken_as_are_wanted(rng, monkeypatch):
    """For an error a tenth above the target, a fifth more paths reach it: their number is not doubled."""
    grid = grid_of(strands_in_a_box(rng, 1500), (0.1, 0.3, 1.0), voxel_count=2_500)
    behind = surroundings(lamps=sun((0.0, -1.0, 0.0)))
    seen = seen_rays.seen_by(grid, behind.corners, ALONG_Y, 3000)
    errors, standard_error = [], gather._standard_error
    monkeypatch.setattr(gather, "_standard_error", lambda *of: errors.append(standard_error(*of)) or errors[-1])
    count = len(seen.segments)
    _sums, few = gathered(grid, behind, seen, count)
    monkeypatch.setattr(gather, "_KNOWN", errors[0] / 1.1)
    _sums, more = gathered(grid, behind, seen, count, most_paths=64 * count)
    assert 1.1 * few < more < 1.7 * few
    assert errors[-1] < errors[0] / 1.1


def test_paths_are_added_until_each_voxel_is_known(rng):
    """The light of visible voxels differs between two sets of paths by about the noise that was asked for, which needs
    more paths than the mean light.
    """
    grid = grid_of(strands_in_a_box(rng, 1500), (0.1, 0.3, 1.0), voxel_count=200)
    light = surroundings(lamps=sun((0.0, 1.0, 0.0)), world=0.2)
    seen = seen_rays.seen_by(grid, light.corners, ALONG_Y, 1000)
    count, noise, ratios = len(seen.segments) // 4, 0.1, []
    for seed in range(2):
        sums, taken = gathered(grid, light, seen, count, seed, most_paths=512 * count, noise=noise)
        assert 2 * count < taken < 500 * count
        ratios.append(sums[..., :3].sum(axis=-1) / np.maximum(sums[..., 3:6].sum(axis=-1), 1e-12))
    weights = sums[..., 3:6].sum(axis=-1)
    difference = np.sqrt(0.5 * np.average(np.square(ratios[0] - ratios[1]), weights=weights))
    assert difference < 1.3 * noise * np.average(ratios[0], weights=weights)


def lit_from_below(grid, light, path_count):
    """Return the `ratio` of light that does not come straight from a lamp."""
    seen = seen_rays.seen_by(grid, light.corners, ALONG_Y, path_count)
    found, _count = gathered(grid, light, seen, path_count)
    straight, _count = gathered(grid, replace(light, albedo=0.0 * light.albedo), seen, path_count)
    return (found - straight)[..., :3].sum(axis=(0, 1, 2, 3)) / found[..., 3:6].sum(axis=(0, 1, 2, 3))


def test_light_off_a_floor_is_that_of_its_albedo(rng):
    """Light off a floor is proportional to its albedo, for strands over a wide floor under a sun, in a black world."""
    points = strands_in_a_box(rng, 3)
    grid = grid_of(points, BLACK, 0.002, voxel_count=625)
    down = sun((0.0, 0.0, -1.0))
    dark, bright = (lit_from_below(grid, surroundings(FLOOR, [(each,) * 3], down), 100_000) for each in (0.4, 0.8))
    np.testing.assert_allclose(bright / dark, 2.0, rtol=0.05)


def test_a_surface_is_lit_as_its_normals_say(rng):
    """A surface is lit by its normals: a floor under a level sun with normals of a 60° slope reflects half the
    light.
    """
    grid = grid_of(strands_in_a_box(rng, 300), WHITE, 0.002, voxel_count=625)
    down = sun((0.0, 0.0, -1.0))
    slope = (np.sin(np.radians(60.0)), 0.0, np.cos(np.radians(60.0)))
    flat, sloping = (
        lit_from_below(grid, surroundings(FLOOR, [(0.8,) * 3], down, normal=normal), 25_000)
        for normal in (np.zeros(3), slope)
    )
    assert (sloping < 0.7 * flat).all() and (sloping > 0.1 * flat).all()


@pytest.mark.long
def test_white_fur_sends_back_what_a_random_walk_finds(rng):
    """White fur on a black floor, 5 strands deep for level light, reflects what a random walk finds."""
    settings = lookup_tables.Settings(
        mode="energy", sigma_a=(0.005,) * 3, roughness=0.2, radial_roughness=0.3, tilt=np.radians(2.0)
    )
    view_angle, light = np.radians(41.0), np.radians(23.0)
    expected = walked(rng, settings, view_angle, light, depth=5.0, count=8_000, blur=0.0025)
    x, y = rng.uniform(-4.0, 4.0, (2, 80_000))
    points = np.stack(np.broadcast_arrays(x[:, None], y[:, None], np.linspace(0.0, 1.0, 3)), axis=-1)
    grid = grid_of(points, settings.sigma_a, radius=0.002, settings=settings, voxel_count=25_000)
    lamp = sun((np.cos(light), 0.0, -np.sin(light)), 1.0)
    lamp["radius"] = 2.0 * np.sqrt(0.0025)  # a disk's variance along an axis is a quarter of its radius²
    towards = np.array([-np.cos(view_angle), 0.0, np.sin(view_angle)])
    middle = np.array([0.125, 0.0, 1.0]) + 4.0 * towards
    up = np.array([np.sin(view_angle), 0.0, np.cos(view_angle)])
    seen_in = level_view(middle, -towards, up, (0.5, 0.25 * np.sin(view_angle)), 8.0)
    floor = np.array([(-19, -19, -0.001), (19, -19, -0.001), (0, 38, -0.001)])
    found = found_by(grid, surroundings(floor, [(0.0, 0.0, 0.0)], lamp), seen_in, 120_000)
    seen = found[..., 3:6].sum() / 3.0 / mean_even(settings, view_angle)
    assert found[..., 0].sum() / seen == pytest.approx(expected, rel=0.15)  # both are noisy so far off the cone


def mean_even(settings, view):
    """Return the part of uniform light that a fiber reflects."""
    return (
        2.0
        * np.pi
        * energy_conserving.n_lobes(np.pi * (np.arange(360) + 0.5) / 360, np.cos(view), settings)[..., 0]
        .sum(axis=-1)
        .mean()
    )


def test_hair_without_size_is_refused():
    with pytest.raises(HairError, match="length and a width"):
        grid_of(np.zeros((2, 3, 3)), WHITE)


def test_voxels_without_paths_take_the_ratio_around_them(rng):
    sums = np.zeros((4, 4, 4, 6))
    filled = rng.random((4, 4, 4)) < 0.3
    sums[filled] = np.array([2.0, 4.0, 6.0, 1.0, 1.0, 1.0]) * rng.uniform(1, 50, filled.sum())[:, None]
    np.testing.assert_allclose(
        voxel_means.smooth_ratios(by_voxel(sums), 1000), np.tile([2.0, 4.0, 6.0], (4, 4, 4, 1)), rtol=1e-9
    )


def test_drawn_light_keeps_edges_that_noisy_paths_do_not_find(rng):
    """At a common edge of drawn light and traced light, few paths give the brightness of both sides."""
    even = np.ones((8, 8, 8, 3))
    drawn = np.where(np.arange(8) < 3, 0.2, 1.0)[:, None] * even
    expected = 0.6 * drawn + 0.3 * even
    light = expected * rng.exponential(size=(8, 8, 8, 1))
    found = voxel_means.shares(by_voxel(np.concatenate([light, even, drawn, even], axis=-1)), 8**3)
    there = found[..., :3] + found[..., 3:] * drawn
    np.testing.assert_allclose(there.mean(axis=(0, 1)), expected.mean(axis=(0, 1)), rtol=0.15)
    assert there.std(axis=(0, 1)).max() < 0.05


def test_light_does_not_leak_past_the_edge_of_a_shadow(rng):
    """Light of 32 noisy paths per voxel falls below 5 % within four voxels of an edge, with a third of their noise."""
    side, paths, relative_variance = 16, 32, 25.0
    is_lit = np.broadcast_to((np.arange(side) >= 7)[:, None], (side, side, side, 1))
    even = np.ones((side, side, side, 3))
    light = even * is_lit * rng.gamma(paths / relative_variance, relative_variance / paths, is_lit.shape)
    found = voxel_means.smooth_ratios(by_voxel(np.concatenate([light, even], axis=-1)), paths * side**3)
    assert found[:, :, :4].mean(axis=(0, 1)).max() < 0.05
    assert found[:, :, 10:].mean(axis=(0, 1)).min() > 0.9
    assert found.mean() == pytest.approx(light.mean(), rel=0.05)
    assert np.square(found - is_lit).mean() < np.square(light - is_lit).mean() / 9.0


def test_light_of_more_paths_is_smoothed_less(rng):
    """Sharp light is known within 3 % if voxels have many paths, and has a third of the noise of the paths if they have
    few. With many paths, a tenth as much light leaks past an edge as with the weight of larger voxels for few paths.
    """
    side, variance = 16, 6.0
    expected = 1.0 + 0.7 * np.sin(np.arange(side))[:, None] * np.ones((side, side, side, 3))

    def error(paths):
        noise = rng.gamma(paths / variance, variance / paths, (side, side, side, 1))
        sums = by_voxel(np.concatenate([expected * noise, np.ones_like(expected)], axis=-1))
        found = voxel_means.smooth_ratios(sums, paths * side**3, prior=voxel_means.prior_of(paths))
        return float(np.sqrt(np.square(found - expected).mean()))

    assert error(10_000) < 0.03 and error(1_000) < 0.1
    assert error(2) < np.sqrt(variance / 2) / 3.0

    def leak(paths, **prior):
        is_lit = np.broadcast_to((np.arange(side) >= 7)[:, None], expected.shape)
        sums = by_voxel(np.concatenate([expected * is_lit, np.ones_like(expected)], axis=-1))
        return float(voxel_means.smooth_ratios(sums, paths * side**3, **prior)[:, :, :7].max())

    assert leak(1_000, prior=voxel_means.prior_of(1_000)) < 0.1 * leak(1_000)


def test_hair_has_the_same_light_in_a_grid_of_more_hair(rng):
    """Voxels around a hair's own, which other hair needs, do not change what its own have."""
    sums = rng.exponential(size=(4, 6, 5, 12))
    beside = [(3, 2), (0, 7), (4, 1)]
    origin = (5, -2, 9)
    wide = np.pad(sums, [*beside, (0, 0)])
    around = tuple(first - before for first, (before, _after) in zip(origin, beside[::-1], strict=True))
    found = voxel_means.shares(by_voxel(wide), 1000, around)
    assert found.shape[:3] == wide.shape[:3]
    np.testing.assert_array_equal(found[3:7, :6, 4:9], voxel_means.shares(by_voxel(sums), 1000, origin))
    assert np.isfinite(found).all()
    assert not voxel_means.shares(by_voxel(np.zeros((2, 2, 2, 12))), 10)[..., :3].any()
