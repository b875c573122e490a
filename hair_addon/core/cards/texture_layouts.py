# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures of cards packed into the channels that Unreal expects [UnrealCards26]."""

import numpy as np

from .texels import srgb

_LEAST_ROUGHNESS = 0.05  # of fibers: cards are not mirrors
PREFIX = "unreal_"  # of the names of packed textures, beside those of `texels.MAPS`

# {layout: {texture: values of its channels}}, with Unreal's names of textures. Unreal reads the UV coordinates of roots
# from vertices, so the first channel of Attributes is 0. Unreal also lists a texture Auxiliary, without content.
_CHANNELS = {
    "SEPARATE": {},
    "UNREAL": {
        "Depth": ("depth",),
        "Coverage": ("alpha",),
        "Tangent": ("tangent",),
        "Attributes": ("zero", "root", "id"),
        "Material": ("color", "roughness"),
    },
    "UNREAL_COMPACT": {
        "TangentCoordU": ("tangent", "root"),
        "CoverageDepthSeed": ("alpha", "depth", "id"),
        "ColorRoughness": ("color", "roughness"),
    },
}


def packed(maps: dict[str, np.ndarray], layout: str, roughness: float) -> dict[str, np.ndarray]:
    """Return {name: (n, n, k)} of the packed textures of a layout of `CardSettings`, with 1, 3 or 4 channels.

    maps: of `TexelSums.maps`; roughness: of the look, for maps without roughness. Colors are in sRGB, all other values
    linear, from 0 to 1.
    """
    size = len(maps["alpha"])
    plain = np.zeros((size, size), np.float32)
    values = {"roughness": plain + np.float32(roughness)} | maps | {"color": srgb(maps["color"]), "zero": plain}
    return {
        PREFIX + name: np.dstack([values[channel] for channel in channels])
        for name, channels in _CHANNELS[layout].items()
    }


def surface_roughness(roughness: np.ndarray | float) -> np.ndarray:
    """Return the roughness of a surface, as in Principled shaders and glTF, for the roughness of fibers."""
    return np.clip(np.sqrt(np.maximum(roughness, _LEAST_ROUGHNESS)), 0.0, 1.0)


def has_color(name: str) -> bool:
    """Return whether a texture, packed or of `texels.MAPS`, has colors in sRGB."""
    return name in ("color", PREFIX + "Material", PREFIX + "ColorRoughness")
