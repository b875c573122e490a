# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides derived from hair are existing strands, fitted by least squares, with correct error estimates."""

import numpy as np
import pytest

from hair_addon.core.geometry import strands
from hair_addon.core.grooming import following, groom, groom_defaults
from hair_addon.core.grooming.derived_guides import derive, representatives
from hair_addon.core.grooming.groom import HairSettings
from hair_addon.core.interpolation import guide_fitting, interpolation
from tests.support.meshes import subdivided_sphere
from tests.support.strands.combed import lengths, standing

STRANDS = 400


@pytest.fixture(scope="module")
def mesh():
    return subdivided_sphere(3)


@pytest.fixture(scope="module")
def hair(mesh):
    """Return (S, 41, 3) strands between 25 guides, and their roots: hair that guides can reproduce."""
    return strands_between_guides(mesh, 0.3)


def strands_between_guides(mesh, length):
    points, roots, _ = standing(mesh, 25, np.random.Generator(np.random.PCG64(7)), length, point_count=41)
    settings = complete(mesh, 25)
    binding = groom.bind_hair(mesh, strands.from_numpy(points, roots), settings)
    return following.follow_guides(binding, strands.from_numpy(points, roots)).numpy(), binding.roots


def complete(mesh, guide_count, **changes):
    return groom_defaults.complete(HairSettings(strand_count=STRANDS, **changes), mesh, None, None, guide_count)


def test_errors_are_those_of_what_the_guides_grow(mesh, hair):
    points, roots = hair
    settings = complete(mesh, 30)
    derived = derive(mesh, points, roots, settings, 30)
    binding = groom.bind_hair(mesh, derived.guides, settings, roots=roots)
    grown = following.follow_guides(binding, derived.guides).numpy()
    apart = np.sqrt(np.mean(np.sum((grown - points) ** 2, axis=2), axis=1)) / lengths(points)
    np.testing.assert_allclose(derived.errors, apart, atol=1e-6)
    assert derived.mean_error == pytest.approx(np.sqrt(np.mean(apart**2)), abs=1e-6)
    assert np.mean(derived.errors <= derived.high_error) == pytest.approx(0.95, abs=0.01)
    assert derived.mean_error < 0.1  # the strands' own guides stood elsewhere


@pytest.mark.parametrize("length", [0.3, 3.0])
def test_more_guides_come_closer_and_the_fit_comes_closer_than_the_strands_themselves(mesh, length):
    """Also for hair so long that turns of strands are limited, which the fit ignores."""
    points, roots = strands_between_guides(mesh, length)
    few, more = (derive(mesh, points, roots, complete(mesh, count), count) for count in (15, 60))
    assert more.mean_error < 0.65 * few.mean_error
    unfitted = strands.from_numpy(points[few.sources], roots[few.sources])
    grown = following.follow_guides(few.binding, unfitted).numpy()
    errors = np.sqrt(np.mean(np.sum((grown - points) ** 2, axis=2), axis=1)) / lengths(points)
    assert few.mean_error < 0.9 * np.sqrt(np.mean(errors**2))


def test_guides_of_hair_that_is_one_strand_everywhere_reproduce_it(mesh):
    """Guides of straight hair of one length along the normals reproduce it."""
    points, roots, _ = standing(mesh, 200, np.random.Generator(np.random.PCG64(3)), spread=0.0, point_count=41)
    derived = derive(mesh, points, roots, complete(mesh, 6), 6)
    assert derived.errors.max() < 2e-3  # frames turn rigidly, normals across flat faces do not


def test_the_fit_is_the_least_squares_of_interpolation(mesh, hair):
    """The fit agrees with least squares by brute force, as interpolation is linear in each coordinate of each guide.

    So it is for short guides: the turn of longer ones is limited by their lengths.
    """
    points, roots = (part[:60] for part in hair)
    guides, own = hair[0][60:66, :3], hair[1][60:66]
    settings = complete(mesh, 6, keep_length=0.0, angle_limit=np.pi, length_limit=1e6)
    binding = groom.bind_hair(mesh, strands.from_numpy(guides, own), settings, roots=roots)
    weights = following.weights_now(binding, strands.from_numpy(guides, own))

    def grown(arms):
        at = strands.from_numpy((guides[:, :1] + arms).astype(np.float32), own)
        made = interpolation.interpolate(
            binding.positions, binding.normals, at.points, binding.guide_normals, weights, 0.0
        ).numpy()
        return made[:, -1] - made[:, 0]

    zero, columns = np.zeros_like(guides), []
    for guide in range(6):
        for axis in range(3):
            unit = zero.copy()
            unit[guide, 1:, axis] = 1e-3
            columns.append(1e3 * grown(unit).ravel())
    matrix = np.stack(columns, axis=1).astype(np.float64)
    wanted = points[:, 40] - points[:, 0]
    held = guides - guides[:, :1]
    # The hold of a guide is a fraction of its own weight: of the squares in its columns.
    hold = guide_fitting._HOLD * np.repeat((matrix**2).sum(axis=0).reshape(6, 3).mean(axis=1), 3)
    best = np.linalg.solve(
        matrix.T @ matrix + np.diag(hold), matrix.T @ wanted.ravel() + hold * held[:, 2].astype(np.float64).ravel()
    )
    arms = np.ascontiguousarray(np.repeat(wanted[:, None], 3, axis=1) * np.float32([0, 1, 1])[:, None])
    found = guide_fitting.fitted(binding, weights, arms, np.ascontiguousarray(held), np.arange(60))
    np.testing.assert_allclose(found[:, 2].ravel(), best, atol=2e-4)


def test_representatives_are_strands_spread_over_roots_and_shapes(mesh, hair):
    points, _roots = hair
    found = representatives(points, 40)
    assert len(found) == len(set(found.tolist())) == 40
    assert np.array_equal(found, np.sort(found))
    assert np.array_equal(representatives(points, STRANDS), np.arange(STRANDS))
    apart = np.linalg.norm(points[:, None, 0] - points[None, found, 0], axis=2).min(axis=1)
    some = np.random.Generator(np.random.PCG64(1)).permutation(STRANDS)[:40]
    at_random = np.linalg.norm(points[:, None, 0] - points[None, some, 0], axis=2).min(axis=1)
    assert apart.max() < 0.8 * at_random.max()


def test_two_shapes_on_the_same_roots_both_have_a_representative(mesh):
    points, _roots, _up = standing(mesh, 30, np.random.Generator(np.random.PCG64(2)), spread=0.0, point_count=9)
    bent = points + (np.linspace(0.0, 1.0, 9) ** 2)[None, :, None] * np.float32([1.0, 0.0, 0.0])
    found = representatives(np.concatenate([points[:1].repeat(30, axis=0), bent[:1].repeat(30, axis=0)]), 2)
    assert (found < 30).sum() == 1
