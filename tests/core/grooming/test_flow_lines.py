# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides start along flow lines, at an angle to the surface, and vary continuously between lines."""

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.geometry import mesh as mesh_math
from hair_addon.core.geometry.curves import bspline
from hair_addon.core.geometry.mesh import TriMesh
from hair_addon.core.geometry.sampling import sample_surface
from hair_addon.core.grooming import flow_lines, groom, guide_growth
from hair_addon.core.grooming.groom import GuideSettings
from hair_addon.core.interpolation import part_lines
from tests.support.devices import DEVICE
from tests.support.meshes import flat_grid

LINE = np.array([[(0.0, 0.5, 0.0), (1.0, 0.5, 0.0)]])
UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def plane():
    """Return a plane from 0 to 1 that faces up."""
    mesh = flat_grid(12, 1.0)
    return TriMesh((mesh.vertices - mesh.vertices.min(axis=0)).astype(np.float32), mesh.triangles)


@pytest.fixture(scope="module")
def roots(plane):
    return sample_surface(plane, 300, seed=1)


def line(*points):
    """Return (L, 2, 3) segments of a polyline on the plane."""
    points = np.array([(*point, 0.0) for point in points])
    return np.stack([points[:-1], points[1:]], axis=1)


def axes(mesh, places, segments, lift=0.5):
    """Return the directions (G, 3) of guides at places on the plane."""
    return flow_lines.axes(flow_lines.lay(mesh, segments, DEVICE), places, np.broadcast_to(UP, places.shape), lift)


def grown(mesh, roots, segments, **settings):
    """Return the points (G, 41, 3) of guides."""
    straight = {"length": 0.3, "length_variation": 0.0, "tilt": 0.0, "gravity": 0.0, "seed": 1}
    flow = None if segments is None else flow_lines.lay(mesh, segments, DEVICE)
    controls = guide_growth.grow(mesh, roots, **straight | settings, control_point_count=6, flow=flow, device=DEVICE)
    return bspline.evaluate(controls, 41, DEVICE).numpy()


def first_directions(points):
    steps = (points[:, 1] - points[:, 0]).astype(np.float64)
    return steps / np.linalg.norm(steps, axis=1, keepdims=True)


def along(count=400):
    """Return places across the plane, from its lower to its upper border."""
    return np.stack([np.full(count, 0.5), np.linspace(0.02, 0.98, count), np.zeros(count)], axis=1)


@pytest.mark.parametrize("degrees", [5.0, 10.0, 30.0, 60.0, 90.0])
def test_guides_begin_along_a_straight_line_at_the_angle_of_the_lift(plane, roots, degrees):
    lift = np.radians(degrees)
    directions = first_directions(grown(plane, roots, LINE, lift=lift))
    np.testing.assert_allclose(directions, [(np.cos(lift), 0.0, np.sin(lift))] * 300, atol=2e-3)


@pytest.mark.parametrize("angle", [0.4, 2.0])
def test_the_direction_turns_with_the_line(plane, roots, angle):
    end = 0.5 * np.array([np.cos(angle), np.sin(angle)])
    directions = axes(plane, mesh_math.positions(plane, roots), line(0.5 - 0.9 * end, 0.5 + 0.9 * end), 0.5)
    inward = np.cos(0.5) * np.array([np.cos(angle), np.sin(angle)])
    near = np.linalg.norm(mesh_math.positions(plane, roots)[:, :2] - 0.5, axis=1) < 0.4
    np.testing.assert_allclose(directions[near], [(*inward, np.sin(0.5))] * near.sum(), atol=1e-4)


def test_a_reversed_line_reverses_the_directions(plane):
    segments = line((0.1, 0.2), (0.4, 0.7), (0.9, 0.6))
    there, back = axes(plane, along(), segments), axes(plane, along(), segments[::-1, ::-1])
    np.testing.assert_allclose(back * (-1.0, -1.0, 1.0), there, atol=1e-9)


def test_more_points_on_a_line_change_nothing(plane):
    few = line((0.1, 0.3), (0.9, 0.3))
    many = line(*[(x, 0.3) for x in np.linspace(0.1, 0.9, 41)])
    np.testing.assert_allclose(axes(plane, along(), many), axes(plane, along(), few), atol=2e-3)


def test_a_bent_line_is_followed_along_its_course(plane):
    """A bent line is followed along its course: beside a quarter of a circle, guides run along concentric circles."""
    turns = np.linspace(0.0, 0.5 * np.pi, 33)
    segments = line(*np.stack([0.6 * np.cos(turns), 0.6 * np.sin(turns)], axis=1))
    for radius, tolerance in ((0.6, 0.05), (0.55, 0.06), (0.68, 0.06)):
        angles = np.linspace(0.25, 1.3, 20)
        places = np.stack([radius * np.cos(angles), radius * np.sin(angles), 0.0 * angles], axis=1)
        wanted = np.stack([-np.sin(angles), np.cos(angles), 0.0 * angles], axis=1)
        found = axes(plane, places, segments, 0.0)
        assert np.einsum("gi,gi->g", found, wanted).min() > np.cos(tolerance)


