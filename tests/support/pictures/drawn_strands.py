# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands read back from textures, and the tolerance of their coordinates."""

import numpy as np

from hair_addon.core.geometry import packed_strands


def texels(texture, count, each):
    """Return (count, each, C) texels of a texture whose rows contain whole strands of `each` texels."""
    rows = np.array(texture.read(), np.float32).reshape(texture.height, texture.width, -1)
    in_row = texture.width // each
    return rows[:, : in_row * each].reshape(-1, each, rows.shape[-1])[:count]


def places(on_gpu):
    """Return the points (S, P, 3) of `StrandsOnGPU`."""
    each = packed_strands.texel_count(on_gpu.point_count)
    return packed_strands.unpack(texels(on_gpu.texture, on_gpu.strand_count, each))


def places_before(on_gpu, count):
    """Return (count, P, 3): the former positions of the strands that moved last."""
    each = 1 + packed_strands.texel_count(on_gpu.point_count)
    return packed_strands.unpack(texels(on_gpu.moved.points, count, each)[:, 1:])


def radii(on_gpu):
    """Return the radii (S, P)."""
    found = texels(on_gpu.radii_texture, on_gpu.radius_strands, on_gpu.point_count)[..., 0] * on_gpu.radius_unit
    return np.broadcast_to(found, (on_gpu.strand_count, on_gpu.point_count))


def tolerance(points):
    """Return (S, 1, 1): the tolerance of coordinates of points (S, P, 3): half a step, and the rounding of positions
    and of offsets.
    """
    reach = np.abs(points - points[:, :1]).max(axis=(1, 2), keepdims=True)
    return 2.0**-20 * reach + 2.0**-22 * (np.abs(points).max(axis=(1, 2), keepdims=True) + reach)


def are_drawn(found, points):
    """Whether positions that were read back (S, P, 3) equal points (S, P, 3) within the tolerance."""
    return bool((np.abs(found - points) <= tolerance(points)).all())
