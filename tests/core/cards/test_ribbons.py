# SPDX-License-Identifier: GPL-3.0-or-later
"""Ribbons have steady, oriented frames, and the strands that are laid flat onto a ribbon stay inside."""

import itertools

import numpy as np

from hair_addon.core.cards import outlines, ribbons
from hair_addon.core.geometry.curves import curve_frames
from hair_addon.core.geometry.mesh import TriMesh
from tests.core.cards.conftest import COUNT, SEGMENTS, sphere


def helix(turns, count=60):
    t = np.linspace(0.0, 2.0 * np.pi * turns, count)
    return np.stack([np.cos(t), np.sin(t), 0.3 * t], axis=-1)[None]


def test_frames_are_right_handed_and_do_not_twist():
    """A steady frame does not twist around a closed plane curve or along any plane curve, and is right-handed."""
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    circle = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=-1)[None]
    normals = curve_frames.steady_normals(circle, np.array([[0.6, 0.0, 0.8]]))
    np.testing.assert_allclose(normals[0, :, 2], 0.8, atol=1e-4)
    curve = helix(1.5)
    along, across = curve_frames.tangents(curve), curve_frames.steady_normals(curve)
    for vectors in (along, across):
        np.testing.assert_allclose(np.linalg.norm(vectors, axis=-1), 1.0, atol=1e-12)
    np.testing.assert_allclose((along * across).sum(axis=-1), 0.0, atol=1e-12)


def test_a_helix_turns_a_steady_frame_by_its_torsion():
    """A steady frame around a helix of pitch 2 pi c and radius 1 turns by length × c / (1 + c²) against the
    principal normal.
    """
    curve = helix(1.0, 2000)
    normals = curve_frames.steady_normals(curve)
    inward = np.concatenate([-curve[0, :, :2], np.zeros((2000, 1))], axis=1)
    side = np.cross(curve_frames.tangents(curve)[0], inward)
    angles = np.unwrap(np.arctan2((normals[0] * side).sum(1), (normals[0] * inward).sum(1)))
    torsion = 0.3 / (1.0 + 0.3**2)
    length = 2.0 * np.pi * np.hypot(1.0, 0.3)
    np.testing.assert_allclose(angles[-2] - angles[1], -torsion * length, rtol=5e-3)


def test_points_gather_where_a_curve_bends():
    corner = np.array(
        [[x, 0.0, 0.0] for x in np.linspace(0, 1, 20)] + [[1.0, y, 0.0] for y in np.linspace(0.05, 1, 20)]
    )
    found = curve_frames.resample_by_curvature(corner[None], 9)[0]
    np.testing.assert_array_equal(found[[0, -1]], corner[[0, -1]])
    from_corner = np.linalg.norm(found - [1.0, 0.0, 0.0], axis=1)
    assert from_corner.min() < 0.06 and (from_corner < 0.2).sum() >= 3
    line = np.linspace([0.0, 0.0, 0.0], [1.0, 2.0, 3.0], 30)
    even = curve_frames.resample_by_curvature(line[None], 5)[0]
    np.testing.assert_allclose(even, np.linspace([0.0, 0.0, 0.0], [1.0, 2.0, 3.0], 5), atol=1e-12)


def test_ribbons_face_away_from_the_surface(carded):
    outward = carded.axes.centres / np.linalg.norm(carded.axes.centres, axis=-1, keepdims=True)
    across = outward - (outward * carded.axes.tangents).sum(-1, keepdims=True) * carded.axes.tangents
    facing = (across * carded.axes.normals).sum(-1) / np.maximum(np.linalg.norm(across, axis=-1), 1e-9)
    assert np.median(facing) > 0.95 and (facing.mean(axis=1) > 0.0).all()


def test_a_clump_that_is_flat_gives_a_ribbon_in_its_plane(rng):
    """A flat clump of straight upright strands gives a ribbon in the plane of its spread."""
    x = rng.uniform(-0.02, 0.02, (50, 1))
    s = np.linspace(0.0, 0.1, 9)
    direction = np.array([np.cos(0.7), np.sin(0.7), 0.0])
    points = 0.1 * np.array([0.0, 0.0, 1.0]) + x[..., None] * direction + s[:, None] * np.array([0.0, 0.0, 1.0])
    points = points.astype(np.float32)
    labels = np.zeros(50, np.int32)
    axes = ribbons.axes_of(points, labels, 1, 3, sphere())
    np.testing.assert_allclose(np.abs(axes.binormals[0] @ direction), 1.0, atol=1e-2)
    flat = ribbons.flattened(points, labels, axes)
    assert np.abs(flat[..., 2]).max() < 1e-3
    np.testing.assert_allclose(np.ptp(flat[:, 0, 0]), np.ptp(x), rtol=1e-3)