def test_between_opposite_lines_guides_turn_without_a_step(plane):
    segments = np.concatenate([line((0.0, 0.25), (1.0, 0.25)), line((1.0, 0.75), (0.0, 0.75))])
    directions = axes(plane, along(4000), segments)
    assert directions[900, 0] > 0.99 * np.cos(0.5) and directions[3100, 0] < -0.99 * np.cos(0.5)
    np.testing.assert_allclose(directions[1999:2001].mean(axis=0), UP, atol=1e-3)  # halfway neither wins
    assert np.linalg.norm(np.diff(directions, axis=0), axis=1).max() < 0.01
    assert np.all(np.diff(directions[900:3100, 0]) <= 1e-9)  # from one to the other, and never back


def test_directions_change_without_a_step_wherever_one_goes(plane, rng):
    segments = np.concatenate([line(*rng.random((3, 2))) for _ in range(5)])
    for start, end in rng.random((3, 2, 2)):
        part = np.linspace(0.0, 1.0, 10_001)[:, None]
        places = np.concatenate([start + part * (end - start), 0.0 * part], axis=1)
        steps = [
            np.linalg.norm(np.diff(axes(plane, places[::every], segments), axis=0), axis=1).max() for every in (4, 2, 1)
        ]
        assert steps[1] < 0.7 * steps[0] + 1e-9 and steps[2] < 0.7 * steps[1] + 1e-9


def test_far_from_lines_guides_grow_as_without_them(plane, roots):
    points = grown(plane, roots, line((0.05, 0.05), (0.15, 0.05)), tilt=0.3, gravity=0.4, lift=0.2)
    plain = grown(plane, roots, None, tilt=0.3, gravity=0.4)
    far = np.linalg.norm(plain[:, 0] - (0.1, 0.05, 0.0), axis=1) > 0.4
    assert far.sum() > 150
    np.testing.assert_allclose(points[far], plain[far], atol=1e-6)
    near = np.linalg.norm(plain[:, 0] - (0.1, 0.05, 0.0), axis=1) < 0.1
    assert near.any() and (first_directions(points[near])[:, 0] > 0.5).all()


def test_lines_cover_the_gaps_between_them_and_no_more(plane):
    """Two lines that are a fifth apart guide all hair between them, and none far beyond."""
    segments = np.concatenate([line((0.0, 0.4), (1.0, 0.4)), line((0.0, 0.6), (1.0, 0.6))])
    x = axes(plane, along(), segments, 0.0)[:, 0]
    y = along()[:, 1]
    np.testing.assert_allclose(x[(y > 0.25) & (y < 0.75)], 1.0, atol=1e-6)
    doubled = np.concatenate([segments, segments])
    x = axes(plane, along(), doubled, 0.0)[:, 0]
    np.testing.assert_allclose(x[np.abs(y - 0.4) < 0.02], 1.0, atol=1e-6)  # a line on a line is one


def test_tilt_is_the_largest_angle_to_the_flow(plane, roots):
    directions = first_directions(grown(plane, roots, LINE, lift=1.0, tilt=0.2))
    angles = np.arccos(np.clip(directions @ (np.cos(1.0), 0.0, np.sin(1.0)), -1.0, 1.0))
    assert 0.15 < angles.max() < 0.21


def test_guides_stay_rooted_outside_the_surface_and_as_long_as_asked(plane, roots):
    points = grown(plane, roots, LINE, lift=0.0, gravity=0.8, tilt=0.3)
    np.testing.assert_allclose(points[:, 0], mesh_math.positions(plane, roots), atol=1e-6)
    inside = np.all((points[..., :2] > 0.0) & (points[..., :2] < 1.0), axis=(1, 2))
    assert points[inside][..., 2].min() > -1e-3
    lengths = np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1)
    assert np.quantile(lengths, 0.05) > 0.95 * 0.3


def test_the_flow_turns_with_the_surface(plane, roots, rng):
    """The flow turns with the surface and moves with it, without gravity."""
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    turned = TriMesh((plane.vertices @ turn.T + 0.3).astype(np.float32), plane.triangles)
    segments = line((0.1, 0.2), (0.4, 0.7), (0.9, 0.6))
    expected = grown(plane, roots, segments, lift=0.4) @ turn.T + 0.3
    np.testing.assert_allclose(grown(turned, roots, segments @ turn.T + 0.3, lift=0.4), expected, atol=5e-3)


def test_lines_are_drawn_on_the_surface_as_it_is_posed(plane, roots):
    """A line over a raised, posed plane acts as the same line on the plane at rest."""
    raised = plane.vertices + np.float32([0.0, 0.0, 2.0])
    segments = line((0.1, 0.2), (0.9, 0.6))
    settings = GuideSettings(guide_count=50, length=0.2, gravity=0.3, relax_iterations=0)
    there = groom.distribute_guides(plane, settings, flow=segments, device=DEVICE).numpy()
    posed = groom.distribute_guides(plane, settings, flow=segments + 2.0 * UP, drawn_on=raised, device=DEVICE).numpy()
    np.testing.assert_allclose(posed, there, atol=1e-5)
    plain = groom.distribute_guides(plane, settings, device=DEVICE).numpy()
    assert np.abs(there - plain).max() > 0.05


