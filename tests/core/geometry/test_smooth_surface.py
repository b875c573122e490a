# SPDX-License-Identifier: GPL-3.0-or-later
"""The smooth surface of a subdivided cage equals bicubic splines, and unchanged surfaces stay."""

import numpy as np
import pytest

from hair_addon.core.geometry import smooth_surface
from hair_addon.core.geometry.mesh import Faces

CELLS = 6  # of a cage along each axis


def torus_grid(count):
    """Return `Faces` of count × count quads that close along both axes."""
    row, column = np.divmod(np.arange(count * count), count)
    ahead, above = (column + 1) % count, (row + 1) % count
    corners = np.stack([row * count + column, row * count + ahead, above * count + ahead, above * count + column], 1)
    return Faces(corners.ravel().astype(np.int32), np.arange(0, 4 * count * count + 1, 4, dtype=np.int32))


def spline(degree, controls, divisions):
    """Return the values of the periodic B-spline of controls (N, M) along the first axis, at N · divisions
    parameters.
    """
    at = np.arange(len(controls) * divisions) / divisions
    away = np.abs((at[:, None] - np.arange(len(controls)) + len(controls) / 2) % len(controls) - len(controls) / 2)
    hat = np.maximum(1.0 - away, 0.0)
    cubic = np.where(away < 1.0, 2 / 3 - away**2 + away**3 / 2, np.maximum(2.0 - away, 0.0) ** 3 / 6)
    return (hat if degree == 1 else cubic) @ controls


def surface(degree, controls, divisions):
    """Return (V, 3): the periodic spline surface of controls (CELLS, CELLS, 3)."""
    along = spline(degree, controls.reshape(CELLS, -1), divisions).reshape(-1, CELLS, 3)
    across = spline(degree, np.swapaxes(along, 0, 1).reshape(CELLS, -1), divisions)
    return np.swapaxes(across.reshape(CELLS * divisions, -1, 3), 0, 1).reshape(-1, 3)


@pytest.mark.parametrize("levels, part", [(1, 0.15), (2, 0.08), (3, 0.08)])
def test_a_cage_of_quads_becomes_its_bicubic_spline(rng, levels, part):
    """The error is a small part of the distance between the spline and the cage's faces."""
    controls, faces = rng.normal(size=(CELLS, CELLS, 3)), torus_grid(CELLS * 2**levels)
    flat, smooth = (surface(degree, controls, 2**levels) for degree in (1, 3))
    found = smooth_surface.smoothed(flat.astype(np.float32), faces, 4 * CELLS**2)
    missing, away = (np.sqrt(np.mean((smooth - other) ** 2)) for other in (found, flat))
    assert missing < part * away


def test_it_turns_and_moves_with_the_cage(rng):
    faces = torus_grid(CELLS * 4)
    flat = surface(1, rng.normal(size=(CELLS, CELLS, 3)), 4).astype(np.float32)
    turn, shift = np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.normal(size=3)
    found = smooth_surface.smoothed((flat @ turn.T + shift).astype(np.float32), faces, 4 * CELLS**2)
    np.testing.assert_allclose(found, smooth_surface.smoothed(flat, faces, 4 * CELLS**2) @ turn.T + shift, atol=1e-5)


@pytest.mark.parametrize("cage_corners", [0, 4 * CELLS**2])
def test_without_subdivision_nothing_moves(rng, cage_corners):
    vertices = rng.normal(size=(CELLS**2, 3)).astype(np.float32)
    np.testing.assert_array_equal(smooth_surface.smoothed(vertices, torus_grid(CELLS), cage_corners), vertices)
