# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenEXR files of light: panoramas, and matcaps with a diffuse and a specular layer."""

from pathlib import Path

import numpy as np
import OpenEXR

from ..errors import HairError, cause_of


def read_layers(path: str | Path) -> dict[str, np.ndarray]:
    """Return {layer: (H, W, 3) float32 scene-linear colors}, bottom row first; the unnamed layer is "".

    Raises `HairError` for a file that cannot be read, or has no colors.
    """
    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            channels = {name: np.array(channel.pixels, np.float32) for name, channel in file.channels().items()}
    except Exception as error:  # OpenEXR raises its own exceptions as RuntimeError, and others for damaged headers
        raise HairError("{path} cannot be read: {cause}.", path=path, cause=cause_of(error)) from error
    layers = {}
    for name in channels:
        layer, dot, letter = name.rpartition(".")
        colors = [channels[wanted] for color in "RGB" if (wanted := f"{layer}{dot}{color}") in channels]
        if letter == "R" and len(colors) == 3 and len({color.shape for color in colors}) == 1:
            layers[layer] = np.nan_to_num(np.stack(colors, axis=-1)[::-1], posinf=0.0, neginf=0.0)
    if not layers:
        raise HairError("{path} has no colors: pick another image.", path=path)
    return layers


def write_colors(path: str | Path, colors: np.ndarray, is_compressed: bool = True) -> None:
    """Write (H, W, 3) scene-linear colors, bottom row first, as float32. Raises `OSError`."""
    compression = OpenEXR.ZIP_COMPRESSION if is_compressed else OpenEXR.NO_COMPRESSION
    header = {"compression": compression, "type": OpenEXR.scanlineimage}
    pixels = np.ascontiguousarray(colors[::-1], np.float32)
    try:
        OpenEXR.File(header, {"RGB": pixels}).write(str(path))
    except RuntimeError as error:
        raise OSError(str(error)) from error
