# SPDX-License-Identifier: GPL-3.0-or-later
"""The parts of placement satisfy their laws: springs between sites, farthest points, moves along the surface."""

import numpy as np
import pytest

from hair_addon.core.geometry import mesh as mesh_math
from hair_addon.core.geometry.sampling import sample_surface
from hair_addon.core.placement import cvt
from hair_addon.core.placement.domain import Domain
from hair_addon.core.placement.exact_cells import CutCells
from hair_addon.core.placement.farthest import farthest
from hair_addon.core.placement.preconditioner import Springs
from hair_addon.core.placement.voronoi import sites_on
from tests.support.devices import DEVICE


def springs_between(domain, sites):
    """Return the `Springs` of sites and their state."""
    state = cvt._State(domain, CutCells(domain, len(sites), DEVICE), sites, DEVICE)
    return Springs(sites_on(domain, sites, DEVICE), state.sums.masses, DEVICE), state


def test_springs_pull_alike_in_both_directions(head, scalp):
    """Springs pull alike in both directions and resist every move, so a step that they choose lowers the energy."""
    domain = Domain(head, 300, scalp, device=DEVICE)
    springs, state = springs_between(domain, sample_surface(head, 300, 1, scalp))
    normals = domain.normals[state.sites.triangle]
    moves = np.random.default_rng(1).normal(size=(2, 300, 3))
    moves -= np.einsum("kni,ni->kn", moves, normals)[:, :, None] * normals
    one, other = (springs.pull(move).astype(np.float64) for move in moves)
    np.testing.assert_allclose(np.sum(moves[1] * one), np.sum(moves[0] * other), rtol=1e-3)
    assert np.sum(moves[0] * one) > 0.0
    assert np.sum(state.gradient * springs.moves(state.gradient)) > 0.0


def test_springs_are_near_to_the_hessian(sphere):
    """Springs are near to the Hessian by differences of gradients, for smooth and for rough moves over the sphere."""
    sites = cvt.place(sphere, 300, 1, 40, device=DEVICE)
    domain = Domain(sphere, 300, device=DEVICE)
    springs, state = springs_between(domain, sites)
    normals = domain.normals[sites.triangle]
    random = np.random.default_rng(1)
    smooth = 0.01 * np.sin(3.0 * state.places[:, (1, 2, 0)])
    for moves in (smooth, random.normal(scale=0.002, size=(300, 3))):
        moves = moves - np.einsum("ni,ni->n", moves, normals)[:, None] * normals
        cells = CutCells(domain, 300, DEVICE)
        up, down = (cvt._State(domain, cells, state.stepped(sign * moves), DEVICE) for sign in (1.0, -1.0))
        change = 0.5 * (up.gradient - down.gradient)
        pull = springs.pull(moves)
        likeness = np.sum(change * pull) / np.sqrt(np.sum(change**2) * np.sum(pull**2))
        assert likeness > 0.8
        assert 0.5 < np.sum(moves * change) / np.sum(moves * pull) < 1.2


def test_farthest_points_are_the_farthest(square):
    """Each point is the one farthest from all previous points, by brute force."""
    domain = Domain(square, 50, device=DEVICE)
    points, _ = domain.samples(500, np.random.default_rng(2))
    places = mesh_math.positions(domain.mesh, points).astype(np.float64)
    first = np.sum((places - places[7]) ** 2, axis=1)
    found = farthest(domain, points, first, np.array([20]))
    assert len(found) == 20
    gaps = first
    for point in found:
        assert gaps[point] == pytest.approx(gaps.max(), rel=1e-4)
        gaps = np.minimum(gaps, np.sum((places - places[point]) ** 2, axis=1))


def test_moved_sites_are_at_the_nearest_place(head):
    """Moved sites are at the nearest place, which is searched as far away as the site came from."""
    domain = Domain(head, 100, device=DEVICE)
    sites = sample_surface(domain.mesh, 500, 1)
    places = mesh_math.positions(domain.mesh, sites).astype(np.float64)
    aims = places + np.random.default_rng(1).normal(scale=0.02, size=places.shape)
    expected = mesh_math.positions(domain.mesh, domain.query.nearest(aims))
    found = mesh_math.positions(domain.mesh, domain.moved(sites, aims))
    moved = np.any(found != places.astype(np.float32), axis=1)
    assert moved.mean() > 0.9
    distances = [np.linalg.norm(aims - where, axis=1)[moved] for where in (expected, found)]
    np.testing.assert_allclose(*distances, atol=1e-6)
