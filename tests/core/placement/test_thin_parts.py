# SPDX-License-Identifier: GPL-3.0-or-later
"""Sites are even on parts of a surface that are thinner than the distance between sites."""

import numpy as np
import pytest

from hair_addon.core.geometry.mesh import TriMesh, positions
from hair_addon.core.geometry.sampling import sample_surface
from hair_addon.core.placement import cvt, voronoi
from hair_addon.core.placement.domain import Domain
from hair_addon.core.placement.exact_cells import CutCells
from tests.support.devices import DEVICE
from tests.support.meshes import flat_grid, subdivided_sphere

SITE_COUNT = 700


@pytest.fixture(scope="module")
def eared():
    """Return (a ball with six thin flaps, each about a spacing of sites wide, (F,) whether triangles are a flap's)."""
    ball = subdivided_sphere(5)
    heights = np.zeros(len(ball.vertices))
    for axis in range(3):
        along, thin, wide = (ball.vertices[:, (axis + turn) % 3] for turn in range(3))
        flap = 0.4 * np.exp(-((thin / 0.05) ** 4) - (wide / 0.07) ** 4)
        heights += np.where(np.abs(along) > 0.5, flap, 0.0)
    mesh = TriMesh((ball.vertices * (1.0 + heights[:, None])).astype(np.float32), ball.triangles)
    return mesh, heights[ball.triangles].max(axis=1) > 0.04


def test_thin_flaps_hold_their_share_of_sites(eared):
    """Thin flaps hold their share of sites, although few sites of a coarse level are drawn to both of their sides."""
    mesh, is_flap = eared
    found = [is_flap[cvt.place(mesh, SITE_COUNT, seed, 12, device=DEVICE).triangle].mean() for seed in range(3)]
    assert np.mean(found) == pytest.approx(mesh.areas[is_flap].sum() / mesh.areas.sum(), rel=0.16)


def test_crowded_sites_go_to_the_widest_gaps():
    """Three crowded sites among many even ones go to the widest gaps, and then no site moves."""
    mesh = subdivided_sphere(4)
    even, moved = cvt.place(mesh, 300, 1, 20, device=DEVICE), [10, 120, 230]
    beside = even[np.arange(300)]
    for site in moved:
        apart = np.linalg.norm(positions(mesh, even) - positions(mesh, even[[site]]), axis=1)
        other = apart.argsort()[150]
        beside.triangle[site], beside.barycentric[site] = even.triangle[other], even.barycentric[other]
    domain = Domain(mesh, 300, device=DEVICE)

    def spread(sites):
        return cvt._spread(domain, cvt._State(domain, CutCells(domain, 300, DEVICE), sites, DEVICE), DEVICE)

    found = spread(beside)
    stays = np.all(positions(mesh, found) == positions(mesh, beside), axis=1)
    assert np.count_nonzero(~stays) == len(moved)
    gaps = np.linalg.norm(positions(mesh, found)[~stays][:, None] - positions(mesh, even)[moved], axis=2)
    spacing = np.sqrt(2.0 * mesh.areas.sum() / (300 * 3.0**0.5))
    assert (gaps.min(axis=0) < 0.5 * spacing).all()
    assert spread(even) is None and spread(found) is None


def _sheet():
    """Return two sheets back to back, far nearer to each other than sites are."""
    square = flat_grid(12)
    vertices = np.concatenate([square.vertices, square.vertices - np.float32([0.0, 0.0, 1e-3])])
    triangles = np.concatenate([square.triangles, square.triangles[:, ::-1] + len(square.vertices)])
    return TriMesh(vertices, triangles.astype(np.int32))


@pytest.mark.parametrize("name", ["sheet", "eared"])
def test_spacing_is_that_of_sites_on_the_same_side(eared, name):
    """The spacing is that of the nearest site, or of the six nearest, on the same side of the same island, by brute
    force.
    """
    mesh = _sheet() if name == "sheet" else eared[0]
    points = sample_surface(mesh, 300, 5)
    domain = Domain(mesh, 300, device=DEVICE)
    sites = voronoi.sites_on(domain, points, DEVICE)
    places, normals = positions(domain.mesh, points), domain.normals[points.triangle]
    islands = domain.islands[points.triangle]
    apart = np.linalg.norm(places[:, None] - places[None], axis=2)
    is_own = (islands[:, None] == islands[None]) & (normals @ normals.T > -1.0 / 3.0)
    np.fill_diagonal(is_own, False)
    own = np.sort(np.where(is_own, apart, np.inf), axis=1)
    np.testing.assert_allclose(sites.gaps.numpy(), own[:, 0], rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(sites.spacings.numpy(), own[:, :6].mean(axis=1), rtol=1e-4)


def test_neighbours_are_the_nearest_in_order_whatever_side_they_are_on():
    mesh = _sheet()
    points = sample_surface(mesh, 300, 6)
    domain = Domain(mesh, 300, device=DEVICE)
    sites = voronoi.sites_on(domain, points, DEVICE)
    places = positions(domain.mesh, points)
    apart = np.sort(np.linalg.norm(places[:, None] - places[None], axis=2), axis=1)
    counts = sites.counts.numpy()
    # The other side has as many sites, so one search is not enough for most sites.
    assert np.median(counts) > voronoi.SITES_AROUND
    for site, count in enumerate(counts):
        around = sites.around.numpy()[site, :count]
        assert len(set(around)) == count and around[0] == site
        np.testing.assert_allclose(sites.apart.numpy()[site, :count], apart[site, :count], rtol=1e-4, atol=1e-6)


def test_a_site_alone_on_its_side_steps_no_farther_than_to_its_neighbours():
    """A site alone on its side has a finite spacing, and the energy can be computed."""
    mesh = _sheet()
    half = len(mesh.triangles) // 2
    points = sample_surface(mesh, 200, 7)
    points = points[points.triangle < half][:50].joined(points[points.triangle >= half][:1])
    sites = voronoi.sites_on(Domain(mesh, 51, device=DEVICE), points, DEVICE)
    assert np.isfinite(sites.gaps.numpy()).all() and (sites.spacings.numpy() > 0.0).all()
