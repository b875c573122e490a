# SPDX-License-Identifier: GPL-3.0-or-later
"""Sizes that are fitted to the surface and its mask until they are set by hand: length, gravity, drape, thickness and
influence distance.

Property groups of Curves have a flag for each size, such as `fits_length` for `length`: setting the size by hand, by a
script or by a key clears it. Operators store the sizes they have shown; a size stays fitted while it
equals the stored one.
"""

import json
from dataclasses import replace

import bpy

from ...core.params import declared, from_surface
from . import style_keys
from .translations import CONTEXT

_PREFIX = "fits_"
_FOUND = ("drape",)  # computed when guides are made, not from settings left open
SHOWN = "shown_sizes"  # property of operators: JSON {name: value}


def fitted(settings_class):
    """Return the names of the settings of a class that are fitted to the surface until they are set."""
    sizes = from_surface(settings_class)
    return tuple(name for name, *_ in declared(settings_class) if name in sizes or name in _FOUND)


def flag_of(name):
    """Name of the flag of a size."""
    return _PREFIX + name


def group_properties(names, update):
    """Return {flag: bpy property} for some sizes of a property group; update: as in bpy.props."""

    def refit(group, context):
        group.id_data.vellus.fit_key = ""
        update(group, context)

    return {
        flag_of(name): bpy.props.BoolProperty(
            name="Fitted",
            description="Fit this setting to the surface and its mask. Turned off when the setting is changed",
            translation_context=CONTEXT,
            options=set(),
            update=refit,
        )
        for name in names
    }


def operator_properties():
    """Return {name: bpy property} in which operators store shown sizes."""
    return {SHOWN: bpy.props.StringProperty(options={"HIDDEN", "SKIP_SAVE"})}


def by_hand(name, update):
    """Return an `update` for a size that clears its flag."""

    def changed(group, context):
        keep_flags(group, {name: False})
        update(group, context)

    return changed


def keep_flags(group, flags):
    """Set flags {name of the size: whether it is fitted} without their `update`."""
    stored = group.bl_system_properties_get(do_create=True)
    for name, is_fitted in flags.items():
        stored[flag_of(name)] = is_fitted


def keep_values(group, values):
    """Set fitted sizes {name: value} without their `update`."""
    stored = group.bl_system_properties_get(do_create=True)
    for name, value in values.items():
        stored[name] = value


def names_in(group, settings_class):
    """Return the fitted sizes of a property group; animated sizes are not fitted."""
    names = {name for name in fitted(settings_class) if getattr(group, flag_of(name))}
    if not names:
        return names
    keyed, path = style_keys.keyed_paths(group.id_data), group.path_from_id()
    return {name for name in names if f"{path}.{name}" not in keyed}


def opened(settings, names):
    """Return `Settings` with some sizes set to None, to be computed from the surface."""
    return replace(settings, **{name: None for name in from_surface(type(settings)) if name in names})


def open_names(settings):
    """Return the sizes of `Settings` that are None, to be computed."""
    return {name for name in from_surface(type(settings)) if getattr(settings, name) is None}


def is_open(operator, name):
    """Whether a size of an operator was not given: it is not set, or equals the value shown."""
    if not operator.properties.is_property_set(name):
        return True
    shown = _shown(operator)
    return name in shown and shown[name] == getattr(operator, name)


def show(operator, group, settings_class):
    """Show the sizes of a group in an operator's redo panel; fitted sizes stay fitted."""
    for name in fitted(settings_class):
        setattr(operator, name, getattr(group, name))
    others = {name: value for name, value in _shown(operator).items() if name not in fitted(settings_class)}
    own = {name: getattr(operator, name) for name in names_in(group, settings_class)}
    setattr(operator, SHOWN, json.dumps(others | own))


def _shown(operator):
    text = getattr(operator, SHOWN)
    return json.loads(text) if text else {}
