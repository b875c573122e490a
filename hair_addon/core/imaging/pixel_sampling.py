# SPDX-License-Identifier: GPL-3.0-or-later
"""Sampling of images: pixel samples, motion samples, tiles."""

import math
from dataclasses import dataclass

import numpy as np

from ..params import Settings, param

FIRST_FRAME, LAST_FRAME = -1_048_574, 1_048_574  # Blender's MINAFRAME and MAXFRAME

_MOST_PER_SIDE = 4
LENS_PASSES = 32  # least number of passes with depth of field: each pass uses one point of the lens


@dataclass(frozen=True)
class RenderSettings(Settings):
    """Render settings of a scene."""

    sample_count: int = param(
        64,
        "Samples per pixel; higher values reduce noise and take longer",
        label="Samples",
        low=1,
        high=65536,
        soft_high=1024,
    )
    motion_steps: int = param(
        16,
        "Number of points in time that motion blur averages; higher values give smoother blur",
        low=1,
        high=1024,
        soft_high=64,
    )
    multiple_scattering: str = param(
        "GRID",
        "How renders and viewports compute light that reaches hair from other hair and from surfaces",
        label="Multiple Scattering",
        choices=(  # .blend files store the index of a choice
            (
                "DUAL",
                "Dual Scattering",
                "From the amount of hair in front of and behind each strand, as while something moves in a viewport. "
                "Fast and without noise; for previews, and for animations on slow computers",
            ),
            (
                "GRID",
                "Light Grid",
                "Light paths through the hair, closest to Cycles. Takes seconds longer for each frame; viewports in "
                "Material Preview and Rendered shading follow them while nothing moves",
            ),
        ),
    )
    is_hair_only: bool = param(
        False,
        "Render hair without surfaces: they still hide it and cast shadows on it, but are not visible",
        label="Hair Only",
    )
    has_preview_shadow: bool = param(
        False, "Darken surfaces in Material Preview where hair is between them and the lights", label="Preview Shadow"
    )
    composite_shadow: str = param(
        "PASS",
        "How hair darkens surfaces that another engine renders",
        label="Surface Shadow",
        choices=(
            ("PASS", "Pass", "Multiply the surfaces by the fraction of light that hair lets through"),
            ("ENGINE", "Engine", "Cycles or EEVEE renders the shadows, reflections and light of its own hair"),
            ("NONE", "None", "Hair casts no shadow on surfaces"),
        ),
    )


@dataclass(frozen=True)
class PictureSettings(Settings):
    """Settings of a picture: a picture drawn at once in the memory of the GPU, or a frame rendered to a file."""

    width: int = param(1280, "Width of the image in pixels", low=1, high=65536)
    height: int = param(720, "Height of the image in pixels", low=1, high=65536)
    samples_per_side: int = param(
        4, "Samples along each side of a pixel; 4 gives 16 samples per pixel", label="Samples per side", low=1, high=8
    )
    sample_count: int = param(0, "Samples per pixel; 0 uses the scene's setting", low=0, high=65536)
    is_transparent: bool = param(
        False, "Leave the background transparent instead of filling it with the world color", label="Transparent"
    )
    has_passes: bool = param(False, "Write all passes as layers of a multilayer EXR")


DRAWING_FIELDS = ("samples_per_side",)  # only for pictures that are drawn at once
FRAME_FIELDS = ("sample_count", "has_passes")  # only for rendered frames
MOST_DRAWN = 16384  # pixels along a side of a picture that is drawn at once
FILTER_WINDOW = 2.0  # width of the pixel filter in multiples of Blender's Filter Size, a radius in Cycles and EEVEE


@dataclass(frozen=True)
class PassSettings(Settings):
    """Passes of a view layer in addition to Blender's."""

    has_hair_mask: bool = param(False, "Coverage of each pixel by hair", label="Hair Mask")
    has_lobes: bool = param(
        False,
        "Lighting of hair as passes whose sum is the image: reflection (R), transmission (TT), internal reflection "
        "(TRT), multiple scattering, and world light",
        label="Hair Lobes",
    )
    has_hair_shadow: bool = param(
        False,
        "Fraction of the light on surfaces that hair lets through, by which they are multiplied",
        label="Hair Shadow",
    )
    has_denoising_data: bool = param(
        False,
        "Image, albedo and normal for the Denoise node of the compositor: Noisy Image, Denoising Albedo and Denoising "
        "Normal",
        label="Denoising Data",
    )


def samples_per_side(sample_count: int, least_passes: int = 1) -> int:
    """Return the number of samples along each side of a pixel in a pass; whole passes give the sample count.

    least_passes: minimum number of passes, if there are enough samples.
    """
    sides = range(_MOST_PER_SIDE, 1, -1)
    return next((n for n in sides if sample_count % n**2 == 0 and sample_count >= least_passes * n**2), 1)


def filter_margin(side: int, width: float) -> int:
    """Return the number of samples beyond each edge of a pixel, of side × side samples, in `filter_weights`."""
    return 0 if width <= 1.0 else math.ceil((0.5 * width - 0.5) * side + 0.5)


def filter_weights(side: int, width: float, shift: float) -> np.ndarray:
    """Return pixel filter weights (side + 2 `filter_margin`,) along an axis: a Blackman-Harris window [Harris78].

    side: samples along the pixel's side; width: of the window [pixels], a box filter for at most 1; shift: offset of
    the picture relative to the samples [samples], at most 0.5.
    """
    margin = filter_margin(side, width)
    if margin == 0:
        return np.ones(side)
    places = (np.arange(side + 2 * margin) - margin + 0.5 - shift) / side - 0.5
    turn = 2.0 * np.pi * np.clip(places / width, -0.5, 0.5)
    terms = ((0.35875, 0.0), (0.48829, 1.0), (0.14128, 2.0), (0.01168, 3.0))
    return sum((weight * np.cos(order * turn) for weight, order in terms), np.zeros(len(turn)))


def moments(shutter: float, position: str, count: int, openings: np.ndarray | None = None) -> np.ndarray:
    """Return motion sample times (count,) [frames] relative to a frame, at the centers of intervals of equal exposure.

    shutter: duration of the exposure [frames]; position: START, CENTER or END, the place of the frame in the exposure;
    openings: (N,) shutter opening at the centers of N equal intervals; None or all zero for a constant opening.
    """
    before = {"START": 0.0, "CENTER": 0.5, "END": 1.0}[position]
    parts = (np.arange(count) + 0.5) / count
    if openings is not None and np.any(openings > 0.0):
        light = np.append(0.0, np.cumsum(np.maximum(openings, 0.0)))
        parts = np.interp(parts * light[-1], light, np.linspace(0.0, 1.0, len(light)))
    return shutter * (parts - before)


def tiles(window: tuple[int, int, int, int], side: int) -> list[tuple[int, int, int, int]]:
    """Return tiles, with at most `side` pixels along each side, of a window (left, bottom, width, height) [pixels]."""
    left, bottom, width, height = window
    return [
        (left + x, bottom + y, min(side, width - x), min(side, height - y))
        for y in range(0, height, side)
        for x in range(0, width, side)
    ]
