# SPDX-License-Identifier: GPL-3.0-or-later
"""What a picture is made of: samples of its pixels, moments of its exposure, tiles."""

import math
from dataclasses import dataclass

import numpy as np

from .params import Settings, param

_MOST_PER_SIDE = 4


@dataclass(frozen=True)
class RenderSettings(Settings):
    """How a scene is rendered."""

    sample_count: int = param(
        64, "Samples of each pixel: the more, the less noise", label="Samples", low=1, high=65536, soft_high=1024
    )
    motion_steps: int = param(
        16,
        "Moments of the exposure that motion blur is the mean of; each is drawn with its part of the samples",
        low=1,
        high=1024,
        soft_high=64,
    )


@dataclass(frozen=True)
class FrameSettings(Settings):
    """Of a frame that is rendered into a file."""

    width: int = param(1920, "Width of the picture in pixels", low=1, high=65536)
    height: int = param(1080, "Height of the picture in pixels", low=1, high=65536)
    sample_count: int = param(0, "Samples of each pixel; 0: as many as the scene asks for", low=0, high=65536)
    is_transparent: bool = param(False, "Leave the background empty, whatever the scene says")
    has_passes: bool = param(False, "All passes that there are, as layers of a multilayer EXR")


@dataclass(frozen=True)
class PassSettings(Settings):
    """Passes of a view layer beside those that Blender has switches for."""

    has_hair_mask: bool = param(False, "How much of each pixel hair covers", label="Hair Mask")
    has_lobes: bool = param(
        False,
        "The light of hair in parts that add up to it: reflected (R), through the fibre (TT), reflected inside (TRT), "
        "scattered further, and the world's",
        label="Hair Lobes",
    )


def samples_per_side(sample_count):
    """Along each side of a pixel in each pass over a picture: as many as make up the samples in whole passes."""
    return next(side for side in range(_MOST_PER_SIDE, 0, -1) if sample_count % side**2 == 0)


def filter_margin(side, width):
    """Samples around a pixel of side × side that `filter_weights` takes into account."""
    return 0 if width <= 1.0 else math.ceil((0.5 * width - 0.5) * side + 0.5)


def filter_weights(side, width, shift):
    """(side + 2 `filter_margin`,) weights of samples along an axis for a pixel: a Blackman-Harris window [Harris78].

    side: samples along the pixel's side; width: of the window [pixels], up to one a box of a pixel; shift: by which the
    picture is moved against the samples [samples], up to half of one.
    """
    margin = filter_margin(side, width)
    if margin == 0:
        return np.ones(side)
    places = (np.arange(side + 2 * margin) - margin + 0.5 - shift) / side - 0.5
    turn = 2.0 * np.pi * np.clip(places / width, -0.5, 0.5)
    terms = ((0.35875, 0.0), (0.48829, 1.0), (0.14128, 2.0), (0.01168, 3.0))
    return sum(weight * np.cos(order * turn) for weight, order in terms)


def moments(shutter, position, count):
    """(count,) times [frames] from a frame, in the middles of equal parts of its exposure.

    shutter: how long it is open [frames]; position: START, CENTER or END: which moment of the exposure the frame is.
    """
    before = {"START": 0.0, "CENTER": 0.5, "END": 1.0}[position]
    return shutter * ((np.arange(count) + 0.5) / count - before)


def tiles(window, side):
    """[(left, bottom, width, height)] that a window of such numbers [pixels] falls into, `side` long at most."""
    left, bottom, width, height = window
    return [
        (left + x, bottom + y, min(side, width - x), min(side, height - y))
        for y in range(0, height, side)
        for x in range(0, width, side)
    ]
