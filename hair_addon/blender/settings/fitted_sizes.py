# SPDX-License-Identifier: GPL-3.0-or-later
"""Sizes that are fitted to the surface and its mask until they are set by hand: length, gravity, drape, thickness and
influence distance.

Groups of Curves have a flag beside each, `fits_length` for `length`: setting the size, by hand, by a script or by a
key, clears it. Operators remember what they have shown, and take it for fitted while nobody changes it.
"""

import json
from dataclasses import replace

import bpy

from ...core.params import declared, from_surface
from . import style_keys
from .translations import CONTEXT

_PREFIX = "fits_"
_FOUND = ("drape",)  # by what makes new guides, and not by settings that are left open
SHOWN = "shown_sizes"  # property of operators: JSON {name: value}


def fitted(settings_class):
    """Names of the settings of a class that are fitted to the surface until they are set."""
    sizes = from_surface(settings_class)
    return tuple(name for name, *_ in declared(settings_class) if name in sizes or name in _FOUND)


def flag_of(name):
    """Name of the flag of a size."""
    return _PREFIX + name


def group_properties(names, update):
    """{flag: bpy property} of a property group, for some sizes; update: as in bpy.props."""

    def refit(group, context):
        group.id_data.vellus.fit_key = ""
        update(group, context)

    return {
        flag_of(name): bpy.props.BoolProperty(
            name="Fitted",
            description="Fit this to the surface and its mask. Off once it is set by hand",
            translation_context=CONTEXT,
            options=set(),
            update=refit,
        )
        for name in names
    }


def operator_properties():
    """{name: bpy property} that operators remember shown sizes in."""
    return {SHOWN: bpy.props.StringProperty(options={"HIDDEN", "SKIP_SAVE"})}


def by_hand(name, update):
    """An `update` of a size: it is no longer fitted."""

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
    """The sizes of a property group that are fitted; what keys or drivers move is not."""
    names = {name for name in fitted(settings_class) if getattr(group, flag_of(name))}
    if not names:
        return names
    keyed, path = style_keys.keyed_paths(group.id_data), group.path_from_id()
    return {name for name in names if f"{path}.{name}" not in keyed}


def opened(settings, names):
    """`Settings` with some sizes left to be computed from the surface."""
    return replace(settings, **{name: None for name in from_surface(type(settings)) if name in names})


def open_names(settings):
    """The sizes of `Settings` that are left to be computed."""
    return {name for name in from_surface(type(settings)) if getattr(settings, name) is None}


def is_open(operator, name):
    """Whether an operator was not given a size: it is not set, or as the operator has shown it."""
    if not operator.properties.is_property_set(name):
        return True
    shown = _shown(operator)
    return name in shown and shown[name] == getattr(operator, name)


def show(operator, group, settings_class):
    """Show the sizes of a group in an operator's redo panel, of which those that are fitted stay so."""
    for name in fitted(settings_class):
        setattr(operator, name, getattr(group, name))
    others = {name: value for name, value in _shown(operator).items() if name not in fitted(settings_class)}
    own = {name: getattr(operator, name) for name in names_in(group, settings_class)}
    setattr(operator, SHOWN, json.dumps(others | own))


def _shown(operator):
    text = getattr(operator, SHOWN)
    return json.loads(text) if text else {}
