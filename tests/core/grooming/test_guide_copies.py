# SPDX-License-Identifier: GPL-3.0-or-later
"""A copied guide has the shape of its source relative to its own surface."""

import numpy as np
import pytest

from hair_addon.core.geometry.mirror import ACROSS_X
from hair_addon.core.grooming.guide_copies import Places, copied, matched, upright_rotations
from hair_addon.core.grooming.guide_shapes import unit
from hair_addon.core.grooming.guide_tool_settings import CopySettings
from tests.support.strands.combed import lengths, segment_lengths, wavy


def a_patch(rng, normal, middle, count=25):
    """Return roots (N, 3) around a middle, across a normal, and the normal of each."""
    spread = rng.normal(0.0, 0.1, (count, 3))
    spread -= np.outer(spread @ normal, normal)
    return spread - spread.mean(axis=0) + middle, np.tile(normal, (count, 1))


def test_a_groom_fitted_to_the_same_patch_elsewhere_is_the_same_groom(rng):
    """A groom fitted to a turned, moved patch of twice the size is the same: each guide has its counterpart's shape."""
    roots, normals = a_patch(rng, unit(np.array([[0.3, 0.1, 0.4]]))[0], [1.0, 0.0, 0.0])
    angle = 0.7
    turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    there = 2.0 * roots @ turn.T + np.array([-3.0, 1.0, 0.5])
    matches = matched(Places(roots, normals), Places(there, normals @ turn.T), "FITTED", ACROSS_X)
    assert np.array_equal(matches.sources, np.arange(25))
    np.testing.assert_allclose(matches.matrices, np.tile(turn, (25, 1, 1)), atol=1e-6)
    points = wavy(rng, 25)
    points += roots[:, None].astype(np.float32) - points[:, :1]
    targets = wavy(rng, 25) - wavy(rng, 25)[:, :1]
    made = copied(targets, points[matches.sources], matches.matrices, CopySettings(), np.ones(25))
    arms = (points - points[:, :1]) @ turn.T.astype(np.float32)
    np.testing.assert_allclose(made - made[:, :1], arms, atol=2e-6)
    assert np.array_equal(made[:, 0], targets[:, 0])


def test_a_mirrored_copy_of_an_image_is_the_image(rng):
    roots, normals = a_patch(rng, unit(np.array([[0.8, 0.1, 0.4]]))[0], [1.0, 0.0, 0.0])
    flip = np.array([-1.0, 1.0, 1.0])
    matches = matched(Places(roots, normals), Places(roots * flip, normals * flip), "MIRRORED", ACROSS_X)
    assert np.array_equal(matches.sources, np.arange(25))
    np.testing.assert_allclose(matches.matrices, np.tile(np.diag(flip), (25, 1, 1)), atol=1e-6)


def test_nearest_is_by_brute_force(rng):
    sources, targets = rng.normal(size=(40, 3)), rng.normal(size=(70, 3))
    normals = unit(rng.normal(size=(110, 3)))
    matches = matched(Places(sources, normals[:40]), Places(targets, normals[40:]), "NEAREST", ACROSS_X)
    assert np.array_equal(matches.sources, np.linalg.norm(targets[:, None] - sources[None], axis=2).argmin(axis=1))
    turned = np.einsum("nij,nj->ni", matches.matrices, normals[:40][matches.sources])
    np.testing.assert_allclose(turned, normals[40:], atol=1e-6)
    np.testing.assert_allclose(np.linalg.det(matches.matrices), 1.0, atol=1e-9)


def test_what_hangs_down_on_one_side_of_a_head_hangs_down_on_the_other(rng):
    start = unit(np.array([[0.95, 0.1, 0.3], [1.0, 0.0, 0.0], [0.7, -0.6, -0.2]]))
    end = unit(np.array([[-0.95, 0.12, 0.28], [-1.0, 0.0, 0.0], [-0.5, 0.8, 0.1]]))
    down = np.array([0.0, 0.0, -1.0])
    for turn, before, after in zip(upright_rotations(start, end), start, end, strict=True):
        hanging = unit(down - (down @ before) * before)
        np.testing.assert_allclose(turn @ before, after, atol=1e-6)
        np.testing.assert_allclose(turn @ hanging, unit(down - (down @ after) * after), atol=1e-6)


@pytest.mark.parametrize("copy_length", [True, False])
def test_lengths_are_copied_or_kept(rng, copy_length):
    points, sources = wavy(rng), wavy(rng)
    identity = np.tile(np.eye(3), (30, 1, 1))
    made = copied(points, sources, identity, CopySettings(copy_length=copy_length), np.ones(30))
    np.testing.assert_allclose(lengths(made), lengths(sources if copy_length else points), rtol=1e-5)


def test_amount_and_weights_are_shares_and_none_changes_nothing(rng):
    points, sources, identity = wavy(rng), wavy(rng), np.tile(np.eye(3), (30, 1, 1))
    weights = np.where(np.arange(30) % 2, 0.6, 0.0)
    made = copied(points, sources, identity, CopySettings(amount=0.5), weights)
    assert np.array_equal(made[::2], points[::2])
    wanted = segment_lengths(points) + 0.3 * (segment_lengths(sources) - segment_lengths(points))
    np.testing.assert_allclose(segment_lengths(made)[1::2], wanted[1::2], rtol=1e-4)
    once_more = copied(points, points, identity, CopySettings(), np.ones(30))
    np.testing.assert_allclose(once_more, points, atol=1e-6)


def test_a_single_guide_is_a_region(rng):
    up = np.array([[0.0, 0.0, 1.0]])
    matches = matched(
        Places(np.zeros((1, 3)), up), Places(rng.normal(size=(5, 3)), np.tile(up, (5, 1))), "FITTED", ACROSS_X
    )
    assert not matches.sources.any()
    matches = matched(
        Places(rng.normal(size=(5, 3)), np.tile(up, (5, 1))), Places(np.zeros((1, 3)), up), "FITTED", ACROSS_X
    )
    assert np.isfinite(matches.matrices).all()
