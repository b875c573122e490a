# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands read back from the textures that shaders read, and how far those may be from what was put there."""

import numpy as np

from hair_addon.core.geometry import packed_strands


def texels(texture, count, each):
    """(count, each, C) of a texture whose rows hold whole strands of so many texels."""
    rows = np.array(texture.read(), np.float32).reshape(texture.height, texture.width, -1)
    in_row = texture.width // each
    return rows[:, : in_row * each].reshape(-1, each, rows.shape[-1])[:count]


def places(on_gpu):
    """(S, P, 3) of `StrandsOnGPU`."""
    each = packed_strands.texel_count(on_gpu.point_count)
    return packed_strands.unpack(texels(on_gpu.texture, on_gpu.strand_count, each))


def places_before(on_gpu, count):
    """(count, P, 3): where the strands were that moved last."""
    each = 1 + packed_strands.texel_count(on_gpu.point_count)
    return packed_strands.unpack(texels(on_gpu.moved.points, count, each)[:, 1:])


def radii(on_gpu):
    """(S, P)."""
    found = texels(on_gpu.radii_texture, on_gpu.radius_strands, on_gpu.point_count)[..., 0] * on_gpu.radius_unit
    return np.broadcast_to(found, (on_gpu.strand_count, on_gpu.point_count))


def tolerance(points):
    """(S, 1, 1): how far coordinates may be from points (S, P, 3)."""
    reach = np.abs(points - points[:, :1]).max(axis=(1, 2), keepdims=True)
    return 2.0**-20 * reach + 2.0**-22 * np.abs(points).max(axis=(1, 2), keepdims=True)


def are_drawn(found, points):
    """Whether places that were read back, both (S, P, 3), are those of points."""
    return bool((np.abs(found - points) <= tolerance(points)).all())
