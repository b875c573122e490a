# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands generated on the GPU equal those of Warp, and need only an upload of their guides."""

from dataclasses import replace
from types import SimpleNamespace

import gpu
import numpy as np
import pytest
import warp as wp

from hair_addon.blender.gpu import strand_textures
from hair_addon.blender.gpu.programs import shaders
from hair_addon.blender.gpu.strands import device_choice, strand_bounds, strand_changes, strand_maker
from hair_addon.core.errors import HairError
from hair_addon.core.geometry import strands
from hair_addon.core.geometry.mesh import SurfacePoints
from hair_addon.core.grooming import following
from hair_addon.core.interpolation import hair_binding
from hair_addon.core.interpolation.guide_weights import find_candidates
from tests.support.pictures import drawn_strands

# Of a strand's length, by which it may differ: sums in single precision, in another order.
CLOSE = 1e-5
GUIDES, STRANDS = 70, 900


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def vectors(array):
    return wp.array(np.float32(array), dtype=wp.vec3, device="cpu")


def bound_hair(rng, point_count, slots, angle_limit=np.pi / 3, length_limit=3.0, keep_length=1.0, is_gathered=False):
    """Return (`HairBinding`, guides as `Strands`): curled guides of many lengths, one of them zero, over a ball.

    is_gathered: whether some of the guides have ties.
    """
    guide_roots, roots = unit(rng.normal(size=(GUIDES, 3))), unit(rng.normal(size=(STRANDS, 3)))
    roots[:5] = guide_roots[:5]  # at guides, and straight below
    roots[5] = (0.0, 0.0, -1.0)
    lengths = rng.uniform(0.05, 0.3, (GUIDES, 1, 1)) / point_count
    steps = lengths * unit(guide_roots[:, None] + 0.6 * rng.normal(size=(GUIDES, point_count - 1, 3)))
    steps[0] = 0.0
    points = guide_roots[:, None] + np.pad(np.cumsum(steps, axis=1), ((0, 0), (1, 0), (0, 0)))
    normals = vectors(unit(roots + 0.1 * rng.normal(size=roots.shape)))
    guide_normals = vectors(guide_roots)
    settings = SimpleNamespace(
        automatic_influence=True,
        neighbour_limit=slots,
        angle_limit=angle_limit,
        length_limit=length_limit,
        keep_length=keep_length,
    )
    candidates = find_candidates(vectors(roots), normals, vectors(guide_roots), guide_normals, slots)
    places = SurfacePoints(np.zeros(STRANDS, np.int32), np.zeros((STRANDS, 3), np.float32))
    guide_places = SurfacePoints(np.zeros(GUIDES, np.int32), np.zeros((GUIDES, 3), np.float32))
    frames = (np.float32(guide_roots), guide_normals)
    binding = hair_binding.weighed(places, (vectors(roots), normals), frames, candidates, settings)
    if is_gathered:
        tie_fractions = np.where(rng.random(GUIDES) < 0.5, rng.uniform(0.1, 1.0, GUIDES), 0.0)
        binding = replace(binding, tie_fractions=wp.array(np.float32(tie_fractions), dtype=float, device="cpu"))
    return binding, strands.from_numpy(np.float32(points), guide_places, "cpu")


def by_warp(binding, guides, axes):
    return following.growing_points(binding, guides, following.weights_now(binding, guides), axes).result()


def new_maker(binding, point_count, axes):
    return strand_maker.new_maker(strand_maker.bound_strands(binding), point_count, axes)


def uploaded(points):
    return strand_textures.upload_strands(points, np.broadcast_to(profile(points.shape[1]), points.shape[:2]))


def profile(point_count):
    return np.linspace(2e-4, 1e-5, point_count, dtype=np.float32)


AXES = np.array([[0.0, -2.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0]])


@pytest.mark.parametrize(
    ("point_count", "slots", "limits"),
    [
        (9, 8, {"is_gathered": True}),
        (41, 3, {"keep_length": 0.3, "angle_limit": np.pi, "length_limit": 1e6}),
        (3, 1, {"angle_limit": 0.2}),
        (17, 5, {"length_limit": 1.0, "keep_length": 0.0, "is_gathered": True}),
    ],
)
def test_strands_are_those_of_warp(blender, rng, point_count, slots, limits):
    binding, guides = bound_hair(rng, point_count, slots, **limits)
    wanted = by_warp(binding, guides, AXES)
    before = uploaded(np.zeros_like(wanted))
    maker = new_maker(binding, point_count, AXES)
    made = maker.make(before, guides.numpy())
    assert not made.has_points and not made.has_bends
    found = drawn_strands.places(made)
    lengths = np.linalg.norm(np.diff(wanted, axis=1), axis=2).sum(axis=1)
    error = np.linalg.norm(found - wanted, axis=2).max(axis=1)
    # Places of 1 m have half a unit of their last digit beside it, twice.
    assert (error <= CLOSE * lengths + 4.0 * 2.0**-23).all(), error.max()
    places, close = found.reshape(-1, 3), drawn_strands.tolerance(found).max()
    np.testing.assert_allclose(made.box.exact, [places.min(axis=0), places.max(axis=0)], rtol=0.0, atol=close)
    centre, radius = made.ball
    assert (np.linalg.norm(places - centre, axis=1) <= radius * (1.0 + 1e-6)).all()


