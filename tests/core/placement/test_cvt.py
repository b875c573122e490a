# SPDX-License-Identifier: GPL-3.0-or-later
"""Relaxation never raises the energy, keeps sites on their surface, and ends with evenly placed sites."""

import os
from functools import partial

import numpy as np
import pytest
from scipy.spatial import cKDTree

from hair_addon.core.errors import HairError
from hair_addon.core.geometry import mesh as mesh_math
from hair_addon.core.geometry.curvature import bend_density
from hair_addon.core.geometry.faces.uv_maps import Texture
from hair_addon.core.geometry.mesh import SurfacePoints, TriMesh
from hair_addon.core.geometry.mirror import Mirror
from hair_addon.core.geometry.sampling import sample_surface
from hair_addon.core.placement import cvt, voronoi
from hair_addon.core.placement.domain import Domain
from hair_addon.core.placement.exact_cells import CutCells
from hair_addon.core.placement.voronoi import sites_on
from tests.support.devices import DEVICE
from tests.support.meshes import subdivided_sphere
from tests.support.pairs import share_of
from tests.support.strands import evenness

relax = partial(evenness.relax, device=DEVICE)
measure = partial(evenness.measure, device=DEVICE)
place = partial(cvt.place, device=DEVICE)


def relaxed(mesh, count, iterations, density=None, seed=1):
    return relax(mesh, sample_surface(mesh, count, seed, density), iterations, density)


def on_square(places):
    """Return `SurfacePoints` at places (N, 2) on a square of two triangles, and the square."""
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], np.float32)
    mesh = TriMesh(corners, np.array([(0, 1, 2), (0, 2, 3)], np.int32))
    x, y = np.asarray(places, np.float64).T
    lower = np.stack([1 - x, x - y, y], axis=1)
    upper = np.stack([1 - y, x, y - x], axis=1)
    is_upper = y > x
    return mesh, SurfacePoints(is_upper.astype(np.int32), np.where(is_upper[:, None], upper, lower).astype(np.float32))


@pytest.fixture(scope="session")
def surfaces(head, scalp, sphere, square):
    """Return (mesh, density) of different kinds: a mask, closed and uniform, open with a density that falls to zero."""
    return {"scalp": (head, scalp), "sphere": (sphere, None), "square": (square, square.vertices[:, 0])}


@pytest.mark.parametrize("name", ["scalp", "sphere", "square"])
@pytest.mark.parametrize("count", [1, 7, 200])
def test_energy_never_rises(surfaces, name, count):
    mesh, density = surfaces[name]
    energies = relaxed(mesh, count, 40, density).energies
    assert 1 < len(energies) <= 41  # fewer where sites rest
    assert np.all(np.diff(energies) <= 0.0)


@pytest.mark.parametrize("name", ["scalp", "sphere", "square"])
def test_sites_stay_on_the_surface_where_there_is_density(surfaces, name):
    mesh, density = surfaces[name]
    sites = relaxed(mesh, 200, 30, density).sites
    assert len(sites) == 200
    assert sites.triangle.dtype == np.int32 and sites.barycentric.dtype == np.float32
    assert sites.barycentric.min() >= -1e-6
    np.testing.assert_allclose(sites.barycentric.sum(axis=1), 1.0, atol=1e-6)
    assert np.all(mesh.areas[sites.triangle] > 0.0)
    if density is not None:
        assert mesh_math.interpolate(density, mesh, sites).min() > 0.0


def test_sites_do_not_leave_their_islands(square):
    """Sites do not leave their islands, with density only in two far corners."""
    x, y, _ = square.vertices.T
    density = ((np.maximum(x, y) < 0.3) | (np.minimum(x, y) > 0.7)).astype(float)
    sites = relaxed(square, 20, 30, density).sites
    assert np.all(density[square.triangles[sites.triangle]].any(axis=1))


def test_sites_do_not_stop_where_density_ends(square):
    """Sites do not stop at density zero, at the border of a ring whose centroid is in its hole."""
    radius = np.linalg.norm(square.vertices[:, :2] - 0.5, axis=1)
    ring = ((radius > 0.25) & (radius < 0.45)).astype(float)
    for seed in range(5):
        site = relaxed(square, 1, 20, ring, seed).sites
        assert mesh_math.interpolate(ring, square, site).min() > 0.0


