# SPDX-License-Identifier: GPL-3.0-or-later
"""Sums over paths by voxel → ratios without holes: where there are few paths, those of larger voxels count as well."""

import numpy as np

_PRIOR = 512.0  # paths that the ratio of the voxels around stands for


def shares(sums: np.ndarray, path_count: int, origin: tuple[int, int, int] = (0, 0, 0)) -> np.ndarray:
    """(Z, Y, X, 12) sums of `gather` over some paths → (Z, Y, X, 4): RGB in parts of what even light gives, and how
    much of what is drawn is kept.

    Both together are the paths' light. What is drawn tells apart strands and places that the paths' mean is too coarse
    for; as much is kept as explains the paths best, but where that is more than they find in any channel.
    """
    # One hair may take a small part of the grid of all.
    box, beside = _box_of((sums[..., 3] > 0.0) | (sums[..., 9] > 0.0))
    sums = sums[box]
    origin = tuple(first + part.start for first, part in zip(origin, box[::-1], strict=True))
    light, drawn = (smooth_ratios(pair, path_count, origin) for pair in (sums[..., :6], sums[..., 6:]))
    most = explained_part(sums)
    kept = np.clip((light / np.maximum(drawn, 1e-12)).min(axis=-1, keepdims=True), 0.0, most)
    return np.pad(np.concatenate([light - kept * drawn, kept], axis=-1), [*beside, (0, 0)], mode="edge")


def _box_of(is_used):
    """(slices along Z, Y, X around all that is used of (Z, Y, X), numbers of voxels before and after them)."""
    box = []
    for axis in range(3):
        others = tuple(other for other in range(3) if other != axis)
        (used,) = np.nonzero(is_used.any(axis=others))
        box.append(slice(int(used[0]), int(used[-1]) + 1) if len(used) else slice(0, is_used.shape[axis]))
    beside = [(part.start, length - part.stop) for part, length in zip(box, is_used.shape, strict=True)]
    return tuple(box), beside


def explained_part(sums: np.ndarray) -> float:
    """The part of what is drawn, from 0 to 1, with the least squared difference from the paths' light over all voxels
    of (Z, Y, X, 12) sums, beside any part of even light in each channel.
    """
    is_known = (sums[..., 3] > 0.0) & (sums[..., 9] > 0.0)
    light, even, drawn, there = np.split(np.asarray(sums[is_known], np.float64), 4, axis=-1)
    drawn = drawn * (even / np.maximum(there, 1e-12))
    share = 1.0 / np.maximum(even, 1e-12)  # a voxel counts by its paths, not by their square
    total = np.maximum(even.sum(axis=0), 1e-12)
    light, drawn = (values - values.sum(axis=0) / total * even for values in (light, drawn))
    return float(np.clip((share * light * drawn).sum() / max(float((share * drawn**2).sum()), 1e-30), 0.0, 1.0))


def smooth_ratios(
    sums: np.ndarray, path_count: int, origin: tuple[int, int, int] = (0, 0, 0), prior: float = _PRIOR
) -> np.ndarray:
    """(Z, Y, X, 6) sums of light RGB and of even light RGB over some paths → (Z, Y, X, 3) ratios of both.

    From large voxels to small ones each ratio is drawn to that of the voxel around it, by `prior` average paths.
    origin: number of the first voxel along X, Y, Z: those of even numbers share a larger one with the next.
    Black where there is no light at all.
    """
    levels, shifts, first = [np.asarray(sums, np.float64)], [], np.array(origin[::-1])
    while max(levels[-1].shape[:3]) > 1:
        # Two on both sides of the world's origin would never become one.
        shifts.append(np.where(np.array(levels[-1].shape[:3]) > 2, first % 2, 0))
        first = first // 2
        levels.append(_halved(levels[-1], shifts[-1]))
    total = levels.pop()
    ratios = total[..., :3] / np.maximum(total[..., 3:], 1e-12)
    weight = np.maximum(prior / max(path_count, 1) * total[0, 0, 0, 3:], 1e-12)
    for level, shift in zip(reversed(levels), reversed(shifts), strict=True):
        around = _doubled(ratios, level.shape, shift)
        ratios = (level[..., :3] + weight * around) / (level[..., 3:] + weight)
    return ratios


def _halved(sums, shift):
    """Sums over blocks of 2 × 2 × 2 voxels, the first of them without its lower half along axes whose shift is 1."""
    ends = [(before, (length + before) % 2) for length, before in zip(sums.shape, shift.tolist(), strict=False)]
    padded = np.pad(sums, [*ends, (0, 0)])
    z, y, x = (length // 2 for length in padded.shape[:3])
    return padded.reshape(z, 2, y, 2, x, 2, -1).sum(axis=(1, 3, 5))


def _doubled(values, shape, shift):
    """Values (..., 3) of voxels at the centers of those of half the size, linear between them; shift: of `_halved`."""
    for axis in range(3):
        places = 0.5 * (np.arange(shape[axis]) + shift[axis] + 0.5) - 0.5
        below = np.clip(np.floor(places).astype(int), 0, values.shape[axis] - 1)
        above = np.minimum(below + 1, values.shape[axis] - 1)
        part = np.clip(places - below, 0.0, 1.0).reshape([-1 if axis == one else 1 for one in range(4)])
        values = np.take(values, below, axis) * (1.0 - part) + np.take(values, above, axis) * part
    return values
