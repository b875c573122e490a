# SPDX-License-Identifier: GPL-3.0-or-later
"""Mean values of images over triangles."""

import numpy as np

_SAMPLES = 1 << 18  # total over all triangles
_FEWEST, _MOST = 4, 1024  # samples per triangle


def triangle_means(pixels: np.ndarray, uvs: np.ndarray, extension: str = "REPEAT") -> np.ndarray:
    """Return (F, C) float32 mean values of an image over triangles.

    pixels: (H, W, C), the lowest row first; uvs: (3 F, 2) coordinates of the triangles' corners in the image, a unit
    square; extension: as of GPU textures. Triangles with non-finite coordinates have the mean of the image.
    """
    corners = np.reshape(uvs, (-1, 3, 2)).astype(np.float64)
    is_valid = (np.abs(corners) < 1e6).all(axis=(1, 2))
    corners = np.where(is_valid[:, None, None], corners, 0.0)
    levels = _levels(np.asarray(pixels, np.float32))
    weights = _barycentric(int(np.clip(_SAMPLES // max(len(corners), 1), _FEWEST, _MOST)))
    means = np.empty((len(corners), pixels.shape[2]), np.float32)
    chosen = _level_of(corners, pixels.shape, len(weights), len(levels))
    for level, picture in enumerate(levels):
        (rows,) = np.nonzero(chosen == level)
        step = max(_SAMPLES // len(weights), 1)
        for first in range(0, len(rows), step):
            some = rows[first : first + step]
            places = np.einsum("sk,fkc->fsc", weights, corners[some])
            means[some] = _values(picture, places, extension).mean(axis=1)
    means[~is_valid] = levels[-1].mean(axis=(0, 1))
    return means


def _barycentric(count):
    """Return (count, 3) barycentric coordinates spread evenly over a triangle by a rank-1 lattice."""
    index = np.arange(count) + 0.5
    first, second = index / count, (index * 0.6180339887498949) % 1.0
    root = np.sqrt(first)
    return np.stack([1.0 - root, root * (1.0 - second), root * second], axis=1)


def _level_of(corners, shape, samples, count):
    """Return a level for each triangle; its pixels are about as large as the area for one of the samples."""
    (x, y), size = (corners[:, 1:] - corners[:, :1]).transpose(1, 0, 2), shape[1] * shape[0]
    area = 0.5 * size * np.abs(x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0])  # [pixels]
    return np.clip(0.5 * np.log2(np.maximum(area / samples, 1.0)), 0, count - 1).astype(int)


def _levels(pixels):
    """Return the image and means of its blocks of 2, 4, 8, … pixels along a side, while these divide both sides."""
    levels = [pixels]
    while all(length > 1 and length % 2 == 0 for length in levels[-1].shape[:2]):
        height, width, channels = levels[-1].shape
        levels.append(levels[-1].reshape(height // 2, 2, width // 2, 2, channels).mean(axis=(1, 3)))
    return levels


def _values(pixels, places, extension):
    """Return the pixels (..., C) at places (..., 2)."""
    height, width = pixels.shape[:2]
    places = np.floor(places * (width, height)).astype(np.int64)
    found = pixels[_inside(places[..., 1], height, extension), _inside(places[..., 0], width, extension)]
    if extension == "CLAMP_TO_BORDER":
        found = found * ((places >= 0) & (places < (width, height))).all(axis=-1, keepdims=True)
    return found


def _inside(index, count, extension):
    if extension == "REPEAT":
        return index % count
    if extension == "MIRRORED_REPEAT":
        index = index % (2 * count)
        return np.minimum(index, 2 * count - 1 - index)
    return np.clip(index, 0, count - 1)
