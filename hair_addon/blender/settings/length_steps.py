# SPDX-License-Identifier: GPL-3.0-or-later
"""Drag steps of length fields: a thousandth of the surface per pixel, within a factor of five.

Blender's steps belong to a property, not to its value, and follow the scene's unit. A length of a property group
therefore has two properties: its own, with steps for scenes in meters, and one with coarser steps and a longer slider,
for scenes in centimeters and creatures of ten meters. Rows show the property that fits.
"""

import math

import bpy

from . import style_keys

FINE, COARSE = 0.03, 3.0  # `step` of `bpy.props`: a pixel is a hundredth of it if the scene has no units
_SUFFIX = "_in_coarse_steps"
_UNITS = {  # [m] units that Blender's steps use
    "METRIC": (1000.0, 1.0, 0.01, 0.001, 1e-6),
    "IMPERIAL": (1609.344, 0.3048, 0.0254, 2.54e-5),
}
_PIXELS = 1000.0  # dragged for a length as large as the surface


def coarse_name(name):
    """Return the name of the property that shows a length in coarser steps."""
    return name + _SUFFIX


def coarse_property(length, **details):
    """Return a property that shows `length` of its group; details: as in bpy.props. Only the length itself is keyed."""

    def read(group):
        return getattr(group, length)

    def write(group, value):
        setattr(group, length, value)

    return bpy.props.FloatProperty(get=read, set=write, step=COARSE, options={"HIDDEN"}, **details)


def shown_name(owner, name):
    """Return the name of the property that a row shows for a setting: the one whose steps fit the hair's surface."""
    coarse = coarse_name(name)
    if coarse not in owner.bl_rna.properties:
        return name
    size = _size_of(owner.id_data)
    if not size:
        return name
    fine_off, coarse_off = (abs(math.log(per_pixel(step) * _PIXELS / size)) for step in (FINE, COARSE))
    if fine_off <= coarse_off:
        return name
    is_keyed = f"{owner.path_from_id()}.{name}" in style_keys.keyed_paths(owner.id_data)
    return name if is_keyed else coarse  # the coarse property would not show the key


def per_pixel(step):
    """Return the scene units per dragged pixel for a `step` of `bpy.props`, as Blender computes it."""
    units = bpy.context.scene.unit_settings
    plain = 0.01 * step
    if units.system == "NONE":
        return plain
    scale, known = units.scale_length, _UNITS[units.system]
    unit = _largest(known, 10.0 * plain * scale)
    return unit / scale * (plain if unit == _largest(known, scale) else 1.0)


def _largest(units, length):
    """Return the largest unit not longer than a length, or the smallest unit."""
    return next((unit for unit in units if unit <= length * (1.0 + 1e-6)), units[-1])


def _size_of(datablock):
    """Return the largest world dimension of the surface of Curves, or of an object; 0 for others."""
    surface = datablock if isinstance(datablock, bpy.types.Object) else getattr(datablock, "surface", None)
    return 0.0 if surface is None else max(surface.dimensions)
