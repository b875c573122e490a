# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene's color management, with view transform, look and gamma, as a table of display colors.

Draw handlers draw onto the viewport after its view transform, so they must apply it themselves. The shader applies the
exposure, so that changing it needs no new table.
"""

import os
import sys
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ..data.pictures import viewport_shading

# Texels per side. With 64, the error of interpolation is at most one step of an 8-bit display, see the tests.
SIZE = 64

# The table covers scene-linear values up to MOST, spaced logarithmically except near zero.
MOST = 512.0
_KNEE = 1.0 / 1024.0

_DEFAULT_VIEW = "Standard"  # of Solid shading, whatever the scene's view transform


@dataclass(frozen=True)
class DisplayTransform:
    """The part of a scene's color management that the table contains."""

    display: str
    view: str
    look: str
    gamma: float
    working_space: str  # color space of scene-linear colors

    @classmethod
    def of(cls, scene, part=viewport_shading.ALL):
        """Return the settings of a scene; part: which settings Blender applies to the viewport."""
        view = scene.view_settings
        look = "" if view.look == "None" else view.look
        space = bpy.data.colorspace.working_space
        display = scene.display_settings.display_device
        if part == viewport_shading.NO_SETTINGS:
            return cls(display, _DEFAULT_VIEW, "", 1.0, space)
        return cls(display, view.view_transform, look, view.gamma if part == viewport_shading.ALL else 1.0, space)

    def table(self):
        """Return (SIZE, SIZE, SIZE, 3) float32 display colors in [0, 1], red running fastest."""
        axis = linear_at(np.linspace(0.0, 1.0, SIZE)).astype(np.float32)
        blue, green, red = np.meshgrid(axis, axis, axis, indexing="ij")
        colors = np.ascontiguousarray(np.stack([red, green, blue], axis=-1).reshape(-1, 3))
        return np.clip(apply(self, colors), 0.0, 1.0).reshape(SIZE, SIZE, SIZE, 3)


def display_place(linear):
    """Table coordinates of scene-linear values, in [0, 1]."""
    return np.log2(np.clip(linear, 0.0, MOST) / _KNEE + 1.0) / np.log2(MOST / _KNEE + 1.0)


def linear_at(places):
    """Scene-linear values at table coordinates in [0, 1]: the inverse of `display_place`."""
    return (np.exp2(places * np.log2(MOST / _KNEE + 1.0)) - 1.0) * _KNEE


def apply(transform, colors):
    """Return display colors (N, 3) of scene-linear colors (N, 3) float32, by Blender's OpenColorIO configuration.

    If OpenColorIO is missing or lacks the transform: by the Standard view for sRGB, with a message on the console.
    """
    bpy.utils.expose_bundled_modules()
    try:
        import PyOpenColorIO as ocio
    except ImportError:
        print("Vellus: no PyOpenColorIO in this Blender, so hair is shown in the Standard view.", file=sys.stderr)
        return _srgb(colors, transform.gamma)
    try:
        processor = _processor(ocio, transform)
    except ocio.Exception as error:
        print(f"Vellus: hair is shown in the Standard view: {error}", file=sys.stderr)
        return _srgb(colors, transform.gamma)
    colors = np.array(colors, np.float32, order="C")
    processor.applyRGB(colors)
    return colors


def _processor(ocio, transform):
    """Return the processor as in Blender: the look in scene-linear colors, then the view, then the scene's gamma."""
    path = os.environ.get("OCIO") or Path(bpy.utils.system_resource("DATAFILES", path="colormanagement"), "config.ocio")
    config = ocio.Config.CreateFromFile(str(path))
    steps = ocio.GroupTransform()
    if transform.look:
        steps.appendTransform(ocio.LookTransform(transform.working_space, transform.working_space, transform.look))
    view = ocio.DisplayViewTransform(transform.working_space, transform.display, transform.view)
    view.setLooksBypass(bool(transform.look))
    steps.appendTransform(view)
    if transform.gamma != 1.0:
        steps.appendTransform(ocio.ExponentTransform([*[1.0 / max(transform.gamma, 1e-6)] * 3, 1.0]))
    return config.getProcessor(steps).getDefaultCPUProcessor()


def _srgb(linear, gamma):
    low = np.clip(linear, 0.0, 1.0)
    encoded = np.where(low <= 0.0031308, 12.92 * low, 1.055 * np.maximum(low, 0.0031308) ** (1.0 / 2.4) - 0.055)
    return (encoded ** (1.0 / max(gamma, 1e-6))).astype(np.float32)