def test_energy_is_the_integral(sphere):
    """The energy equals a sum over a million random points, with the nearest sites found by another method."""
    sites = sample_surface(sphere, 50, seed=3)
    points = mesh_math.positions(sphere, sample_surface(sphere, 1_000_000, seed=4))
    distances, _ = cKDTree(mesh_math.positions(sphere, sites)).query(points)
    energy = relax(sphere, sites, 0).energies[0]
    np.testing.assert_allclose(energy, sphere.areas.sum() * np.mean(distances**2), rtol=5e-3)


def test_energy_of_a_square_lattice():
    """The energy of a square lattice is 3.9 % above the hexagons', by a second moment of a sixth of its area
    squared.
    """
    middles = (np.indices((12, 12)).reshape(2, -1).T + 0.5) / 12.0
    quality = measure(*on_square(middles))
    np.testing.assert_allclose(quality.relative_energy, (1.0 / 6.0) / (5.0 / (18.0 * 3.0**0.5)), rtol=5e-3)
    assert quality.share_variation < 0.02


def test_one_site_goes_to_the_centre():
    mesh, site = on_square([(0.1, 0.2)])
    centre = mesh_math.positions(mesh, relax(mesh, site, 5).sites)
    np.testing.assert_allclose(centre, [(0.5, 0.5, 0.0)], atol=1e-5)


def test_four_sites_share_a_square():
    mesh, sites = on_square([(0.2, 0.3), (0.6, 0.1), (0.7, 0.8), (0.1, 0.9)])
    places = mesh_math.positions(mesh, relax(mesh, sites, 100).sites)
    np.testing.assert_allclose(places[:, :2], [(0.25, 0.25), (0.75, 0.25), (0.75, 0.75), (0.25, 0.75)], atol=0.02)


@pytest.mark.parametrize(
    ("name", "energy", "variation"), [("sphere", 1.03, 0.08), ("scalp", 1.02, 0.12), ("square", 1.08, 0.14)]
)
def test_converged_sites_are_even(surfaces, name, energy, variation):
    """200 converged sites are within a few percent of the best possible energy, random sites at twice that.

    The square's border costs energy, as cells along it are not hexagons.
    """
    mesh, density = surfaces[name]
    start = sample_surface(mesh, 200, 1, density)
    before = measure(mesh, start, density)
    after = measure(mesh, relax(mesh, start, 100, density).sites, density)
    assert before.relative_energy > 1.8 and before.share_variation > 0.4
    assert after.relative_energy < energy and after.share_variation < variation


def test_sites_follow_the_density(square):
    """Sites follow a density that rises from left to right: the mean of x is 2/3, and a quarter of them is in the
    left half.
    """
    x = mesh_math.positions(square, relaxed(square, 400, 100, square.vertices[:, 0]).sites)[:, 0]
    assert abs(x.mean() - 2.0 / 3.0) < 0.01
    assert abs(np.mean(x < 0.5) - 0.25) < 0.03


def test_relaxed_sites_rest(sphere):
    first = relaxed(sphere, 100, 200)
    again = relax(sphere, first.sites, 10)
    assert again.energies[-1] > 0.998 * first.energies[-1]


def test_the_same_sites_twice(head, scalp):
    first, again = relaxed(head, 100, 10, scalp), relaxed(head, 100, 10, scalp)
    np.testing.assert_array_equal(first.sites.triangle, again.sites.triangle)
    np.testing.assert_array_equal(first.sites.barycentric, again.sites.barycentric)


@pytest.mark.parametrize("scale", [2.0**-20, 2.0**20])
def test_size_does_not_matter(sphere, scale):
    large = TriMesh(np.float32(scale) * sphere.vertices, sphere.triangles)
    expected, found = relaxed(sphere, 60, 20), relaxed(large, 60, 20)
    np.testing.assert_array_equal(found.sites.triangle, expected.sites.triangle)
    np.testing.assert_allclose(found.energies, scale**4 * expected.energies, rtol=1e-6)


