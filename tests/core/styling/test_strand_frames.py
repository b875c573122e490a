# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames in which styles act are least rotations, smooth over the surface, and shared within a clump."""

import numpy as np
import pytest

from hair_addon.core.geometry.affine import Affine
from hair_addon.core.grooming import style_binding
from hair_addon.core.styling import bend, curl
from tests.support.dynamics.stepped import UP, curved_strands, rotation, stepped, straight_strands
from tests.support.strands.styled import straight

SMALL = 1e-3  # [rad], of the bends by which frames are read


def turned(u, a, b):
    """Return vectors (…, 3), across unit vectors a, turned by the least rotation from a to b."""
    return u - (a + b) * ((u * b).sum(-1) / (1.0 + (a * b).sum(-1)))[..., None]


def reference(normal):
    """Return (…, 3): r(n), across n."""
    x, y, z = np.moveaxis(normal, -1, 0)
    return np.stack([1.0 - x * x / (1.0 + z), -x * y / (1.0 + z), -x], axis=-1)


def directions(points):
    segments = np.diff(points.astype(np.float64), axis=-2)
    return segments / np.linalg.norm(segments, axis=-1, keepdims=True)


def transported(points, normals, centre_normals):
    """Return (S, P-1, 3): u_i of strands by the definition."""
    t = directions(points)
    u = turned(reference(centre_normals), centre_normals, normals)
    found, before = [], normals
    for i in range(t.shape[1]):
        u = turned(u, before, t[:, i])
        found.append(u)
        before = t[:, i]
    return np.stack(found, axis=1)


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def read_frames(strands, **where):
    """Return (S, P-1, 3): the u_i of the kernel's bends, up to a turn about the strand that all segments share."""
    settings = bend.Settings(angle=SMALL, root=1.0, tip=1.0)
    before, after = directions(strands), directions(stepped(strands, settings, **where))
    return unit(after - before * (after * before).sum(axis=-1, keepdims=True))


def test_frames_are_transported_by_least_rotations(rng):
    """Frames are transported by least rotations: bends have one angle to the frames of the definition along each
    strand.
    """
    strands = curved_strands(rng, 40)
    normals = unit(rng.normal(UP, 0.3, (40, 3)))
    u = transported(strands, normals, normals)
    v = np.cross(directions(strands), u)
    found = read_frames(strands, normals=normals, members=np.arange(40), centre_normals=normals)
    psi = np.stack([(found * u).sum(-1), (found * v).sum(-1)], axis=-1)
    np.testing.assert_allclose(np.linalg.norm(psi, axis=-1), 1.0, atol=2e-3)
    assert np.linalg.norm(psi - psi.mean(axis=1, keepdims=True), axis=-1).max() < 0.03


def phases(normals, centre_normals=None, axes=None):
    """Return (N, 3) displacements by a wave of straight strands along normals (N, 3), each in its own clump's frame.

    centre_normals: (1, 3) of the one clump that all are in.
    """
    count = len(normals)
    strands = (normals[:, None] * np.linspace(0.0, 0.2, 41)[None, :, None]).astype(np.float32)
    settings = curl.Settings(
        radius=1e-3, pitch=0.1, coherence=1.0, left_handed=0.0, root=1.0, tip=1.0, start=0.0, flatness=1.0
    )
    made = stepped(
        strands,
        settings,
        normals=normals,
        centre_normals=normals if centre_normals is None else centre_normals,
        members=np.arange(count) if centre_normals is None else None,
        centres=strands if centre_normals is None else strands[:1],
        axes=axes,
    )
    away = (made - strands).astype(np.float64)
    away -= normals[:, None] * (away * normals[:, None]).sum(axis=2, keepdims=True)
    farthest = (np.linalg.norm(away, axis=2) + 1e-5 * np.arange(41)).argmax(axis=1)  # of equals the last
    return away[np.arange(count), farthest]


def test_frames_are_smooth_over_the_surface():
    """Strands in one phase are displaced alike up to the turn between their normals, except straight below."""
    angles = np.linspace(0.0, 2.0 * np.pi, 200)
    for polar in (0.3, 1.2, 2.0, 2.8):
        normals = np.stack(
            [np.sin(polar) * np.cos(angles), np.sin(polar) * np.sin(angles), np.full(200, np.cos(polar))], axis=1
        )
        step = np.linalg.norm(np.diff(reference(normals), axis=0), axis=1).max()
        assert step < 0.2
        np.testing.assert_allclose((reference(normals) * normals).sum(axis=1), 0.0, atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(reference(normals), axis=1), 1.0, atol=1e-12)


def test_strands_of_a_clump_share_its_frame(rng):
    """Strands are displaced by the least rotation from the center's frame, also where normals differ much."""
    normals = unit(rng.normal((0.0, 0.3, 1.0), 0.4, (50, 3)))
    centre = unit(np.array([[0.1, 0.2, 1.0]]))
    found = unit(phases(normals, centre))
    first = unit(phases(centre, centre))
    np.testing.assert_allclose(
        found, unit(turned(np.repeat(first, 50, 0), np.repeat(centre, 50, 0), normals)), atol=2e-3
    )


@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.0, 1e-4, -1.0)])
def test_frames_exist_everywhere(normal):
    found = phases(unit(np.array([normal])))
    assert np.isfinite(found).all()
    assert np.linalg.norm(found) > 1e-4


def test_frames_turn_with_the_surface(rng):
    normals = unit(rng.normal(UP, 0.4, (50, 3)))
    turn = rotation(rng)
    axes = style_binding.own_axes(Affine.linear(turn).matrix)
    np.testing.assert_allclose(unit(phases(normals @ turn.T, None, axes)), unit(phases(normals)) @ turn.T, atol=1e-3)


def test_a_straight_strand_along_its_normal_has_the_reference(rng):
    normals = unit(rng.normal(UP, 0.5, (30, 3)))
    strands = straight_strands(30, 0.2, 41, 0.0)
    strands[:] = normals[:, None] * np.linspace(0.0, 0.2, 41)[None, :, None]
    found = read_frames(strands, normals=normals, members=np.arange(30), centre_normals=normals, centres=strands)
    np.testing.assert_allclose(found, np.repeat(reference(normals)[:, None], 40, axis=1), atol=0.01)


def spread(vectors):
    """Return the part of unit vectors (S, 3) that their mean lacks: 0 where all are alike."""
    return 1.0 - np.linalg.norm(vectors.mean(axis=0))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_hair_against_the_normals_is_as_coherent_as_hair_along_them(sign, rng):
    """On an inside-out surface strands of one guide are displaced alike."""
    hair = straight(600)
    tilts = rng.normal(0.0, 0.15, (len(hair.guides), 1, 2))
    along = np.linspace(0.0, 1.0, hair.guides.point_count)[None, :, None] * 0.2
    shape = np.concatenate(
        [along * tilts, np.broadcast_to(sign * along, (*tilts.shape[:1], along.shape[1], 1))], axis=2
    )
    hair.guides = hair.guides.moved((hair.guides.numpy()[:, :1] + shape).astype(np.float32))
    settings = curl.Settings(radius=2e-3, pitch=0.1, coherence=1.0, flatness=1.0, root=1.0, tip=1.0, start=0.0)
    away = hair.styled(settings) - hair.plain
    first = hair.binding.guide_weights.indices.numpy()[:, 0]
    assert first.max() > 10
    for guide in np.unique(first):
        assert spread(unit(away[first == guide, 12].astype(np.float64))) < 0.05
