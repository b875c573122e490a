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


def parts_at(lamps, panoramas, places):
    """Return RGB (N, P, 3) that patterns let arrive at places (P, 3), relative to the light that the power of lamps
    (N,) contains: `uniforms.LIGHT` records.
    """
    found = np.ones((len(lamps), len(places), 3))
    for index in np.flatnonzero(lamps["pattern_layer"]):
        lamp = lamps[index]
        pattern = panoramas[lamp["pattern_layer"] - 1].coarse_pattern
        along = (places - lamp["position"][:3]) @ lamp["pattern"][:3, :3]
        x, y, z = (along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-6)).T
        height, width, _rgb = pattern.shape
        rows = height * (0.5 + np.arcsin(np.clip(z, -1.0, 1.0)) / np.pi)
        columns = width * (0.5 - np.arctan2(y, x) / (2.0 * np.pi))
        rows, columns = (np.clip(one.astype(int), 0, side - 1) for one, side in ((rows, height), (columns, width)))
        found[index] = pattern[rows, columns] * lamp["pattern"][3, :3]
    return found


def of_paths(panoramas):
    """Return patterns (L, H, W, 3) of panoramas for `media.Surroundings`, at half the resolution; None without any."""
    if not panoramas:
        return None
    return np.stack([panorama.coarse_pattern for panorama in panoramas])
