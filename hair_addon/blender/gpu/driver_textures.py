# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures that may be too large for the graphics driver."""

import gpu
import numpy as np

from ...core.errors import HairError

_TEXEL_BYTES = {"RGBA32F": 16, "RG32F": 8, "RGBA16F": 8, "R32F": 4, "R16": 2}


def new_texture(
    size: tuple[int, ...], texture_format: str, texels: np.ndarray | None = None, layers: int = 0
) -> gpu.types.GPUTexture:
    """Return a texture of `size` texels without filtering; texels: float32 values, None: undefined; layers: number of
    layers of an array texture, 0 for a plain texture.

    Raises `HairError` if the texture exceeds the driver's limits or memory.
    """
    try:
        data = {} if texels is None else {"data": gpu.types.Buffer("FLOAT", texels.size, texels.ravel())}
        texture = gpu.types.GPUTexture(size, layers=layers, format=texture_format, **data)
    except (RuntimeError, ValueError, MemoryError, OverflowError) as error:
        texel_count = float(np.prod(size, dtype=np.float64)) * max(layers, 1)
        megabytes = max(round(texel_count * _TEXEL_BYTES.get(texture_format, 16) / 1e6), 1)
        sentence = "The graphics driver cannot allocate {megabytes} MB: decrease Strand Count or Points per Strand."
        raise HairError(sentence, megabytes=megabytes) from error
    texture.filter_mode(False)
    return texture
