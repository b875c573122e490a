# SPDX-License-Identifier: GPL-3.0-or-later
"""The strand that each sample shows equals analytic positions, and is the same by triangles and by compute programs."""

import gpu
import numpy as np
import pytest

from hair_addon.blender.gpu import drawing, hair_shading, strand_textures, surface_textures, visibility_buffer, windows
from hair_addon.blender.gpu.programs import scene_programs, uniforms
from hair_addon.core.shading.fibre import kajiya_kay

SIZE = (160, 96)
HALF_WIDTH = 0.2 * SIZE[0] / SIZE[1]  # of what a camera at distance one sees [m]

ALL = drawing.Steps()

PERSPECTIVE = np.array([[1 / HALF_WIDTH, 0, 0, 0], [0, 5.0, 0, 0], [0, 0, -1.02, -0.101], [0, 0, -1, 0]])
PARALLEL = np.array([[1 / HALF_WIDTH, 0, 0, 0], [0, 5.0, 0, 0], [0, 0, -0.2, -1.0], [0, 0, 0, 1]])


@pytest.fixture(scope="module")
def shading():
    return hair_shading.kajiya_kay_shading(kajiya_kay.Settings())


def filled(placed, view_to_clip, shading, in_compute, hiding_at=None, steps=ALL, clip_planes=None, is_counted=False):
    """Return the buffer of [(points, radii, object to world)] seen along -Z from the origin.

    hiding_at: distance of a surface that fills the left half of the view.
    """
    buffer = visibility_buffer.VisibilityBuffer(*SIZE)
    view = drawing.pass_record(np.eye(4), view_to_clip, SIZE)
    lights = uniforms.LIGHTS.record()
    none = {name: gpu.types.GPUTexture((1, 1), layers=2, format="R32F") for name in scene_programs.SHADOW_SAMPLERS}
    none |= {name: gpu.types.GPUTexture((1, 1), format="RGBA16F") for name in scene_programs.VISIBILITY_SAMPLERS}
    with buffer.surfaces(), drawing.gpu_state("LESS_EQUAL", depth_writes=True):
        if hiding_at is not None:
            corners = np.array([[-9, -9, -hiding_at], [0, -9, -hiding_at], [0, 9, -hiding_at]] * 2, np.float32)
            corners[3:, :2] = [[-9, -9], [0, 9], [-9, 9]]
            surface = surface_textures.upload_surface(corners, np.arange(6, dtype=np.int32))
            light_block = uniforms.uniform_buffer(lights)
            surface_textures.draw_depth(surface, view, light_block, "surfaces/occluding_surface.frag", clip_planes)
    hair = [
        (strand_textures.upload_strands(points, radii), shading, to_world, none, steps)
        for points, radii, to_world in placed
    ]
    buffer.add_hair(hair, lights, view, in_compute, clip_planes, is_counted)
    return buffer


def drawn(placed, view_to_clip, shading, in_compute, hiding_at=None, steps=ALL, clip_planes=None):
    """Return (segment, depth), each (height, width), of `filled`; a segment is negative where there is none."""
    buffer = filled(placed, view_to_clip, shading, in_compute, hiding_at, steps, clip_planes)
    counts = [len(points) * ((steps.point_count or points.shape[1]) - 1) for points, _radii, _place in placed]
    segments = np.array(buffer.segments.read(), np.int64).reshape(SIZE[::-1])
    depths = np.array(buffer.depths.read()).astype(np.uint32).reshape(SIZE[::-1]).view(np.float32)
    covered = np.array(buffer.color.read(), np.float32).reshape(*SIZE[::-1], 4)[..., 3] == 1.0
    np.testing.assert_array_equal(covered, segments != visibility_buffer.NO_SEGMENT)  # what is found is shaded
    for y, x in np.argwhere(covered)[::97]:
        assert buffer.hair_at(int(x), int(y)) == np.searchsorted(np.cumsum(counts), segments[y, x], side="right")
    assert covered.all() or buffer.hair_at(*map(int, np.argwhere(~covered)[0][::-1])) is None
    owners = np.where(covered, np.searchsorted(np.cumsum(counts), segments, side="right"), -1)
    for x, y in np.random.default_rng(1).integers(0, owners.shape, (20, 2))[:, ::-1]:
        rows, columns = np.nonzero(covered)
        away = np.hypot(rows - y, columns - x)
        wanted = {owners[rows[n], columns[n]] for n in np.flatnonzero(away == away.min(initial=np.inf))}
        for reach in (0, 3, 40):
            found = buffer.hair_near(int(x), int(y), reach)
            assert found in wanted if away.min(initial=np.inf) <= reach else found is None
    return np.where(covered, segments, -1), depths


