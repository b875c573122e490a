# SPDX-License-Identifier: GPL-3.0-or-later
"""Polylines from curves and back: B-splines, Bézier segments, resampling."""

from typing import TYPE_CHECKING

from ...lazy import submodules

if TYPE_CHECKING:
    from . import bezier_segments, bspline, curve_frames, resampling
else:
    __getattr__ = submodules(__name__)
