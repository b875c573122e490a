# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes of the mouse as a property of operators, so that the redo panel repeats them."""

import bpy
import numpy as np

from ...core.grooming.guide_tool_settings import FlowSettings
from . import setting_properties
from .translations import CONTEXT


class VellusStrokePoint(bpy.types.PropertyGroup):
    """A point of a stroke"""

    location: bpy.props.FloatVectorProperty(options={"HIDDEN"})


def annotations(fitted_radius):
    """Return {name: bpy property} of an operator with a stroke of a brush on a surface.

    fitted_radius: a function that returns the radius [m] that is used until a radius is set, or None.
    """

    def radius_of(_operator, value, is_set):
        return value if is_set else fitted_radius() or value

    options = {"HIDDEN", "SKIP_SAVE"}
    radius = setting_properties.annotations(FlowSettings)["radius"].keywords
    return {
        "stroke": bpy.props.CollectionProperty(type=VellusStrokePoint, options=options),
        "radius": bpy.props.FloatProperty(**radius, get_transform=radius_of),
    }


def read(operator):
    """Return the stroke (K, 3) float64 of an operator, in local coordinates of the surface."""
    return np.array([point.location for point in operator.stroke], np.float64).reshape(-1, 3)


def add(operator, place):
    """Add a point (3,) to the stroke of an operator."""
    operator.stroke.add().location = place


def brush_annotations():
    """Return the property of an operator that changes a setting of a brush."""
    return {
        "setting": bpy.props.EnumProperty(
            name="Setting",
            description="Setting that moving the mouse changes",
            translation_context=CONTEXT,
            items=[
                ("radius", "Radius", "Radius of the brush on the surface"),
                ("strength", "Strength", "Strength of the brush"),
            ],
            options={"SKIP_SAVE"},
        )
    }


CLASSES = (VellusStrokePoint,)