def tuft(rng, strand_count=60, point_count=33, thickness=0.004):
    """Return arcs that cross the whole view and the near plane: (S, P, 3) points, (S, P) radii."""
    start = rng.uniform([-0.3, -0.2, -1.6], [0.3, 0.2, -0.1], (strand_count, 1, 3))
    axes = rng.normal(size=(2, strand_count, 1, 3)) * [0.15, 0.1, 0.2]
    turn = np.linspace(0.0, 4.0, point_count)[None, :, None]
    points = (start + np.sin(turn) * axes[0] + np.cos(turn) * axes[1]).astype(np.float32)
    return points, np.full(points.shape[:2], thickness, np.float32)


@pytest.mark.parametrize("in_compute", [True, False])
def test_a_sample_is_covered_if_its_centre_lies_in_the_strand(shading, in_compute):
    """In a parallel view, a sample is covered if its center is nearer to a strand's axis than the radius."""
    height, width = np.indices(SIZE[::-1])
    centres = np.stack([(width + 0.5) / SIZE[0] * 2 - 1, (height + 0.5) / SIZE[1] * 2 - 1], axis=-1)
    centres *= [HALF_WIDTH, 0.2]
    for angle, radius in ((0.3, 0.011), (1.2, 0.02), (-0.6, 0.005), (0.0, 0.007), (np.pi / 2, 0.007)):
        along = np.array([np.cos(angle), np.sin(angle)])
        points = np.zeros((1, 3, 3), np.float32)
        points[0, :, :2] = np.array([-1.0, 0.1, 1.0])[:, None] * along + [0.012, 0.005]
        points[..., 2] = -2.0
        found, depths = drawn([(points, np.full((1, 3), radius, np.float32), np.eye(4))], PARALLEL, shading, in_compute)
        distance = np.abs((centres - [0.012, 0.005]) @ [-along[1], along[0]])
        sure = np.abs(distance - radius) > 1e-4
        np.testing.assert_array_equal((found >= 0)[sure], (distance < radius)[sure])
        # Of the side that faces the viewer.
        rise = np.sqrt(np.maximum(radius**2 - distance**2, 0.0))[found >= 0]
        np.testing.assert_allclose(depths[found >= 0], 0.2 - 0.5 * abs(PARALLEL[2, 2]) * rise, atol=2e-5)
        second = (centres - [0.012, 0.005]) @ along > 0.1
        away = np.abs((centres - [0.012, 0.005]) @ along - 0.1) > 0.03
        np.testing.assert_array_equal(found[(found >= 0) & away], second[(found >= 0) & away])


@pytest.mark.parametrize("in_compute", [True, False])
def test_a_wide_angle_sees_strands_as_thick_as_its_rays_do(shading, in_compute):
    """Near the corner of a wide perspective, a sample is covered if its ray is nearer to a strand's axis than the
    radius.
    """
    wide = PERSPECTIVE.copy()
    wide[0, 0], wide[1, 1] = SIZE[1] / SIZE[0], 1.0
    height, width = np.indices(SIZE[::-1])
    x, y = (2 * width + 1 - SIZE[0]) / SIZE[1], (2 * height + 1 - SIZE[1]) / SIZE[1]
    rays = np.stack([x, y, np.full(x.shape, -1.0)], axis=-1)
    places = (((1.8, 0.5), (0.0, 1.0, 0.1)), ((-0.3, -1.0), (1.0, 0.1, -0.1)), ((-1.4, 1.0), (1.0, -0.8, 0.0)))
    for middle, along in places:
        along = np.array(along) / np.linalg.norm(along)
        points = (np.array([*middle, -1.5]) + np.array([-4.0, 0.0, 4.0])[:, None] * along)[None].astype(np.float32)
        radii = np.full((1, 3), 0.08, np.float32)
        found, _depths = drawn([(points, radii, np.eye(4))], wide, shading, in_compute)
        across = np.cross(rays, along)
        distance = np.abs(across @ points[0, 1]) / np.linalg.norm(across, axis=-1)
        assert (distance < 0.08).sum() > 300
        assert (found >= 0).sum() == pytest.approx((distance < 0.08).sum(), rel=0.015)


