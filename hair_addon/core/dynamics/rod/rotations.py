# SPDX-License-Identifier: GPL-3.0-or-later
"""Rotations as unit quaternions x, y, z, w in NumPy, any shape (…, 4), and frames along polylines.

rod_rotations.h has the same functions for kernels.
"""

import numpy as np

IDENTITY = np.array([0.0, 0.0, 0.0, 1.0])


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the product a b: first the rotation b, then the rotation a."""
    # By components: NumPy's cross product alone takes three times as long.
    ax, ay, az, aw = _components(a)
    bx, by, bz, bw = _components(b)
    x = aw * bx + bw * ax + (ay * bz - az * by)
    y = aw * by + bw * ay + (az * bx - ax * bz)
    z = aw * bz + bw * az + (ax * by - ay * bx)
    return _together(x, y, z, aw * bw - (ax * bx + ay * by + az * bz))


def inverse(a: np.ndarray) -> np.ndarray:
    """Return the inverse rotation."""
    return a * np.array([-1.0, -1.0, -1.0, 1.0])


def rotated(a: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return vectors v (…, 3) after the rotation a."""
    ax, ay, az, aw = _components(a)
    x, y, z = _components(v)
    tx, ty, tz = 2.0 * (ay * z - az * y), 2.0 * (az * x - ax * z), 2.0 * (ax * y - ay * x)
    along_x, along_y, along_z = ay * tz - az * ty, az * tx - ax * tz, ax * ty - ay * tx
    return _together(x + aw * tx + along_x, y + aw * ty + along_y, z + aw * tz + along_z)


def _components(a):
    """Return one contiguous array (…) for each component: contiguous arrays are faster to read."""
    a = np.asarray(a)
    return a.transpose(a.ndim - 1, *range(a.ndim - 1)).copy()  # `moveaxis` takes longer than the copy


def _together(*components):
    """Return components joined along the last axis; `np.stack` takes twice as long for few strands."""
    found = np.empty((*components[0].shape, len(components)), components[0].dtype)
    for place, component in enumerate(components):
        found[..., place] = component
    return found


def unit(a: np.ndarray) -> np.ndarray:
    """Return normalized vectors or quaternions."""
    return a / np.linalg.norm(a, axis=-1, keepdims=True)


def half(a: np.ndarray) -> np.ndarray:
    """Return the rotation by half the angle, along the shorter arc."""
    return unit(np.where(a[..., 3:] < 0.0, -a, a) + IDENTITY)


def least_rotation(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the least rotation from unit vectors a to b; about any perpendicular axis if a and b are opposite."""
    real = 1.0 + np.sum(a * b, axis=-1, keepdims=True)
    other = np.where(np.abs(a[..., :1]) < 0.9, np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    is_opposite = real < 1e-9
    axis = np.where(is_opposite, np.cross(a, other), np.cross(a, b))
    return unit(np.concatenate([axis, np.where(is_opposite, 0.0, real)], axis=-1))


def frames_along(points: np.ndarray) -> np.ndarray:
    """Return twist-free frames (S, N-1, 4) of the segments of polylines (S, N, 3), with z along each segment.

    The first frame is the least rotation from z to its direction; segments of zero length repeat the previous frame
    [Bishop75].
    """
    directions = np.diff(np.asarray(points, np.float64), axis=1)
    sizes = np.linalg.norm(directions, axis=2, keepdims=True)
    directions = directions / np.where(sizes > 0.0, sizes, 1.0)
    frames = np.empty((*directions.shape[:2], 4))
    last, frame = (
        np.broadcast_to([0.0, 0.0, 1.0], directions[:, 0].shape),
        np.broadcast_to(IDENTITY, frames[:, 0].shape),
    )
    for j in range(directions.shape[1]):
        direction = np.where(sizes[:, j] > 0.0, directions[:, j], last)
        frame = unit(product(least_rotation(last, direction), frame))
        frames[:, j], last = frame, direction
    return frames


def from_matrices(matrices: np.ndarray) -> np.ndarray:
    """Return the quaternions (…, 4), with non-negative real part, of rotation matrices (…, 3, 3)."""
    m = np.asarray(matrices, np.float64)
    x, y, z = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    # Four times the outer product of the quaternion with itself; the longest row is the most accurate [Bar-Itzhack00].
    rows = np.empty((*m.shape[:-2], 4, 4))
    rows[..., 0, 0], rows[..., 1, 1], rows[..., 2, 2] = 1 + x - y - z, 1 - x + y - z, 1 - x - y + z
    rows[..., 3, 3] = 1 + x + y + z
    rows[..., 0, 1] = rows[..., 1, 0] = m[..., 1, 0] + m[..., 0, 1]
    rows[..., 0, 2] = rows[..., 2, 0] = m[..., 2, 0] + m[..., 0, 2]
    rows[..., 1, 2] = rows[..., 2, 1] = m[..., 2, 1] + m[..., 1, 2]
    rows[..., 0, 3] = rows[..., 3, 0] = m[..., 2, 1] - m[..., 1, 2]
    rows[..., 1, 3] = rows[..., 3, 1] = m[..., 0, 2] - m[..., 2, 0]
    rows[..., 2, 3] = rows[..., 3, 2] = m[..., 1, 0] - m[..., 0, 1]
    best = np.argmax(np.diagonal(rows, axis1=-2, axis2=-1), axis=-1)
    found = unit(np.take_along_axis(rows, best[..., None, None], axis=-2)[..., 0, :])
    return np.where(found[..., 3:] < 0.0, -found, found)