@pytest.mark.parametrize(
    ("segments", "words"),
    [
        (np.empty((0, 2, 3)), "no segments"),
        (np.full((1, 2, 3), np.nan), "non-finite"),
        (np.zeros((3, 2, 3)), "no length"),
    ],
)
def test_lines_that_are_none_are_refused(plane, segments, words):
    with pytest.raises(HairError, match=words):
        flow_lines.lay(plane, segments, DEVICE)


def test_distances_equal_those_to_many_points_of_the_pieces(rng):
    places, starts, ends = rng.normal(size=(3, 40, 3)) + 5.0
    part = np.linspace(0.0, 1.0, 2001)[:, None, None]
    there = starts + part * (ends - starts)
    brute = np.stack([np.linalg.norm(there - place, axis=2).min(axis=0) for place in places])
    np.testing.assert_allclose(flow_lines._distances(places, starts, ends), brute, atol=1e-5)


OPPOSITE = np.concatenate([line((0.3, 0.1), (0.3, 0.9)), line((0.7, 0.9), (0.7, 0.1))])


def parted(mesh, places, segments, parting, lift=0.5):
    """Return the directions (G, 3) of guides at places on a plane with part lines."""
    lines = flow_lines.lay(mesh, segments, DEVICE, parting=part_lines.lay(mesh, parting, DEVICE))
    return flow_lines.axes(lines, places, np.broadcast_to(UP, places.shape), lift)


@pytest.mark.parametrize("frame", [(1.0, 1.0), (-1.0, 1.0), (0.01, 0.01), (100.0, -100.0), (0.7, 1.2)])
def test_guides_follow_the_flow_of_their_own_side_of_a_part_line(plane, roots, frame):
    """Up to a part line between opposite lines, the angle to the lines of a guide's own side is zero."""
    scale = np.array([*frame, frame[0] if frame[0] > 0.0 else 1.0])
    triangles = plane.triangles if frame[0] * frame[1] > 0.0 else plane.triangles[:, ::-1]
    mesh = TriMesh((plane.vertices * scale).astype(np.float32), np.ascontiguousarray(triangles))
    x = np.concatenate([0.5 - np.geomspace(1e-4, 0.3, 20), 0.5 + np.geomspace(1e-4, 0.3, 20)])
    for parting, y in ((line((0.5, 0.0), (0.5, 1.0)), (0.05, 0.5, 0.95)), (line((0.5, 0.1), (0.5, 0.9)), (0.4, 0.5))):
        places = np.array([(each, height, 0.0) for each in x for height in y]) * scale
        found = parted(mesh, places, OPPOSITE * scale, parting * scale, 0.0)
        sides = np.sign(0.5 - places[:, 0] / scale[0]) * np.sign(scale[1])
        assert np.abs(found - sides[:, None] * (0.0, 1.0, 0.0)).max() < 1e-5
    whole = axes(mesh, places, OPPOSITE * scale, 0.0)
    assert np.abs(whole[:, 1]).min() < 0.1  # without a part line they cancel


def test_the_flow_of_both_sides_blends_beyond_an_open_end_of_a_part_line(plane):
    """Along a path around the end of a part line, directions turn without a step."""
    angles = np.linspace(-1.0, 1.0, 1001)[:, None] * np.pi
    for radius in (0.02, 0.1, 0.2):
        places = np.concatenate([0.5 + radius * np.sin(angles), 0.5 + radius * np.cos(angles), 0.0 * angles], axis=1)
        found = parted(plane, places[1:-1], OPPOSITE, line((0.5, 0.0), (0.5, 0.5)))
        assert np.linalg.norm(np.diff(found, axis=0), axis=1).max() < 0.1
        assert np.abs(found[[0, -1], 1]).min() > (0.8 if radius > 0.1 else 0.0)


def test_behind_a_part_line_without_lines_guides_grow_as_without_flow(plane):
    places, parting = along()[along()[:, 1] > 0.5], line((0.0, 0.5), (1.0, 0.5))
    for segments in (line((0.1, 0.4), (0.9, 0.4)), line((0.5, 0.4), (0.51, 0.4))):  # many pieces, and one
        np.testing.assert_array_equal(parted(plane, places, segments, parting), [UP] * len(places))


def test_part_lines_far_from_the_flow_change_nothing(plane):
    segments = line((0.1, 0.2), (0.4, 0.25), (0.9, 0.2))
    places = along()[along()[:, 1] < 0.5]
    np.testing.assert_array_equal(
        parted(plane, places, segments, line((0.1, 0.9), (0.9, 0.9))), axes(plane, places, segments)
    )