@pytest.mark.parametrize("count", [1, 2, 27, 28, 8193])
def test_joined_boxes_hold_all_boxes(blender, rng, count):
    bounds = strand_bounds.new_bounds(count)
    in_row = min(8192, count)
    boxes = rng.normal(size=(-(-count // in_row) * in_row, 2, 4)).astype(np.float32)
    texels = gpu.types.Buffer("FLOAT", boxes.size, boxes.ravel())
    texture = gpu.types.GPUTexture((2 * in_row, len(boxes) // in_row), format="RGBA32F", data=texels)
    found = replace(bounds, levels=((texture, count), *bounds.levels[1:])).joined().exact
    np.testing.assert_array_equal(found, [boxes[:count, 0, :3].min(axis=0), boxes[:count, 1, :3].max(axis=0)])


def test_an_edit_leaves_where_strands_were(blender, rng):
    binding, guides = bound_hair(rng, 9, 4)
    first = uploaded(by_warp(binding, guides, np.eye(3)))
    maker = new_maker(binding, 9, np.eye(3))
    once = maker.make(first, guides.numpy())
    there = drawn_strands.places(once)
    combed = guides.numpy() + np.linspace(0.0, 0.1, 9, dtype=np.float32)[:, None]
    twice = maker.make(once, combed)
    assert twice.texture is once.texture
    assert twice.moved.turn == once.moved.turn + 1
    np.testing.assert_array_equal(drawn_strands.places_before(twice, STRANDS), there)
    rows = np.array(twice.moved.rows.read(), np.float32).ravel()[:STRANDS]
    np.testing.assert_array_equal(rows, np.arange(1, STRANDS + 1))
    assert np.abs(drawn_strands.places(twice) - there).max() > 0.01


def test_much_hair_keeps_no_second_texture(blender, rng, monkeypatch):
    """Much hair keeps no second texture, and its former points count as unknown, as after two changes at once."""
    monkeypatch.setattr(strand_changes, "MOST_MOVED", STRANDS * 9 - 1)
    binding, guides = bound_hair(rng, 9, 4)
    wanted = by_warp(binding, guides, np.eye(3))
    maker = new_maker(binding, 9, np.eye(3))
    assert maker.changes.moved.width * maker.changes.moved.height == 1
    made = maker.make(uploaded(np.zeros_like(wanted)), guides.numpy())
    assert made.moved.turn == 2
    np.testing.assert_allclose(drawn_strands.places(made), wanted, rtol=0.0, atol=CLOSE)


def test_an_edit_uploads_guides_and_nothing_else(blender, rng, monkeypatch):
    """An edit uploads one texture of twelve bytes per point, and compiles no program."""
    binding, guides = bound_hair(rng, 9, 4)
    before = uploaded(by_warp(binding, guides, np.eye(3)))
    maker = new_maker(binding, 9, np.eye(3))
    before = maker.make(before, guides.numpy())
    programs = len(shaders.program_cache)
    buffers, made = [], []
    with monkeypatch.context() as watched:
        buffer, texture = gpu.types.Buffer, gpu.types.GPUTexture
        watched.setattr(
            gpu.types, "Buffer", lambda kind, size, values: buffers.append(size) or buffer(kind, size, values)
        )
        watched.setattr(gpu.types, "GPUTexture", lambda *given, **named: made.append(given) or texture(*given, **named))
        watched.setattr(gpu.types, "GPUUniformBuf", None)
        for _ in range(3):
            before = maker.make(before, guides.numpy())
    assert len(made) == 3
    assert buffers == [GUIDES * 9 * 3] * 3
    assert len(shaders.program_cache) == programs


def test_bounds_are_read_once_they_are_needed(blender, rng, monkeypatch):
    """Making strands does not wait for the GPU; only the first use of their bounds does."""
    binding, guides = bound_hair(rng, 9, 4)
    maker, reads, read = new_maker(binding, 9, np.eye(3)), [], strand_bounds.StrandBounds._read
    monkeypatch.setattr(strand_bounds.StrandBounds, "_read", lambda self: reads.append(0) or read(self))
    made = maker.make(uploaded(by_warp(binding, guides, np.eye(3))), guides.numpy())
    again = replace(made, has_bends=True)
    assert not reads
    places = drawn_strands.places(made).reshape(-1, 3)
    for shown in (again, made):
        np.testing.assert_allclose(shown.box.exact, [places.min(axis=0), places.max(axis=0)], rtol=0.0, atol=1e-4)
    assert len(reads) == 1


def test_other_guides_or_strands_are_refused(blender, rng):
    binding, guides = bound_hair(rng, 9, 4)
    before = uploaded(by_warp(binding, guides, np.eye(3)))
    maker = new_maker(binding, 9, np.eye(3))
    with pytest.raises(HairError, match="guides"):
        maker.make(before, guides.numpy()[1:])
    with pytest.raises(HairError, match="points of a guide"):
        maker.make(before, guides.numpy()[:, 1:])
    with pytest.raises(HairError, match="strands"):
        maker.make(uploaded(before.points[1:].copy()), guides.numpy())
    with pytest.raises(HairError, match="guides"):
        guide_normals = vectors(np.ones((3, 3)))
        new_maker(replace(binding, guide_normals=guide_normals), 9, np.eye(3))


@pytest.mark.parametrize(
    ("times", "is_faster", "can_make"), [((1.0, 3.0), 1, 1), ((2.0, 3.0), 0, 1), ((np.inf, 0.0), 0, 0)]
)
def test_the_faster_way_is_chosen(monkeypatch, times, is_faster, can_make):
    monkeypatch.setattr(device_choice, "times", lambda: times)
    assert (device_choice.is_faster(), device_choice.can_make()) == (is_faster, can_make)


def test_times_are_measured_once(blender):
    first = device_choice.times()
    assert min(first) > 0.0
    assert device_choice.times() is first
