# SPDX-License-Identifier: GPL-3.0-or-later
"""Patterns of lamps whose nodes Cycles renders: an array texture with a layer for each lamp."""

import numpy as np

from ..data.pictures.light_panoramas import SIZE
from ..host.caches import Cache
from . import driver_textures

texture_cache = Cache(capacity=4)  # (identities of panoramas) → (panoramas, texture)


def write(light, panorama, matrix, factor, layer):
    """Write the pattern of a lamp into its `uniforms.LIGHT` record.

    matrix: (4, 4) of the lamp; factor: RGB mean of the pattern, which the lamp's power contains; layer: index of
    the panorama in the texture.
    """
    light["pattern"][:3, :3] = panorama.axes(matrix)
    light["pattern"][3, :3] = 1.0 / np.maximum(factor, 1e-20)
    light["pattern_layer"] = layer + 1


def texture_of(panoramas):
    """Return the texture of panoramas, one in each layer; one texel if there are none. Raises `HairError`."""
    keys = tuple(map(id, panoramas))  # the cache holds the panoramas, so their identities are not reused
    return texture_cache.get(keys, lambda: (panoramas, _new(panoramas)))[1]


def _new(panoramas):
    width, height = SIZE if panoramas else (1, 1)
    texels = np.zeros((max(len(panoramas), 1), height, width, 4), np.float32)
    for layer, panorama in enumerate(panoramas):
        texels[layer, ..., :3] = panorama.pattern
    texture = driver_textures.new_texture((width, height), "RGBA16F", texels, len(texels))
    texture.filter_mode(True)
    texture.extend_mode("EXTEND")
    return texture


def of_paths(panoramas):
    """Return patterns (L, H, W, 3) of panoramas for `media.Surroundings`, at half the resolution; None without any."""
    if not panoramas:
        return None
    width, height = SIZE
    blocks = len(panoramas), height // 2, 2, width // 2, 2, 3
    return np.stack([panorama.pattern for panorama in panoramas]).reshape(blocks).mean(axis=(2, 4))
