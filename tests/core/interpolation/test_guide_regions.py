# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides have the regions into which lines divide a surface, and the sides of open lines."""

import numpy as np
import pytest

from hair_addon.core.geometry.mesh import SurfacePoints, TriMesh, positions
from hair_addon.core.geometry.sampling import sample_surface
from hair_addon.core.interpolation import part_lines
from hair_addon.core.interpolation.guide_regions import guide_regions
from hair_addon.core.interpolation.regions import Regions
from tests.core.interpolation.test_guide_weights import flat
from tests.support.devices import DEVICE
from tests.support.meshes import flat_grid

MARGIN = 0.005  # nearer to a line than this, either side will do


@pytest.fixture(scope="module")
def ground():
    """Return a flat square from -½ to ½, along x and y."""
    mesh = flat_grid(16)
    return TriMesh(mesh.vertices - np.float32([0.5, 0.5, 0.0]), mesh.triangles)


@pytest.fixture(scope="module")
def roots(ground):
    return sample_surface(ground, 400, 1)


def segments(*corners):
    places = flat(corners)
    return np.stack([places[:-1], places[1:]], axis=1)


def found(ground, roots, *polylines, regions=()):
    lines = part_lines.lay(ground, np.concatenate([segments(*line) for line in polylines]), DEVICE)
    return guide_regions(ground, roots, regions, lines, DEVICE)


def assert_same_parts(labels, parts, chosen=slice(None)):
    """Assert that two guides have the same label if and only if they are in the same part."""
    labels, parts = labels[chosen], np.asarray(parts)[chosen]
    np.testing.assert_array_equal(labels[:, None] == labels, parts[:, None] == parts)
    assert len(np.unique(parts)) > 1


def test_without_lines_and_regions_all_are_one(ground, roots):
    assert not guide_regions(ground, roots).any()


def test_a_line_from_border_to_border_divides_the_surface(ground, roots):
    y = positions(ground, roots)[:, 1]
    assert_same_parts(found(ground, roots, [(-0.6, 0.1), (0.6, 0.1)]), y > 0.1, abs(y - 0.1) > MARGIN)


def test_a_closed_line_divides_in_from_out(ground, roots):
    far = abs(positions(ground, roots)[:, :2]).max(axis=1)
    ring = [(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2), (-0.2, -0.2)]
    assert_same_parts(found(ground, roots, ring), far > 0.2, abs(far - 0.2) > MARGIN)


def test_lines_that_meet_divide_into_three(ground, roots):
    """Lines that meet as a T divide the surface into three parts, whatever the foot does beyond the bar."""
    x, y, _z = positions(ground, roots).T
    labels = found(ground, roots, [(-0.5, 0.0), (0.5, 0.0)], [(0.0, -0.5), (0.0, -0.003)])
    parts = np.where(y > 0.0, 2, x > 0.0)
    assert_same_parts(labels, parts, (abs(y) > MARGIN) & ((abs(x) > MARGIN) | (y > 0.0)))


@pytest.mark.parametrize("corners", [[(-0.1, 0.0), (0.2, 0.0)], [(0.2, 0.0), (0.05, 0.0), (-0.1, 0.0)]])
def test_an_open_line_divides_past_its_ends_too(ground, roots, corners):
    y = positions(ground, roots)[:, 1]
    assert_same_parts(found(ground, roots, corners), y > 0.0, abs(y) > MARGIN)


def test_across_a_bent_line_are_others_than_on_the_same_side(ground, rng):
    """Guides of pairs across a bent line have different sides, and guides of pairs beside it the same side."""
    corners = np.array([(-0.3, -0.1), (-0.1, 0.1), (0.1, -0.1), (0.3, 0.1)])
    at = rng.uniform(0.05, 2.95, 200)
    part = (at % 1.0)[:, None]
    starts, edges = corners[at.astype(int)], np.diff(corners, axis=0)[at.astype(int)]
    is_inner = (part[:, 0] > 0.15) & (part[:, 0] < 0.85)
    across = np.stack([-edges[:, 1], edges[:, 0]], axis=1) / np.linalg.norm(edges, axis=1, keepdims=True)
    places = np.concatenate([starts + part * edges + 0.01 * across, starts + part * edges - 0.01 * across])
    labels = found(ground, rooted(ground, places), corners).reshape(2, -1)
    assert len(np.unique(labels[0][is_inner])) == len(np.unique(labels[1][is_inner])) == 1
    assert labels[0][is_inner][0] != labels[1][is_inner][0]


def rooted(ground, places):
    """Return `SurfacePoints` at places (N, 2) of the ground."""
    corners = ground.corners[:, :, :2].astype(np.float64)
    edges = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
    inner = np.einsum("fij,nfj->nfi", np.linalg.inv(edges), places[:, None] - corners[:, 0])
    weights = np.concatenate([1.0 - inner.sum(axis=2, keepdims=True), inner], axis=2)
    triangle = weights.min(axis=2).argmax(axis=1)
    return SurfacePoints(triangle.astype(np.int32), weights[np.arange(len(places)), triangle].astype(np.float32))


def test_regions_and_lines_divide_together(ground, roots):
    x, y, _z = positions(ground, roots).T
    own = (x > 0.15).astype(np.int32)
    labels = found(ground, roots, [(-0.5, 0.0), (0.5, 0.0)], regions=(Regions(None, own),))
    assert_same_parts(labels, 2 * (y > 0.0) + own, abs(y) > MARGIN)
