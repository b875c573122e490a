# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings ↔ Blender's properties: each default, range, unit and tooltip comes from the `Settings` classes."""

import math
from dataclasses import replace
from functools import lru_cache

import bpy
import numpy as np

from ...core.errors import HairError
from ...core.params import declared, from_surface, label_of
from ...core.placement import densities
from ..host.notices import text_of
from . import fitted_sizes, length_steps, object_names
from .translations import CONTEXT

_SMALL_WORDS = {"in", "of", "per", "to", "with"}  # stay lower case in titles


def annotations(settings_class, update=None, skip=(), unkeyed=(), high=None, override=frozenset(), searches=None):
    """Return {name: bpy property} for the fields of a `Settings` class except `skip`; `update` as in bpy.props.

    A radius also gets a diameter property, which is shown in its place. Operators have no `update`, and do not keep
    text, which names data of one file. Structural settings and those of `unkeyed` cannot be keyed. high: {name:
    maximum} of fields with a shorter range here; searches: {name: function that suggests values}, as in bpy.props.
    """
    highs = high or {}
    made = {}
    sizes = [name for name in fitted_sizes.fitted(settings_class) if name not in skip]
    if sizes:
        made |= fitted_sizes.operator_properties() if update is None else fitted_sizes.group_properties(sizes, update)
    mark = update
    for name, default, details in declared(settings_class):
        if name not in skip:
            update = fitted_sizes.by_hand(name, mark) if mark is not None and name in sizes else mark
            details = replace(details, high=highs.get(name, details.high))
            is_unkeyed = details.is_structural or name in unkeyed
            search = (searches or object_names.SEARCHES).get(name)
            made[name] = _property(name, default, details, update, is_unkeyed, set(override), search)
            if mark is not None and _is_length(default, details):
                made[length_steps.coarse_name(name)] = _coarse_property(name, details)
            if details.diameter is not None:
                shown, description = details.diameter
                made[shown] = _diameter_property(name, shown, description, details, update)
    return made


def _property(name, default, details, update, is_unkeyed, override, search):
    common = {"name": _title(label_of(name, details)), "description": details.description, "default": default}
    common["translation_context"], common["override"] = CONTEXT, override
    if is_unkeyed:
        common["options"] = set()
    if update is not None:
        common["update"] = update
    elif details.diameter is not None:
        common["options"] = {"HIDDEN"}  # an operator shows the diameter
    if isinstance(default, str):
        if details.choices:
            return bpy.props.EnumProperty(items=details.choices, **common)
        if update is None:
            common["options"] = common.get("options", set()) | {"SKIP_SAVE"}
        return bpy.props.StringProperty(**common, **({} if search is None else {"search": search}))
    if isinstance(default, bool):
        return bpy.props.BoolProperty(**common)
    limits = _limits(details, isinstance(default, int))
    if isinstance(default, int):
        return bpy.props.IntProperty(**common, **limits)
    limits["precision"] = details.precision
    if isinstance(default, tuple):
        return bpy.props.FloatVectorProperty(size=len(default), subtype=details.subtype, **common, **limits)
    if update is not None and _is_length(default, details):
        limits["step"] = length_steps.FINE
    # A subtype such as DISTANCE or ANGLE implies its unit.
    return bpy.props.FloatProperty(subtype=details.subtype, unit=details.unit, **common, **limits)


def _is_length(default, details):
    return isinstance(default, float) and details.unit == "LENGTH" and details.diameter is None


def _coarse_property(name, details):
    """Property that shows a length of a property group in coarser steps."""
    common = {"name": _title(label_of(name, details)), "description": details.description}
    common |= {"translation_context": CONTEXT, "subtype": details.subtype, "unit": details.unit}
    limits = _limits(replace(details, soft_high=100.0 * details.soft_high), False)
    return length_steps.coarse_property(name, precision=details.precision, **common, **limits)


def _diameter_property(radius, name, description, details, update):
    """Return a radius shown as a diameter in millimeters, independent of the scene's units."""
    low, high = (_millimeters_of(limit) for limit in (_limits(details, False)["min"], details.high))
    common = {"name": _title(label_of(name, details)), "description": description, "translation_context": CONTEXT}
    common |= {"unit": "CAMERA", "min": low, "max": high, "soft_max": 1e3, "step": 1, "precision": 3}
    if update is None:

        def take(operator, _context):
            setattr(operator, radius, _radius_of(getattr(operator, name)))

        # Stored, as a script may set only the diameter: Blender does not call `set` of an operator's arguments.
        return bpy.props.FloatProperty(update=take, **common)

    def read(group):
        return _millimeters_of(getattr(group, radius))

    def write(group, value):
        # Bypass the property: its `update` tags the depsgraph, which may be evaluating animation now.
        wanted = min(max(_radius_of(value), _limits(details, False)["min"]), details.high)
        group.bl_system_properties_get(do_create=True)[radius] = wanted

    return bpy.props.FloatProperty(get=read, set=write, update=update, **common)


def _millimeters_of(radius):
    return 2e3 * unit_length() * radius


def _radius_of(millimeters):
    return shortest(millimeters) / (2e3 * unit_length())


def unit_length():
    """Return the meters in a unit of the scene."""
    scene = getattr(bpy.context, "scene", None)  # no scene exists while add-ons are registered
    return 1.0 if scene is None else scene.unit_settings.scale_length


