# SPDX-License-Identifier: GPL-3.0-or-later
"""Copying of guide shapes to other guides, rotated with the surface."""

from dataclasses import dataclass

import numpy as np

from ..geometry.mirror import Mirror
from ..geometry.strands import lengths as lengths_of
from .guide_mirror import nearest
from .guide_segments import blended, only, rotations, unit
from .guide_tool_settings import CopySettings

_UPRIGHT = 0.2  # least sine of the angle between normal and vertical that defines an upward direction on the surface


@dataclass(frozen=True)
class Places:
    """Roots (N, 3) [m] of guides and unit normals (N, 3) of the surface."""

    roots: np.ndarray
    normals: np.ndarray


@dataclass(frozen=True)
class Matches:
    """The guides to copy for T targets: sources (T,) indices, and matrices (T, 3, 3) that rotate or mirror them."""

    sources: np.ndarray
    matrices: np.ndarray


def matched(sources: Places, targets: Places, mapping: str, mirror: Mirror) -> Matches:
    """Return the `Matches` of targets by a `CopySettings.mapping`; mirror: for MIRRORED.

    FITTED aligns center, mean normal and size of the targets with the sources. Shapes are rotated by the least rotation
    between the normals that preserves the upward direction, where the surface is steep enough to define one.
    """
    roots, normals = (np.asarray(array, np.float64) for array in (targets.roots, targets.normals))
    reflection = np.eye(3)
    if mapping == "MIRRORED":
        reflection = mirror.matrix
        roots = mirror.image(roots)
    elif mapping == "FITTED":
        turn = upright_rotations(_mean_normal(sources.normals), _mean_normal(normals))[0]
        (middle, size), (its_middle, its_size) = _extent(roots), _extent(np.asarray(sources.roots, np.float64))
        scale = its_size / size if size > 0.0 else 1.0
        roots = its_middle + scale * (roots - middle) @ turn
    found = nearest(sources.roots, roots)[0][:, 0]
    # Normals transform by the inverse transpose; a reflection is its own inverse.
    reflected = unit(np.asarray(sources.normals, np.float64)[found] @ reflection)
    return Matches(found, upright_rotations(reflected, normals) @ reflection)


def copied(
    points: np.ndarray, sources: np.ndarray, matrices: np.ndarray, settings: CopySettings, weights: np.ndarray
) -> np.ndarray:
    """Return guides (T, P, 3) float32 [m] with the shapes of other guides and their own roots.

    points (T, P, 3) [m]; sources (T, P, 3) [m]: the guide to copy for each; matrices (T, 3, 3); weights (T,) in [0, 1].
    """
    sources = np.asarray(sources, np.float64)
    arms = np.einsum("tij,tpj->tpi", matrices, sources - sources[:, :1])
    if not settings.copy_length:
        its, own = lengths_of(arms), lengths_of(np.asarray(points, np.float64))
        arms *= np.where(its > 0.0, own / np.where(its > 0.0, its, 1.0), 1.0)[:, None, None]
    shares = settings.amount * np.asarray(weights, np.float64)
    return only(points, blended(points, points[:, :1] + arms, shares), shares)


def upright_rotations(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return rotations (N, 3, 3) that map unit normals (N, 3) to others, and upward tangents to upward tangents.

    The least rotations where either surface is nearly level.
    """
    least = rotations(start, end)
    up = np.array([0.0, 0.0, 1.0])
    before, after = (np.broadcast_to(up, n.shape) - n[:, 2:] * n for n in (start, end))
    is_steep = (np.linalg.norm(before, axis=1) > _UPRIGHT) & (np.linalg.norm(after, axis=1) > _UPRIGHT)
    carried = unit(np.einsum("nij,nj->ni", least, before))
    after = unit(after)
    # A rotation about the end's normal, to which both are perpendicular.
    cosine = np.sum(carried * after, axis=1)
    sine = np.sum(np.cross(carried, after) * end, axis=1)
    angle = np.where(is_steep, np.arctan2(sine, cosine), 0.0)
    return _about(end, angle) @ least


def _about(axes, angles):
    """Return rotations (N, 3, 3) about unit axes (N, 3) by angles (N,) [rad]  (Rodrigues)."""
    cross = np.zeros((len(axes), 3, 3))
    cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = -axes[:, 2], axes[:, 1], -axes[:, 0]
    cross -= np.swapaxes(cross, 1, 2)
    angles = angles[:, None, None]
    return np.eye(3) + np.sin(angles) * cross + (1.0 - np.cos(angles)) * cross @ cross


def _mean_normal(normals):
    """Return the unit mean normal (1, 3); +Z if normals cancel."""
    mean = unit(np.asarray(normals, np.float64).sum(axis=0, keepdims=True))
    return mean if mean.any() else np.array([[0.0, 0.0, 1.0]])


def _extent(roots):
    """Return the center (3,) of roots and their root mean square distance from it."""
    middle = roots.mean(axis=0)
    return middle, float(np.sqrt(np.mean(np.sum((roots - middle) ** 2, axis=1))))