def test_a_site_with_an_empty_cell_keeps_its_place(sphere):
    """A site with an empty cell keeps its place; among sites at one place, the first one gets the cell."""
    site = sample_surface(sphere, 1, seed=1)
    twins = SurfacePoints(np.repeat(site.triangle, 40), np.repeat(site.barycentric, 40, axis=0))
    others = sample_surface(sphere, 5, seed=2)
    sites = SurfacePoints(
        np.concatenate([twins.triangle, others.triangle]), np.concatenate([twins.barycentric, others.barycentric])
    )
    moved = relax(sphere, sites, 1).sites
    np.testing.assert_array_equal(moved.barycentric[1:40], twins.barycentric[1:])
    assert np.any(moved.barycentric[0] != twins.barycentric[0])


def test_cells_do_not_depend_on_how_far_neighbours_are_known(head, scalp, monkeypatch):
    """Cells do not depend on the number of known neighbors: with two per site, all sites are searched for the
    others.
    """
    sites = sample_surface(head, 150, 5, scalp)
    expected = relax(head, sites, 0, scalp).energies
    monkeypatch.setattr(voronoi, "SITES_AROUND", 2)
    np.testing.assert_allclose(relax(head, sites, 0, scalp).energies, expected, rtol=1e-6)


def test_triangles_without_area_are_passed_over(sphere):
    broken = np.concatenate([[(0, 0, 1), (5, 5, 5)], sphere.triangles]).astype(np.int32)
    whole, pierced = relaxed(sphere, 50, 10), relaxed(TriMesh(sphere.vertices, broken), 50, 10)
    np.testing.assert_array_equal(pierced.sites.triangle, whole.sites.triangle + 2)


def test_a_gradient_is_the_slope_of_the_energy(square):
    """The gradient is the slope of the energy by finite differences of sites, on a plane, where nothing is
    projected.
    """
    sites = sample_surface(square, 40, seed=6)
    domain = Domain(square, 40, square.vertices[:, 0], device=DEVICE)
    cells = CutCells(domain, 40, DEVICE)
    state = cvt._State(domain, cells, sites, DEVICE)
    for axis in range(2):
        step = np.zeros((40, 3))
        step[:, axis] = 1e-3
        up, down = (cvt._State(domain, cells, state.stepped(sign * step), DEVICE).energy for sign in (1.0, -1.0))
        np.testing.assert_allclose((up - down) / 2e-3, state.gradient[:, axis].sum(), rtol=5e-3)
    for site in range(0, 40, 7):
        step = np.zeros((40, 3))
        step[site] = (2e-3, 1e-3, 0.0)
        up, down = (cvt._State(domain, cells, state.stepped(sign * step), DEVICE).energy for sign in (1.0, -1.0))
        np.testing.assert_allclose((up - down) / 2.0, state.gradient[site] @ step[site], rtol=2e-2, atol=1e-9)


def test_cells_share_the_surface_without_gap_or_overlap(surfaces):
    for mesh, density in surfaces.values():
        sites = sample_surface(mesh, 300, 2, density)
        domain = Domain(mesh, 300, density, device=DEVICE)
        sums = CutCells(domain, 300, DEVICE).sums(sites_on(domain, sites, DEVICE))
        np.testing.assert_allclose(sums.masses.sum(), 1.0, rtol=1e-6)


@pytest.mark.parametrize("name", ["scalp", "sphere", "square"])
def test_energy_is_below_lloyds_from_the_same_start(surfaces, name):
    mesh, density = surfaces[name]
    sites = sample_surface(mesh, 300, 1, density)
    learned, lloyd = (relax(mesh, sites, 30, density, steps_kept=kept).energies for kept in (cvt.STEPS_KEPT, 0))
    assert learned[-1] < lloyd[-1] < lloyd[0]