def _title(label):
    """Return a label in Blender's title case: Melanin Redness, IOR, Samples per Side."""
    return " ".join(word if word in _SMALL_WORDS else word[:1].upper() + word[1:] for word in label.split())


def _limits(details, is_integer):
    # Blender has no exclusive limits; ten nanometers represent "above zero".
    low = max(details.low, details.above + 1e-8) if math.isfinite(details.above) else details.low
    limits = {"min": low, "max": details.high, "soft_max": min(details.soft_high, details.high)}
    finite = {key: value for key, value in limits.items() if math.isfinite(value)}
    return {key: int(value) for key, value in finite.items()} if is_integer else finite


def to_settings(owner, settings_class, skip=()):
    """Return the `Settings` stored in an operator or property group, with defaults for those of `skip`.

    Raises `HairError` for values out of range.
    """
    fields = [field for field in declared(settings_class) if field[0] not in skip]
    try:
        values = [getattr(owner, name) for name, _default, _details in fields]
    except UnicodeDecodeError as error:
        raise HairError("A name in the hair settings is not valid UTF-8: pick the item again.") from error
    held = (tuple(value) if isinstance(field[1], tuple) else value for value, field in zip(values, fields, strict=True))
    return _settings_of(settings_class, tuple(skip), tuple(held))


@lru_cache(maxsize=256)  # settings are read with every step of a stroke
def _settings_of(settings_class, skip, values):
    fields = [field for field in declared(settings_class) if field[0] not in skip]
    return settings_class(
        **{name: plain(value, default, details) for (name, default, details), value in zip(fields, values, strict=True)}
    )


def plain(value, default, details):
    """Undo the rounding of a property's value to single precision: 0.15 is stored as 0.15000000596."""
    if isinstance(default, float):
        # Defaults and limits such as 15° in radians have no short decimal; rounded up they would be out of range.
        for meant in (default, details.low, details.high):
            if np.float32(meant) == np.float32(value):
                return meant
        return shortest(value)
    if isinstance(default, tuple):
        return tuple(plain(float(part), meant, details) for part, meant in zip(value, default, strict=True))
    return value


@lru_cache(maxsize=64)
def as_stored(settings):
    """Return `Settings` as properties store them: within Blender's limits, in single precision."""
    values = {
        name: plain(_limited(getattr(settings, name), default, details), default, details)
        for name, default, details in declared(type(settings))
    }
    return replace(settings, **values)


def _limited(value, default, details):
    """Clamp a number to the property's minimum, which represents "above zero"."""
    if isinstance(default, tuple):
        return tuple(_limited(part, meant, details) for part, meant in zip(value, default, strict=True))
    return max(value, _limits(details, False).get("min", value)) if isinstance(default, float) else value


def shortest(value):
    """Return the shortest decimal that equals a value in single precision, as it was typed."""
    return float(str(np.float32(value)))


def given_settings(operator, settings_class, skip=()):
    """Return the `Settings` given to an operator.

    Sizes fitted to the surface are None unless the operator was called with them or they were changed. skip and errors
    as in `to_settings`.
    """
    is_given = operator.properties.is_property_set
    for radius, diameter in diameters(settings_class):
        if is_given(diameter) and not is_given(radius):
            setattr(operator, radius, _radius_of(getattr(operator, diameter)))
    names = [name for name in from_surface(settings_class) if name not in skip]
    left_open = {name: None for name in names if fitted_sizes.is_open(operator, name)}
    return replace(to_settings(operator, settings_class, skip), **left_open)


def show(operator, group, settings_class):
    """Show sizes, and the number for a density, in an operator's redo panel.

    Fitted sizes are computed again when another setting changes.
    """
    fitted_sizes.show(operator, group, settings_class)
    for density, count in densities.COUNTS.items():
        if density in names_of(settings_class) and getattr(group, density) > 0.0:
            setattr(operator, count, getattr(group, count))
    for radius, diameter in diameters(settings_class):
        setattr(operator, diameter, shortest(_millimeters_of(shortest(getattr(group, radius)))))


def diameters(settings_class):
    """Return [(name of a radius, name of its diameter)] of a class."""
    return [(name, details.diameter[0]) for name, _default, details in declared(settings_class) if details.diameter]


def is_stored_as(settings, others, skip=()):
    """Whether `Settings` of one class are equal once stored in properties, ignoring those of `skip`."""
    first, second = as_stored(settings), as_stored(others)
    return all(getattr(first, name) == getattr(second, name) for name in names_of(type(first)) if name not in skip)


def names_of(settings_class):
    """Names of the settings of a class, in the order of declaration."""
    return tuple(name for name, _default, _details in declared(settings_class))


def assign(owner, settings, skip=(), fits=()):
    """Write `Settings` except `skip` to the properties of an operator or group; fits: names of fitted sizes."""
    for name, _default, _details in declared(type(settings)):
        if name not in skip:
            setattr(owner, name, getattr(settings, name))
    if fits:
        fitted_sizes.keep_flags(owner, dict.fromkeys(fits, True))


def values_of(owner, names):
    """Return {name: value} of an operator's or group's properties, for comparison."""
    values = {name: text_of(owner, name) for name in names}  # any value may be text
    return {n: value[:] if isinstance(value, bpy.types.bpy_prop_array) else value for n, value in values.items()}


def prefill(operator, group, settings_class):
    """Initialize an operator with the settings of a property group."""
    for name, _default, _details in declared(settings_class):
        setattr(operator, name, getattr(group, name))
    show(operator, group, settings_class)