@pytest.mark.parametrize("view_to_clip", [PERSPECTIVE, PARALLEL], ids=["perspective", "parallel"])
@pytest.mark.parametrize("steps", [ALL, drawing.Steps(17, 45, 30)], ids=["all", "some"])
@pytest.mark.parametrize("thickness", [0.004, 0.0003])
def test_triangles_and_the_computed_show_the_same_strands(rng, shading, view_to_clip, thickness, steps):
    """Triangles and compute program show the same strands, except for samples at edges and at the mitered turns of
    strips.
    """
    stretched = np.diag([1.5, 1.5, 1.5, 1.0])
    placed = [(*tuft(rng, thickness=thickness), np.eye(4)), (*tuft(rng, 50, 25, thickness / 3), stretched)]
    (triangles, depths), (computed, same) = (
        drawn(placed, view_to_clip, shading, in_compute, 0.7, steps) for in_compute in (False, True)
    )
    assert (triangles >= 0).sum() > 500
    assert (computed >= 0).sum() == pytest.approx((triangles >= 0).sum(), rel=0.03)
    both = (triangles >= 0) & (computed >= 0)
    assert both.sum() > 0.93 * (triangles >= 0).sum()
    assert (triangles == computed)[both].mean() > 0.93
    alike = both & (triangles == computed)
    assert np.median(np.abs(depths - same)[alike]) < 1e-4
    # Strands of both are there, and what is behind the surface is in neither.
    count = placed[0][0].shape[0] * ((steps.point_count or 33) - 1)
    assert (computed[both] >= count).any() and (computed[both] < count).any()


