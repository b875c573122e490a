# SPDX-License-Identifier: GPL-3.0-or-later
"""Light among strands as a texture, by voxel: `core.shading.light_paths`."""

import gpu
import numpy as np

from ..host.caches import Cache

_GREATEST = 60000.0  # of half floats

none_cache = Cache(capacity=1)


def upload(means):
    """A texture of light (Z, Y, X, 3), linear between voxels."""
    texels = np.ones((*means.shape[:3], 4), np.float32)
    texels[..., :3] = np.clip(means, -_GREATEST, _GREATEST)
    data = gpu.types.Buffer("FLOAT", texels.size, texels.ravel())
    texture = gpu.types.GPUTexture(means.shape[2::-1], format="RGBA16F", data=data)
    texture.filter_mode(True)
    texture.extend_mode("EXTEND")
    return texture


def none():
    """A texture for pictures without a grid."""
    return none_cache.get("none", lambda: upload(np.zeros((1, 1, 1, 3))))
