# SPDX-License-Identifier: GPL-3.0-or-later
"""The search for cells among the far sites of a site equals the search among all sites."""

import numpy as np
import pytest

from hair_addon.core.geometry.mesh import TriMesh, positions
from hair_addon.core.placement import voronoi
from hair_addon.core.placement.domain import Domain
from hair_addon.core.placement.exact_cells import CutCells
from tests.support.devices import DEVICE

SITE_COUNT = 900


@pytest.fixture(scope="module")
def slivers():
    """Return 400 separate strips of two slivers each, which cross each other in a cube."""
    random = np.random.default_rng(1)
    along, across = random.normal(size=(2, 400, 3))
    across -= np.sum(across * along, axis=1, keepdims=True) / np.sum(along**2, axis=1, keepdims=True) * along
    along *= 0.3 / np.linalg.norm(along, axis=1, keepdims=True)
    across *= 0.01 / np.linalg.norm(across, axis=1, keepdims=True)
    corners = random.random((400, 1, 3)) + np.stack([0.0 * along, along, along + across, across], axis=1)
    triangles = (4 * np.arange(400)[:, None, None] + np.array([(0, 1, 2), (0, 2, 3)])).reshape(-1, 3)
    return TriMesh(corners.reshape(-1, 3).astype(np.float32), triangles.astype(np.int32))


@pytest.fixture(scope="module")
def placed(slivers):
    domain = Domain(slivers, SITE_COUNT, device=DEVICE)
    points, _part = domain.samples(SITE_COUNT, np.random.default_rng(2))
    return domain, points


def _sums(placed, monkeypatch, most_far):
    domain, points = placed
    with monkeypatch.context() as patch:
        patch.setattr(voronoi, "find_far", most_far)
        patch.setattr("hair_addon.core.placement.exact_cells.find_far", most_far)
        return CutCells(domain, SITE_COUNT, DEVICE).sums(voronoi.sites_on(domain, points, DEVICE))


def test_cells_are_those_of_a_search_of_all_sites(placed, monkeypatch):
    """The sums of cells are equal to the last bit with and without far sites."""
    found = _sums(placed, monkeypatch, voronoi.find_far)
    expected = _sums(placed, monkeypatch, lambda domain, sites: None)
    for name in ("masses", "moments", "energies"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))


def test_far_sites_are_all_sites_within_their_radius_in_order(placed):
    """The far sites of a site are all sites within their radius, itself included, in order of index."""
    domain, points = placed
    sites = voronoi.sites_on(domain, points, DEVICE)
    voronoi.find_far(domain, sites)
    places = positions(domain.mesh, points).astype(np.float64)
    radii, counts, far = sites.far_radii.numpy(), sites.far_counts.numpy(), sites.far.numpy()
    assert np.count_nonzero(radii > 0.0) > 0.5 * SITE_COUNT
    assert counts.max() <= voronoi.MOST_FAR
    for site in np.flatnonzero(radii > 0.0)[::7]:
        apart = np.linalg.norm(places - places[site], axis=1)
        row = far[site, : counts[site]]
        assert (np.diff(row) > 0).all() and site in row
        assert set(np.flatnonzero(apart < radii[site] * (1.0 - 1e-5))) <= set(row)
        assert (apart[row] < radii[site] * (1.0 + 1e-5)).all()