@pytest.mark.parametrize("name", share_of(["scalp", "sphere", "square"], 2))
def test_placed_sites_are_even(surfaces, name):
    """Sites placed by a dozen rounds from coarse to fine are more even than by forty of Lloyd's."""
    mesh, density = surfaces[name]
    sites = place(mesh, 600, 1, 12, density=density)
    lloyd = relax(mesh, sample_surface(mesh, 600, 1, density), 40, density, steps_kept=0).sites
    placed, relaxed_only = measure(mesh, sites, density), measure(mesh, lloyd, density)
    assert len(sites) == 600
    assert placed.relative_energy < relaxed_only.relative_energy
    assert placed.share_variation < 0.12


@pytest.mark.parametrize("count", share_of([1, 2, 3, 5, 17, 99, 100, 101, 250, 777], 2))
def test_as_many_sites_as_asked_for(surfaces, count):
    for mesh, density in surfaces.values():
        sites = place(mesh, count, 3, 3, density=density)
        places = mesh_math.positions(mesh, sites)
        assert len(sites) == count
        assert len(np.unique(places, axis=0)) == count  # no two in one place
        if density is not None:
            assert mesh_math.interpolate(density, mesh, sites).min() > 0.0


def test_placed_sites_are_the_same_bits_twice(head, scalp):
    first, again = (place(head, 300, 4, 5, density=scalp) for _ in range(2))
    np.testing.assert_array_equal(first.triangle, again.triangle)
    np.testing.assert_array_equal(first.barycentric, again.barycentric)
    other = place(head, 300, 5, 5, density=scalp)
    assert np.any(first.barycentric != other.barycentric)


def test_threads_do_not_change_a_bit(head, scalp, monkeypatch):
    found = []
    for count in (1, 5):
        monkeypatch.setattr(os, "process_cpu_count", lambda count=count: count)
        found.append(place(head, 300, 4, 5, density=scalp).barycentric)
    np.testing.assert_array_equal(*found)


def test_density_is_followed_twenty_to_one(square):
    """Twenty times the density on one half gives twenty times as many sites there, with even shares.

    The sparse half is ten sites wide, so borders count.
    """
    left = square.vertices[:, 0] < 0.5
    density, ratios = np.where(left, 20.0, 1.0), []
    for seed in range(3):
        sites = place(square, 2100, seed, 12, density=density)
        x = mesh_math.positions(square, sites)[:, 0]
        ratios.append(np.count_nonzero(x < 0.45) / np.count_nonzero(x > 0.55))
        assert measure(square, sites, density).share_variation < 0.09
    assert np.mean(ratios) == pytest.approx(20.0, rel=0.15)


