# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a length goes for each pixel that its field is dragged: a thousandth of the surface, within a factor of five.

Blender's steps belong to a property, not to its value, and follow the scene's unit. A length of a property group has
two properties therefore: its own, in steps for scenes in meters, and one that shows it in coarser steps and beyond the
end of the first one's slider, for scenes in centimeters and creatures of ten meters. Rows show the one that fits.
"""

import math

import bpy

from . import style_keys

FINE, COARSE = 0.03, 3.0  # of `bpy.props`: a hundredth of it is a pixel's, where the scene has no units
_SUFFIX = "_in_coarse_steps"
_UNITS = {  # [m] that Blender has steps of
    "METRIC": (1000.0, 1.0, 0.01, 0.001, 1e-6),
    "IMPERIAL": (1609.344, 0.3048, 0.0254, 2.54e-5),
}
_PIXELS = 1000.0  # that a length as large as the surface is dragged


def coarse_name(name):
    """The name of the property that shows a length in coarser steps."""
    return name + _SUFFIX


def coarse_property(length, **details):
    """A property that shows the length of a name in its group; details: as in bpy.props. Keys are for the length."""

    def read(group):
        return getattr(group, length)

    def write(group, value):
        setattr(group, length, value)

    return bpy.props.FloatProperty(get=read, set=write, step=COARSE, options={"HIDDEN"}, **details)


def shown_name(owner, name):
    """The property that a row shows a setting by: in steps that fit the surface of its hair, or its own."""
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
    return name if is_keyed else coarse  # which would not show that it is


def per_pixel(step):
    """Units of the scene that a length with a step of `bpy.props` goes for each pixel, as Blender finds it."""
    units = bpy.context.scene.unit_settings
    plain = 0.01 * step
    if units.system == "NONE":
        return plain
    scale, known = units.scale_length, _UNITS[units.system]
    unit = _largest(known, 10.0 * plain * scale)
    return unit / scale * (plain if unit == _largest(known, scale) else 1.0)


def _largest(units, length):
    """The largest of units that a length is not shorter than, or the smallest of all."""
    return next((unit for unit in units if unit <= length * (1.0 + 1e-6)), units[-1])


def _size_of(datablock):
    """The largest dimension of the surface of Curves, or of an object, in the world; 0 of others."""
    surface = datablock if isinstance(datablock, bpy.types.Object) else getattr(datablock, "surface", None)
    return 0.0 if surface is None else max(surface.dimensions)
