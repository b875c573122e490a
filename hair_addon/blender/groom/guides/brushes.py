# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's brushes for guides: added guides match their neighbors, and strokes keep guides outside of the mesh."""

import bpy
import numpy as np
from bpy.types import Curves, CurvesSculpt

from ...data.strands import curves

_FILE = "brushes/essentials_brushes-curve_sculpt.blend/Brush/"
_ADDING = ("Add", "Density")

# Blender's defaults of these brushes.
_SHIPPED = {
    "curve_length": 0.3,
    "points_per_curve": 8,
    "use_length_interpolate": False,
    "use_shape_interpolate": False,
    "use_point_count_interpolate": False,
}

_OFF_SURFACE = 0.02  # distance of guides from the surface in strokes, as a fraction of their median length

_fitted = {}  # name of a brush → settings last written by the add-on


def fit(guides: Curves, sculpt: CurvesSculpt) -> None:
    """Fit Blender's Add and Density brushes to guide Curves, unless an artist has set them; requires Sculpt Mode.

    New guides get length, shape and number of points of the guides around them, or the medians of all guides if there
    are none around. sculpt: the `CurvesSculpt` settings of the scene; its active brush does not change.
    """
    if not len(guides.curves):
        return
    active = sculpt.brush_asset_reference
    library, identifier = active.asset_library_type, active.relative_asset_identifier
    custom = active.asset_library_identifier
    lengths = _lengths(guides)
    settings = {
        "curve_length": float(np.median(lengths)),
        "points_per_curve": int(np.median(curves.point_counts(guides))),
        "use_length_interpolate": True,
        "use_shape_interpolate": True,
        "use_point_count_interpolate": True,
    }
    for name in _ADDING:
        if "FINISHED" in bpy.ops.brush.asset_activate(
            asset_library_type="ESSENTIALS", relative_asset_identifier=_FILE + name
        ):
            _fit(sculpt.brush, settings)
    if identifier:
        bpy.ops.brush.asset_activate(
            asset_library_type=library, asset_library_identifier=custom, relative_asset_identifier=identifier
        )


def collide(guides: Curves) -> None:
    """Switch on collision of Blender's brush strokes with the surface, once: an artist may switch it off."""
    if guides.vellus.was_combed or not len(guides.curves):
        return
    guides.vellus.was_combed = True
    guides.use_sculpt_collision = True
    guides.surface_collision_distance = _OFF_SURFACE * float(np.median(_lengths(guides)))


def _fit(brush, settings):
    group = brush.curves_sculpt_settings
    present = _settings_of(group)
    if present not in (_rounded(_SHIPPED), _fitted.get(brush.name)):
        return  # chosen by the artist
    for name, value in settings.items():
        setattr(group, name, value)
    _fitted[brush.name] = _settings_of(group)


def _settings_of(group):
    return _rounded({name: getattr(group, name) for name in _SHIPPED})


def _rounded(settings):
    """Round settings to Blender's single precision, for comparison."""
    return settings | {"curve_length": float(np.float32(settings["curve_length"]))}


def _lengths(guides):
    """Return (G,) lengths in local units."""
    offsets, points = curves.curve_offsets(guides), curves.read_points(guides)
    steps = np.linalg.norm(np.diff(points, axis=0, append=points[-1:]), axis=1)
    steps[offsets[1:] - 1] = 0.0  # between curves
    return np.add.reduceat(steps, offsets[:-1])