def test_islands_have_their_shares(sphere):
    """Three separate spheres of radii 1, 2 and 3 have shares of 1, 4 and 9."""
    radii = np.array([1.0, 2.0, 3.0])
    vertices = np.concatenate([r * sphere.vertices + (10.0 * i, 0.0, 0.0) for i, r in enumerate(radii)])
    triangles = np.concatenate([sphere.triangles + i * len(sphere.vertices) for i in range(3)])
    sites = place(TriMesh(vertices.astype(np.float32), triangles.astype(np.int32)), 700, 1, 6)
    found = np.bincount(sites.triangle // len(sphere.triangles), minlength=3)
    np.testing.assert_allclose(found, 700 * radii**2 / 14.0, atol=3)


def test_two_sides_of_a_thin_part_are_no_neighbours(square):
    """Two sides of a thin part are no neighbors: sheets a fraction of a spacing apart are divided as if each were
    alone.
    """
    vertices = np.concatenate([square.vertices, square.vertices - np.float32([0.0, 0.0, 1e-3])])
    triangles = np.concatenate([square.triangles, square.triangles[:, ::-1] + len(square.vertices)])
    mesh = TriMesh(vertices, triangles.astype(np.int32))
    sites = place(mesh, 400, 1, 12)
    is_upper = sites.triangle < len(square.triangles)
    assert abs(np.count_nonzero(is_upper) - 200) <= 2
    for side in (is_upper, ~is_upper):
        points = mesh_math.positions(mesh, sites[side])
        gaps, _ = cKDTree(points).query(points, k=2)
        assert gaps[:, 1].min() > 0.6 * np.sqrt(2.0 / 3.0**0.5 / 200.0)


def test_a_closed_thin_box_keeps_its_sides_apart(square):
    """A closed thin box keeps its sides apart by normals, as its vertices are connected."""
    fold = np.float32(2e-3)
    x, y, _ = square.vertices.T
    folded = np.stack([np.abs(x - 0.5), y, np.where(x < 0.5, -fold, fold)], axis=1).astype(np.float32)
    mesh = TriMesh(folded, square.triangles)
    domain = Domain(mesh, 200, device=DEVICE)
    sites = place(mesh, 200, 1, 12)
    cells = CutCells(domain, 200, DEVICE)
    cells.sums(sites_on(domain, sites, DEVICE))
    owners = cells._cells.numpy()
    one = domain.normals[domain.parts.triangle][:, 2]
    other = domain.normals[sites.triangle][owners][:, 2]
    flat = np.abs(one) > 0.9
    assert np.mean(one[flat] * other[flat] < -0.3) < 0.02


@pytest.mark.parametrize("count", [1, 2, 9, 200])
def test_symmetric_sites_are_images(sphere, count):
    mirror = Mirror(np.array([1.0, 0.0, 0.0]))
    sites = place(sphere, count, 1, 12, mirror=mirror)
    places = mesh_math.positions(sphere, sites)
    assert len(sites) == count
    half = count - count // 2
    np.testing.assert_allclose(mirror.image(places[: count // 2]), places[half:], atol=2e-3)
    if count > 1 and count % 2:
        assert abs(places[half - 1, 0]) < 2e-3
    if count == 200:
        # Scarcely worse than without: half of the surface is a problem of its own.
        assert measure(sphere, sites).share_variation < 0.09


def test_curvature_draws_sites_to_where_a_surface_bends():
    """Curvature draws sites to where a surface bends: the ends of a capsule bend twice as much as its middle."""
    ball = subdivided_sphere(4)
    shift = np.where(ball.vertices[:, :1] > 0.0, 2.0, -2.0) * np.float32([1.0, 0.0, 0.0])
    capsule = TriMesh((ball.vertices + shift).astype(np.float32), ball.triangles)
    density = bend_density(capsule, 5.0)
    shares = []
    for weights in (None, density):
        x = mesh_math.positions(capsule, place(capsule, 400, 1, 12, density=weights))[:, 0]
        shares.append(np.mean(np.abs(x) > 2.2))
    assert shares[1] > 1.15 * shares[0]


def test_an_image_is_followed(square):
    """Sites follow an image: white in one corner of the UV map, a tenth as bright elsewhere, and black in another
    corner.
    """
    corner_uvs = square.vertices[square.triangles][:, :, :2]
    values = np.full((32, 32), 0.1, np.float32)
    values[:16, :16], values[16:, 16:] = 1.0, 0.0
    sites = place(square, 600, 1, 12, texture=Texture(values, corner_uvs))
    x, y, _ = mesh_math.positions(square, sites).T
    bright, black = (x < 0.48) & (y < 0.48), (np.minimum(x, y) > 0.54) & (np.maximum(x, y) < 0.97)  # it repeats
    assert not black.any()
    assert bright.mean() == pytest.approx(0.48**2 / 0.3, abs=0.04)


def test_a_black_image_is_refused(square):
    texture = Texture(np.zeros((4, 4), np.float32), square.vertices[square.triangles][:, :, :2])
    with pytest.raises(HairError, match="zero everywhere"):
        place(square, 10, 1, 3, texture=texture)


def test_one_guide_is_placed_where_the_share_of_the_area_is_on_a_small_island(device):
    """One guide is placed at the right share of the area on a small island, where few starts have a point."""
    triangle = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    vertices = np.concatenate([size * triangle + [3 * i, 0, 0] for i, size in enumerate((1.0, 0.25, 1.0))])
    islands = TriMesh(vertices.astype(np.float32), np.arange(9, dtype=np.int32).reshape(3, 3))
    for seed in range(8):
        assert len(cvt.place(islands, 1, seed, 4, device=device)) == 1
