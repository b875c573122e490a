# SPDX-License-Identifier: GPL-3.0-or-later
"""Lean turns guides in the given direction, and no guide penetrates the surface."""

from functools import cache

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.geometry.closest_point import SurfaceQuery
from hair_addon.core.geometry.strands import from_numpy, segment_lengths
from hair_addon.core.styling import guide_lean, lean, wet
from hair_addon.core.styling.masks import Inputs
from tests.support.strands.styled import ball, head, straight

ALL = {"root": 1.0, "tip": 1.0}
DOWN = np.array([0.0, 0.0, -1.0])


@pytest.fixture(scope="module")
def fur():
    return ball(100)


@pytest.fixture(scope="module")
def hair():
    return head(100)


def leaned(hair, *styles, guides=None, **inputs):
    """Return (G, P, 3): guides as strands follow them."""
    guides = hair.guides if guides is None else guides
    return hair.bound(*styles, inputs=Inputs(**inputs) if inputs else None).guides(guides).numpy().astype(np.float64)


def directions(points):
    segments = np.diff(points, axis=1)
    return segments / np.linalg.norm(segments, axis=2, keepdims=True)


@pytest.mark.parametrize("settings", [lean.Settings(), lean.Settings(**lean.LIFT), wet.Settings(lock=0.2)], ids=type)
@pytest.mark.parametrize("name", ["fur", "hair"])
def test_roots_and_lengths_stay(request, name, settings):
    hair = request.getfixturevalue(name)
    before, after = hair.guides.numpy().astype(np.float64), leaned(hair, settings)
    np.testing.assert_array_equal(after[:, 0], before[:, 0])
    np.testing.assert_allclose(segment_lengths(after), segment_lengths(before), rtol=2e-5, atol=1e-7)


def test_without_a_surface_near_guides_point_where_they_are_told(rng):
    hair = straight(20)
    aim = np.array([0.6, 0.0, 0.8])
    for amount in (0.3, 0.7, 1.0):
        settings = lean.Settings(amount=amount, direction="OBJECT", target="Empty", clearance=0.0, **ALL)
        wanted = (1.0 - amount) * np.array([0.0, 0.0, 1.0]) + amount * aim
        found = directions(leaned(hair, settings, targets={"Empty": aim}))
        np.testing.assert_allclose(found, np.broadcast_to(wanted / np.linalg.norm(wanted), found.shape), atol=1e-4)


def test_normal_is_away_from_the_surface(fur):
    found = directions(leaned(fur, lean.Settings(direction="NORMAL", **ALL)))
    normals = fur.binding.guide_normals.numpy()
    assert (found * normals[:, None]).sum(axis=2).min() > 0.999


def test_a_missing_target_leaves_guides(fur):
    settings = lean.Settings(direction="OBJECT", target="Nobody")
    np.testing.assert_array_equal(leaned(fur, settings), fur.guides.numpy())


@pytest.mark.parametrize("clearance", [0.0005, 0.002, 0.01, 0.03])
@pytest.mark.parametrize("amount", [0.2, 1.0])
@pytest.mark.parametrize("seed", [1, 4, 7])
def test_no_guide_ends_under_the_surface(seed, clearance, amount):
    """No guide ends under the surface: guides that hug a ball keep the clearance beyond twice that from their root.

    Some stand at the top of the ball, and lean straight into it.
    """
    fur = groomed(seed)
    made = leaned(fur, lean.Settings(amount=amount, clearance=clearance, **ALL))
    mesh = fur.mesh
    nearest = SurfaceQuery(mesh).nearest(made.reshape(-1, 3))
    corners = mesh.vertices[mesh.triangles[nearest.triangle]]
    places = np.einsum("nc,ncd->nd", nearest.barycentric, corners).reshape(made.shape)
    outward = places / np.linalg.norm(places, axis=2, keepdims=True)
    heights = ((made - places) * outward).sum(axis=2)
    arcs = np.pad(np.cumsum(segment_lengths(made), axis=1), ((0, 0), (1, 0)))
    assert heights[arcs > 2.5 * clearance].min() > 0.98 * clearance
    assert heights.min() > -1e-4


@cache
def groomed(seed):
    return ball(10, seed=seed)


def test_a_guide_without_amount_keeps_its_bits(fur):
    points = fur.guides.numpy()
    amounts = np.ones(points.shape[:2])
    amounts[::2] = 0.0
    directions_down = np.tile(DOWN, (len(points), 1))
    surface = SurfaceQuery(fur.mesh)
    made = guide_lean.leaned(
        points, amounts, directions_down, surface, fur.mesh.vertex_normals, np.full(len(points), 0.004)
    )
    np.testing.assert_array_equal(made[::2], points[::2])
    assert np.abs(made[1::2] - points[1::2]).max() > 0.01


def test_opposite_directions_do_not_vanish(fur):
    """Opposite directions do not vanish: guides that point straight up lean down by half."""
    points = fur.guides.numpy().copy()
    points[:, 1:] = points[:, :1] + np.linspace(0.0, 0.3, points.shape[1])[1:, None] * -DOWN
    up = from_numpy(points.astype(np.float32), fur.guides.roots)
    made = leaned(fur, lean.Settings(amount=0.5, **ALL), guides=up)
    assert np.isfinite(made).all()
    np.testing.assert_allclose(segment_lengths(made), segment_lengths(points), rtol=1e-3)


def test_non_finite_guides_are_refused(fur):
    points = fur.guides.numpy().copy()
    points[3, 4, 1] = np.nan
    with pytest.raises(HairError, match="non-finite"):
        leaned(fur, lean.Settings(), guides=from_numpy(points, fur.guides.roots))


def test_strands_follow_leaned_guides(hair):
    """Strands follow leaned guides, so hair of a head that leans down ends lower."""
    made, plain = hair.styled(lean.Settings(**ALL)), hair.plain
    assert np.median(made[:, -1, 2] - plain[:, -1, 2]) < -0.01
