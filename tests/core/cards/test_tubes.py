# SPDX-License-Identifier: GPL-3.0-or-later
"""Tubes are closed and oriented outward, with the announced polygons and the volume of their strands."""

import itertools
from collections import Counter

import numpy as np
import pytest

from hair_addon.core.cards import tubes
from hair_addon.core.cards.card_settings import TubeSettings
from hair_addon.core.errors import HairError


def strands(rng, count=30, point_count=20):
    s = np.linspace(0.0, 0.2, point_count)[None, :, None]
    turn = rng.uniform(10.0, 30.0, (count, 1, 1))
    points = np.concatenate([0.02 * np.sin(turn * s), 0.02 * np.cos(turn * s), s + 0.0 * turn], axis=2)
    return (points + rng.random((count, 1, 3))).astype(np.float32), rng.uniform(
        5e-4, 1e-3, (count, point_count)
    ).astype(np.float32)


def polygons(mesh):
    return np.split(mesh.faces.corner_vertices, mesh.faces.starts[1:-1])


def volumes(mesh, count):
    """Return the volumes (count,) of tubes with equally many vertices, by the divergence theorem."""
    found, per_tube = np.zeros(count), len(mesh.vertices) // count
    for polygon in polygons(mesh):
        corners = mesh.vertices[polygon].astype(np.float64) - mesh.vertices[polygon[0] // per_tube * per_tube]
        for second, third in itertools.pairwise(corners):
            found[polygon[0] // per_tube] += np.dot(corners[0], np.cross(second, third)) / 6.0
    return found


@pytest.mark.parametrize("settings", [TubeSettings(), TubeSettings(side_count=3, point_count=2, taper=1.0)])
def test_tubes_are_closed_and_have_the_promised_polygons(rng, settings):
    points, radii = strands(rng)
    mesh = tubes.tubes(points, radii, settings)
    edges = Counter()
    for polygon in polygons(mesh):
        edges.update(zip(polygon.tolist(), np.roll(polygon, -1).tolist(), strict=True))
    # Each edge once in either direction: no border, and all faces wound alike.
    assert set(edges.values()) == {1} and all((second, first) in edges for first, second in edges)
    assert len(mesh.vertices) == settings.vertex_count(len(points))
    assert mesh.triangle_count == settings.triangle_count(len(points))
    assert (volumes(mesh, len(points)) > 0.0).all()


def test_a_straight_tube_is_a_prism_around_its_strand():
    points = np.linspace([1.0, 2.0, 3.0], [1.0, 2.5, 3.0], 10, dtype=np.float32)[None]
    radii = np.full((1, 10), 0.01, np.float32)
    mesh = tubes.tubes(points, radii, TubeSettings(side_count=8, point_count=4, thickness=2.0))
    np.testing.assert_allclose(volumes(mesh, 1), 0.5 * 8 * 0.5 * 0.02**2 * np.sin(np.pi / 4), rtol=1e-4)
    away = np.linalg.norm(mesh.vertices[:, [0, 2]] - [1.0, 3.0], axis=1)
    np.testing.assert_allclose(away, 0.02, rtol=1e-4)
    tapered = tubes.tubes(points, radii, TubeSettings(side_count=8, point_count=5, taper=0.5)).vertices
    np.testing.assert_allclose(
        np.linalg.norm(tapered[:, [0, 2]] - [1.0, 3.0], axis=1).reshape(5, 8),
        0.01 * np.linspace(1.0, 0.5, 5)[:, None] * np.ones(8),
        rtol=1e-4,
    )


def test_uv_coordinates_go_around_and_from_root_to_tip(rng):
    points, radii = strands(rng, 3)
    mesh = tubes.tubes(points, radii, TubeSettings(side_count=5, point_count=7))
    assert mesh.uvs.min() == 0.0 and mesh.uvs.max() == 1.0
    sizes = np.diff(mesh.faces.starts)
    quads = mesh.uvs[: 4 * int((sizes[:32] == 4).sum())].reshape(-1, 4, 2)
    np.testing.assert_allclose(quads[:, 1, 0] - quads[:, 0, 0], 0.2, atol=1e-6)
    assert (quads[:, 2, 1] > quads[:, 1, 1]).all()


def test_fewer_tubes_are_spread_over_all_strands():
    np.testing.assert_array_equal(tubes.chosen_strands(10, 5), [0, 2, 4, 6, 8])
    np.testing.assert_array_equal(tubes.chosen_strands(3, 3), [0, 1, 2])


def test_what_is_too_large_or_not_finite_is_refused(rng):
    points, radii = strands(rng, 4)
    with pytest.raises(HairError, match="exceed 5000000"):
        TubeSettings(tube_count=0).require_size(100_000)
    points[1, 3, 2] = np.nan
    with pytest.raises(HairError, match="non-finite"):
        tubes.tubes(points, radii, TubeSettings())