def test_counted_parts_of_samples_are_those_that_strands_cover(rng, shading):
    """Lines through samples find the area that crossing strands of all widths cover, only in front of a surface."""
    angles, offsets = rng.uniform(0.0, np.pi, 24), rng.uniform(-0.15, 0.15, 24)
    along = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    points = np.full((24, 2, 3), -2.0, np.float32)
    points[..., :2] = (offsets[:, None] * along[:, ::-1] * [-1.0, 1.0])[:, None] + along[:, None] * [[[-1.0], [1.0]]]
    sample = 0.4 / SIZE[1]
    radii = np.repeat(rng.uniform(0.1, 1.5, (24, 1)) * sample, 2, axis=1).astype(np.float32)
    side = 8
    y, x = (np.indices((SIZE[1] * side, SIZE[0] * side)) + 0.5) * sample / side - np.array([[[0.2]], [[HALF_WIDTH]]])
    distances = np.abs(along[:, 0, None, None] * y - along[:, 1, None, None] * x - offsets[:, None, None])
    wanted = (distances < radii[:, :1, None]).any(axis=0).reshape(SIZE[1], side, SIZE[0], side).mean(axis=(1, 3))
    for hiding_at in (None, 1.0):
        given = [(points, radii, np.eye(4))], PARALLEL, shading, True, hiding_at
        bits = np.array(filled(*given, is_counted=True).covered.read(), np.uint32).reshape(SIZE[::-1])
        lines = np.stack([np.bitwise_count(bits & 0xFFFF), np.bitwise_count(bits >> 16)]) / 16.0
        found = 1.0 - (1.0 - lines[0]) * (1.0 - lines[1])
        left = slice(0, SIZE[0] // 2 if hiding_at else 0)
        assert not found[:, left].any()
        right = slice(left.stop, None)
        assert found[:, right].mean() == pytest.approx(wanted[:, right].mean(), rel=0.01)
        assert np.sqrt(((found - wanted)[:, right] ** 2).mean()) < 0.05
        assert filled(*given).covered is None


def test_parts_are_counted_of_more_strands_than_are_drawn(rng, shading):
    """A quarter of the strands, drawn four times as wide, covers what all strands cover, within an artist's limit."""
    points = rng.uniform(-0.3, 0.3, (64, 2, 3)).astype(np.float32) - [0.0, 0.0, 1.0]
    strands = [(points.astype(np.float32), np.full((64, 2), 0.1 * 0.4 / SIZE[1], np.float32), np.eye(4))]

    def parts(**steps):
        buffer = filled(strands, PARALLEL, shading, True, steps=drawing.Steps(**steps), is_counted=True)
        return np.array(buffer.covered.read(), np.uint32)

    assert parts().any()
    np.testing.assert_array_equal(parts(strand_count=16), parts())
    assert (parts(strand_count=16, most_strands=16) != parts()).any()


def test_parts_are_counted_of_strands_whose_axis_is_in_a_surface(shading):
    """Strands are round: their sides that face the viewer are in front, and seen."""
    points = np.zeros((1, 2, 3), np.float32)
    points[0, :, 0], points[..., 2] = [-0.3, 0.3], -1.0
    radius = 2.0 * 0.4 / SIZE[1]
    given = [(points, np.full((1, 2), radius, np.float32), np.eye(4))], PARALLEL, shading, True, 1.0 - 0.5 * radius
    buffer = filled(*given, is_counted=True)
    seen = np.array(buffer.segments.read(), np.int64).reshape(SIZE[::-1]) < visibility_buffer.NO_SEGMENT
    assert seen[:, : SIZE[0] // 2].any() and seen[:, SIZE[0] // 2 :].any()
    assert np.array(buffer.covered.read(), np.uint32).reshape(SIZE[::-1])[seen].all()


def test_no_parts_are_counted_of_wide_strands_behind_a_surface(shading):
    """Neither along strands, nor at their round ends and bends."""
    points = np.array([[[-0.3, -0.1, -1.0], [-0.2, 0.1, -1.0], [-0.1, -0.1, -1.0], [0.3, 0.1, -1.0]]], np.float32)
    strand = [(points, np.full((1, 4), 4.0 * 0.4 / SIZE[1], np.float32), np.eye(4))]
    buffer = filled(strand, PARALLEL, shading, True, 0.9, is_counted=True)
    left, right = np.split(np.array(buffer.covered.read(), np.uint32).reshape(SIZE[::-1]), 2, axis=1)
    assert not left.any() and right.any()


def test_a_strand_behind_a_surface_is_hidden(shading):
    points = np.zeros((1, 2, 3), np.float32)
    points[0, :, 0], points[..., 2] = [-0.3, 0.3], -1.0
    strand = [(points, np.full((1, 2), 0.02, np.float32), np.eye(4))]
    for in_compute in (True, False):
        found, _depths = drawn(strand, PERSPECTIVE, shading, in_compute, hiding_at=0.9)
        left, right = np.split(found >= 0, 2, axis=1)
        assert not left.any() and right.any()
        found, _depths = drawn(strand, PERSPECTIVE, shading, in_compute, hiding_at=1.1)
        left, right = np.split(found >= 0, 2, axis=1)
        assert left.any() and right.any()


@pytest.mark.parametrize("in_compute", [True, False])
def test_strands_that_represent_others_are_thicker_but_no_longer(rng, shading, in_compute):
    """Few thick strands cover as many samples as all strands, although their ends are half disks of their own width."""
    start = np.append(rng.uniform(-0.18, 0.18, (12_000, 1, 2)), np.full((12_000, 1, 1), -2.0), axis=2)
    along = rng.normal(size=(12_000, 1, 2))
    along *= 3.0 * 0.4 / SIZE[1] / np.linalg.norm(along, axis=2, keepdims=True)  # three samples
    points = (start + np.pad(along, ((0, 0), (0, 0), (0, 1))) * np.linspace(0.0, 1.0, 3)[:, None]).astype(np.float32)
    placed = [(points, np.full((12_000, 3), 0.025 * 0.4 / SIZE[1], np.float32), np.eye(4))]
    few = drawing.Steps(strand_count=1200)
    every, some = ((drawn(placed, PARALLEL, shading, in_compute, steps=steps)[0] >= 0).sum() for steps in (ALL, few))
    assert some == pytest.approx(every, rel=0.05)


@pytest.mark.parametrize("in_compute", [True, False])
def test_thin_strands_in_one_line_cover_what_one_of_them_does(shading, in_compute):
    """Strands a fifth of a sample wide that lie in one line cover together as much as one strand, at any slope."""
    sample = 2.0 * HALF_WIDTH / SIZE[0]
    hits = columns = 0
    for slope in np.linspace(-0.4, 0.4, 35):
        points = np.zeros((10, 3, 3), np.float32)
        points[..., 0] = np.array([-1.0, 0.0, 1.0]) * HALF_WIDTH
        points[..., 1] = 0.0037 + slope * points[..., 0]
        points[..., 2] = -2.0
        radii = np.full((10, 3), 0.1 * sample / np.hypot(1.0, slope), np.float32)  # so wide along a column
        found, _depths = drawn([(points, radii, np.eye(4))], PARALLEL, shading, in_compute)
        hits, columns = hits + (found >= 0).sum(), columns + SIZE[0]
    assert hits / columns == pytest.approx(0.2, rel=0.1)


def test_wide_strands_end_with_disks(shading):
    """In a parallel view, a pixel is covered if its center is near enough to the segment between the strand's ends."""
    height, width = np.indices(SIZE[::-1])
    centres = np.stack([(width + 0.5) / SIZE[0] * 2 - 1, (height + 0.5) / SIZE[1] * 2 - 1], axis=-1)
    centres *= [HALF_WIDTH, 0.2]
    for end, radius in (((0.1, 0.03), 0.03), ((-0.02, 0.1), 0.05), ((0.0, 0.0), 0.04)):
        points = np.linspace([0.004, -0.003, -2.0], [*end, -2.4], 5, dtype=np.float32)[None]
        found, depths = drawn([(points, np.full((1, 5), radius, np.float32), np.eye(4))], PARALLEL, shading, True)
        start, way = points[0, 0, :2], points[0, -1, :2] - points[0, 0, :2]
        along = np.clip((centres - start) @ way / max(way @ way, 1e-12), 0.0, 1.0)
        distance = np.linalg.norm(centres - start - along[..., None] * way, axis=-1)
        sure = np.abs(distance - radius) > 1e-4
        # All but slivers where the last segment is cut off along a column.
        assert ((found >= 0) != (distance < radius))[sure].sum() < 0.02 * (distance < radius).sum()
        # Beside the near end they are spheres, but for what the segment reaches of them.
        beside = (along == 0.0) & (found >= 0) & (distance < radius)
        sphere = 0.2 - 0.5 * abs(PARALLEL[2, 2]) * np.sqrt(radius**2 - distance[beside] ** 2)
        assert (depths[beside] < sphere + 2e-5).all()
        assert np.isclose(depths[beside], sphere, rtol=0.0, atol=2e-5).mean() > 0.8


@pytest.mark.parametrize("in_compute", [True, False])
@pytest.mark.parametrize("turn", [1.2, 0.2, 0.0])
def test_thin_strands_cover_what_spheres_along_them_cover(rng, shading, in_compute, turn):
    """Strands that point toward the viewer or beside it cover their length times width and half a disk at each end."""
    sample, length = 2.0 * HALF_WIDTH / SIZE[0], 0.006
    start = rng.uniform([-0.3, -0.18, -2.0], [0.3, 0.18, -2.0], (400, 1, 3))
    azimuth = rng.uniform(0.0, 2.0 * np.pi, (400, 1))
    beside = np.concatenate([np.cos(azimuth), np.sin(azimuth), np.zeros((400, 1))], axis=-1)
    way = (np.sin(turn) * beside + np.cos(turn) * np.array([0.0, 0.0, 1.0]))[:, None]
    points = (start + np.linspace(0.0, length, 5)[:, None] * way).astype(np.float32)
    radius = 0.4 * sample
    found, _depths = drawn([(points, np.full((400, 5), radius, np.float32), np.eye(4))], PARALLEL, shading, in_compute)
    expected = 400 * (2.0 * radius * length * np.sin(turn) + np.pi * radius**2) / sample**2
    assert (found >= 0).sum() == pytest.approx(expected, rel=0.1)


@pytest.mark.parametrize("view_to_clip", [PERSPECTIVE, PARALLEL])
def test_all_that_hair_covers_lies_in_its_window(shading, rng, view_to_clip):
    """Hair covers no pixel outside of its window, for small tufts inside the picture, across its edges and beyond."""
    points, radii = tuft(rng, strand_count=12, thickness=0.02)
    points -= points.mean(axis=(0, 1))
    for x, y in ((0.0, 0.0), (0.3, 0.1), (-0.33, -0.2), (0.0, 0.19), (2.0, 0.0)):
        to_world = np.diag([0.15, 0.1, 0.1, 1.0])
        to_world[:3, 3] = x, y, -1.0
        segments, _depths = drawn([(points, radii, to_world)], view_to_clip, shading, True)
        is_there = np.argwhere(segments >= 0)[:, ::-1]
        assert is_there.size or x == 2.0
        on_gpu, view = (
            strand_textures.upload_strands(points, radii),
            drawing.pass_record(np.eye(4), view_to_clip, SIZE),
        )
        records = drawing.strand_records(on_gpu, view, to_world[None])
        ((left, bottom, width, height),) = windows.of_strands(on_gpu, records, SIZE)
        assert ((is_there >= (left, bottom)) & (is_there < (left + width, bottom + height))).all()
        assert width * height < 0.5 * SIZE[0] * SIZE[1]


def test_hair_outside_of_the_view_is_not_rasterized(shading, rng, monkeypatch):
    """Only the heads of a crowd that are in view take time on the GPU; the other heads change no sample."""
    points, radii = tuft(rng, strand_count=12, thickness=0.02)
    places = [np.diag([0.15, 0.1, 0.1, 1.0]) for _ in range(5)]
    for to_world, x in zip(places, (9.0, 0.1, -9.0, 0.0, 9.0), strict=True):
        to_world[:3, 3] = x, 0.0, -1.0
    rasterized, rasterize = [], drawing.rasterize_strands
    monkeypatch.setattr(drawing, "rasterize_strands", lambda *given: rasterized.append(given) or rasterize(*given))
    segments, depths = drawn([(points, radii, to_world) for to_world in places], PERSPECTIVE, shading, True)
    assert len(rasterized) == 2 * 2  # depths, then segments
    alone, same = drawn([(points, radii, places[1]), (points, radii, places[3])], PERSPECTIVE, shading, True)
    np.testing.assert_array_equal(depths, same)
    count = len(points) * (points.shape[1] - 1)
    np.testing.assert_array_equal(segments[segments >= 0] // count, 2 * (alone[alone >= 0] // count) + 1)


@pytest.mark.parametrize("view_to_clip", [PERSPECTIVE, PARALLEL])
def test_leaving_out_what_tiles_hide_changes_no_sample(shading, rng, monkeypatch, view_to_clip):
    """Culling by tiles changes no sample of dense hair, some in front of the near plane and half behind a surface.

    Only segments that are long beside tiles are culled.
    """
    buffer_class, culled = visibility_buffer.VisibilityBuffer, []
    find = buffer_class._find_farthest
    monkeypatch.setattr(buffer_class, "_find_farthest", lambda buffer: culled.append(1) or find(buffer))
    placed = [(*tuft(rng, 1500, thickness=0.006), np.eye(4)), (*tuft(rng, 40, thickness=0.02), np.eye(4))]
    found = []
    monkeypatch.setattr(visibility_buffer, "_FEW_SEGMENTS", 0)
    for short in (1e9, 0.0):
        monkeypatch.setattr(visibility_buffer, "_SHORT_SEGMENTS", short)
        found.append(drawn(placed, view_to_clip, shading, in_compute=True, hiding_at=0.9))
        assert len(culled) == (0 if short else 2)
    for all_walked, some_walked in zip(*found, strict=True):
        np.testing.assert_array_equal(all_walked, some_walked)


@pytest.mark.parametrize("view_to_clip", [PERSPECTIVE, PARALLEL])
def test_bends_and_ends_are_left_out_only_where_strands_are_too_thin_for_them(shading, rng, monkeypatch, view_to_clip):
    """Tufts of all widths look the same with all bends and ends drawn, and with those of thin strands omitted."""
    may_be_wide, chosen = windows.may_be_wide, []
    for x, thickness in ((0.0, 2e-3), (0.1, 6e-3), (0.0, 0.012), (0.1, 0.018), (0.0, 0.025), (0.1, 0.06)):
        points, radii = tuft(rng, strand_count=12, thickness=thickness)
        to_world = np.diag([0.15, 0.1, 0.1, 1.0])
        to_world[:3, 3] = x, 0.0, -0.6
        placed, found = [(points, radii, to_world)], []
        monkeypatch.setattr(windows, "may_be_wide", lambda *given: chosen.append(may_be_wide(*given)) or chosen[-1])
        found.append(drawn(placed, view_to_clip, shading, in_compute=True))
        monkeypatch.setattr(windows, "may_be_wide", lambda *_given: np.array([True]))
        found.append(drawn(placed, view_to_clip, shading, in_compute=True))
        for chosen_program, whole_program in zip(*found, strict=True):
            np.testing.assert_array_equal(chosen_program, whole_program)
    assert 0 < sum(chosen) < len(chosen)


def planes(*rows):
    """Return (6, 4) planes: some given, and others that clip nothing."""
    return np.array([*rows, *[(0.0, 0.0, 0.0, 0.0)] * (6 - len(rows))], np.float32)


@pytest.mark.parametrize("in_compute", [True, False])
@pytest.mark.parametrize("view_to_clip", [PERSPECTIVE, PARALLEL], ids=["perspective", "parallel"])
@pytest.mark.parametrize("thickness", [0.004, 0.03])
def test_planes_along_the_view_leave_a_rectangle_of_the_picture(rng, shading, view_to_clip, thickness, in_compute):
    """Inside Blender's Clipping Region nothing changes, and outside nothing is drawn."""
    placed = [(*tuft(rng, thickness=thickness), np.eye(4)), (*tuft(rng, 20), np.diag([1.5, 1.5, 1.5, 1.0]))]
    # x and y of clip space between parts of its w, where the camera is at the origin.
    sides = [view_to_clip[row] * sign + 0.5 * view_to_clip[3] for row in (0, 1) for sign in (1.0, -1.0)]
    (whole, depths), (left, same) = (
        drawn(placed, view_to_clip, shading, in_compute, clip_planes=clipping) for clipping in (None, planes(*sides))
    )
    height, width = np.indices(SIZE[::-1])
    away = np.maximum(np.abs(2 * width + 1 - SIZE[0]) / SIZE[0], np.abs(2 * height + 1 - SIZE[1]) / SIZE[1]) - 0.5
    # Strands are cut off across themselves or along columns.
    border = 4.0 / SIZE[1] + thickness * np.abs(view_to_clip[1, 1]) / 0.5
    inside, outside = away < -border, away > border
    assert (whole[inside] >= 0).sum() > 200 and (whole[outside] >= 0).sum() > 200
    assert (left[inside] == whole[inside]).mean() > 0.98 and (left[outside] == -1).mean() > 0.99
    alike = inside & (left == whole) & (whole >= 0)
    np.testing.assert_allclose(same[alike], depths[alike], atol=1e-5)


@pytest.mark.parametrize("in_compute", [True, False])
def test_a_plane_across_the_view_shows_what_is_behind_it(rng, shading, in_compute):
    """A clipping plane across the view cuts off strands and surfaces before it, which then hide nothing."""
    placed, behind = [(*tuft(rng), np.eye(4))], planes((0.0, 0.0, -1.0, -0.8))
    whole, depths = drawn(placed, PARALLEL, shading, in_compute)
    left, later = drawn(placed, PARALLEL, shading, in_compute, clip_planes=behind)
    plane = 0.5 * (0.8 * abs(PARALLEL[2, 2]) + PARALLEL[2, 3] + 1.0)
    far = depths > plane + 2e-3
    np.testing.assert_array_equal(left[far], whole[far])
    assert later[left >= 0].min() > plane - 2e-3
    near = (whole >= 0) & ~far
    assert (left[near] >= 0).any() and (left[near] == -1).any()
    for at, is_hidden in ((0.7, False), (0.9, True)):
        hidden, _depths = drawn(placed, PARALLEL, shading, in_compute, at, clip_planes=behind)
        assert np.array_equal(hidden, left) != is_hidden
