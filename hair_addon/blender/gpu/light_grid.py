# SPDX-License-Identifier: GPL-3.0-or-later
"""Light among strands as a 3D texture of voxels and sample points along strands: `core.shading.light_paths`."""

import gpu
import numpy as np

from ...core.texture_sides import avoid_powers_of_two
from ..host.caches import Cache

_GREATEST = 60000.0  # within the range of half floats

none_cache = Cache(capacity=1)


def upload(texels):
    """Return a texture of (Z, Y, X, 4) `light_texels.packed`, linear between texels, whose sides avoid powers of
    two.
    """
    beside = avoid_powers_of_two(texels.shape[:3]) - texels.shape[:3]
    texels = np.clip(texels, -_GREATEST, _GREATEST).astype(np.float32, copy=False)
    if beside.any():
        texels = np.pad(texels, [*((0, more) for more in beside), (0, 0)], mode="edge")
    data = gpu.types.Buffer("FLOAT", texels.size, texels.ravel())
    texture = gpu.types.GPUTexture(texels.shape[2::-1], format="RGBA16F", data=data)
    texture.filter_mode(True)
    texture.extend_mode("EXTEND")
    return texture


def none():
    """Return a neutral texture for pictures without a grid."""
    return none_cache.get("none", lambda: upload(np.array([[[[0.0, 0.0, 0.0, 1.0]]]])))
