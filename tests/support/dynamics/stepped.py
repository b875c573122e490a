# SPDX-License-Identifier: GPL-3.0-or-later
"""Styles on strands given as arrays, without a surface or guides."""

import numpy as np
import warp as wp

from hair_addon.core.geometry.strands import segment_lengths
from hair_addon.core.styling import program as programs
from hair_addon.core.styling import steps
from tests.support.devices import DEVICE

UP = np.array([0.0, 0.0, 1.0])


def stepped(
    points,
    *styles,
    normals=UP,
    identities=None,
    weights=None,
    members=None,
    centres=None,
    centre_normals=UP,
    axes=None,
    cutters=None,
    device=DEVICE,
    **launch,
):
    """Return (S, P, 3) float32: strands (S, P, 3) with styles.

    weights: (S,) of styles with a mask; members: (S,) locks of strands, by default all in the first; centres: (K, P, 3)
    center strands for every level of every gathering style, by default the mean of a lock's strands; without such a
    style locks are those of guides, without points; launch: other arguments of `steps.apply_steps`.
    """
    count, point_count = points.shape[:2]
    identities = np.arange(count) if identities is None else identities
    members = np.zeros(count, np.int32) if members is None else np.asarray(members, np.int32)
    lock_count = members.max(initial=0) + 1
    if centres is None:
        centres = np.array([points[members == lock].mean(axis=0) for lock in range(lock_count)])
    arcs = np.pad(np.cumsum(segment_lengths(centres), axis=1), ((0, 0), (1, 0)))
    level_count = len(programs.tree_levels(styles)) + 1
    first_centres = [0] * (level_count - 1) + [len(centres)]
    keys = programs.mask_keys(styles)
    masks = np.tile(np.ones(count) if weights is None else weights, (len(keys), 1))

    def there(array, kind, shape):
        return wp.array(np.broadcast_to(array, shape).astype(kind[1]), dtype=kind[0], device=device)

    def twice(array):
        return np.concatenate([array, array])

    number, whole, vector = (float, np.float32), (int, np.int32), (wp.vec3, np.float32)
    data = steps.StrandData(
        there(normals, vector, (count, 3)),
        there(identities, whole, (count,)),
        there(masks, number, (len(keys), count)),
        there(members, whole, (level_count, count)),
        there(np.dstack([centres, arcs]), (wp.vec4, np.float32), (*centres.shape[:2], 4)),
        there(twice(np.broadcast_to(centre_normals, (len(centres), 3))), vector, (2 * len(centres), 3)),
        there(twice(1000 + np.arange(len(centres))), whole, (2 * len(centres),)),
    )
    made = programs.compiled(programs.strand_steps(styles, cutters or {}), keys, first_centres)
    styled = there(points, vector, points.shape)
    steps.apply_steps(styled, made, data, np.eye(4) if axes is None else axes, **launch)
    assert styled.shape[1] == point_count
    return styled.numpy()


def straight_strands(count=1, length=0.2, point_count=41, spacing=0.01):
    """Return (S, P, 3): strands that stand up from a row of roots."""
    points = np.zeros((count, point_count, 3), np.float32)
    points[:, :, 0] = spacing * np.arange(count)[:, None]
    points[:, :, 2] = np.linspace(0.0, length, point_count)
    return points


def curved_strands(rng, count=64, length=0.2, point_count=41):
    """Return (S, P, 3): smooth strands that bend and wind, from roots near the origin."""
    s = np.linspace(0.0, 1.0, point_count)
    angle = rng.uniform(-2.0, 2.0, (count, 1)) * s + rng.uniform(0.0, 1.0, (count, 1))
    around = rng.uniform(-3.0, 3.0, (count, 1)) * s + rng.uniform(0.0, 6.0, (count, 1))
    segments = np.stack([np.sin(angle) * np.cos(around), np.sin(angle) * np.sin(around), np.cos(angle)], axis=-1)
    sizes = rng.uniform(0.5, 1.5, (count, point_count, 1)) * length / (point_count - 1)
    roots = np.pad(rng.uniform(-0.05, 0.05, (count, 1, 2)), ((0, 0), (0, 0), (0, 1)))
    return (roots + np.cumsum(np.pad((segments * sizes)[:, 1:], ((0, 0), (1, 0), (0, 0))), axis=1)).astype(np.float32)


def rotation(rng):
    """Return (3, 3): a random rotation."""
    matrix, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return matrix * np.linalg.det(matrix)


def largest_move(points, others):
    """Return the largest distance [m] between the same points of two arrays."""
    return np.linalg.norm(points.astype(np.float64) - others, axis=-1).max()