def test_flattened_strands_are_where_they_were(carded):
    """Flattened strands have each point's distances across, along and above the ribbon's middle line."""
    distances = carded.axes.distances[carded.labels]
    along = carded.flat[..., 1].astype(np.float64)
    segment = (along[..., None] >= distances[:, None, 1:-1]).sum(axis=-1)
    start, end = (
        np.take_along_axis(carded.axes.centres[carded.labels], (segment + step)[..., None], axis=1) for step in (0, 1)
    )
    edge = end - start
    length = np.linalg.norm(edge, axis=-1)
    beyond = along - np.take_along_axis(distances, segment, axis=1)
    middle = start + edge / length[..., None] * beyond[..., None]
    away = np.linalg.norm(carded.points - middle, axis=-1)
    inside = (beyond > 0.05 * length) & (beyond < 0.95 * length)
    difference = np.abs(away - np.linalg.norm(carded.flat[..., [0, 2]], axis=-1))[inside]
    # Others lie at the outside of bends, or straight on behind an end.
    assert (difference < 2e-5).mean() > 0.9 and inside.mean() > 0.7


def test_ribbons_contain_their_strands(carded):
    """Ribbons contain their strands' points, and places between them, with the strand's radius on both sides."""
    found, steps = carded.outlines, np.linspace(0.0, 1.0, 6)[:, None]
    for strand, card in enumerate(carded.labels):
        flat = carded.flat[strand]
        dense = np.concatenate([a + steps * (b - a) for a, b in itertools.pairwise(flat)])
        low = np.interp(dense[:, 1], found.along[card], found.low[card])
        high = np.interp(dense[:, 1], found.along[card], found.high[card])
        radius = carded.radii[strand, 0] - 1e-6
        assert (dense[:, 0] >= low + radius).all() and (dense[:, 0] <= high - radius).all()
        assert dense[:, 1].min() >= found.along[card, 0] and dense[:, 1].max() <= found.along[card, -1]


def test_ribbons_are_lifted_to_the_strands_that_are_there():
    """Ribbons are lifted to their strands: hair combed along a surface rises from it behind the mean root."""
    roots, s = np.linspace(-0.02, 0.02, 40)[:, None], np.linspace(0.0, 0.1, 30)[None]
    points = np.stack([roots + s, 0.0 * (roots + s), 0.1 + 0.01 * (1.0 - np.exp(-s / 0.02)) + 0.0 * roots], axis=-1)
    points, labels = points.astype(np.float32), np.zeros(40, np.int32)
    plane = TriMesh(np.array([[-9, -9, 0.1], [9, -9, 0.1], [0, 9, 0.1]], np.float32), np.array([[0, 1, 2]], np.int32))
    axes = ribbons.axes_of(points, labels, 1, 6, plane)
    flat = ribbons.flattened(points, labels, axes)
    found = outlines.outlines(flat, np.full((40, 30), 1e-4), labels, axes)
    lifted = outlines.heights(flat, labels, found)
    first = [
        outlines.ribbon_mesh(axes, found, np.zeros((1, 7, 2, 2)), by).vertices[0, 2] - 0.1
        for by in (0 * lifted, lifted)
    ]
    assert first[0] < -0.005 and abs(first[1]) < 0.4 * abs(first[0])
    # No other heights are nearer to the strands.
    least = (outlines.levelled(flat, labels, found, lifted)[..., 2].astype(np.float64) ** 2).sum()
    for place in range(7):
        for by in (-2e-4, 2e-4):
            moved = lifted.copy()
            moved[0, place] += by
            assert (outlines.levelled(flat, labels, found, moved)[..., 2].astype(np.float64) ** 2).sum() > least


def test_a_single_strand_has_a_ribbon_as_wide_as_itself():
    points = np.linspace([0.0, 0.0, 0.1], [0.0, 0.05, 0.2], 9, dtype=np.float32)[None]
    labels, radii = np.zeros(1, np.int32), np.full((1, 9), 1e-3, np.float32)
    axes = ribbons.axes_of(points, labels, 1, 2, sphere())
    found = outlines.outlines(ribbons.flattened(points, labels, axes), radii, labels, axes)
    np.testing.assert_allclose(found.high - found.low, 2e-3, rtol=1e-4)


def test_the_mesh_has_the_polygons_that_were_promised_and_faces_outwards(carded):
    mesh = carded.mesh
    assert len(mesh.vertices) == COUNT * 2 * (SEGMENTS + 1)
    assert mesh.triangle_count == COUNT * 2 * SEGMENTS
    corners = mesh.vertices[mesh.faces.corner_vertices.reshape(-1, 4)].astype(np.float64)
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    wanted = np.repeat(0.5 * (carded.axes.normals[:, 1:] + carded.axes.normals[:, :-1]).reshape(-1, 3), 1, axis=0)
    assert ((normals * wanted).sum(axis=1) > 0.0).mean() > 0.99
