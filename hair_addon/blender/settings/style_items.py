# SPDX-License-Identifier: GPL-3.0-or-later
"""Styles of a hair ↔ Blender's properties: a list of items, each with a name, a kind and that kind's settings.

A change marks the Curves as any other setting does. Keys follow their style (style_keys.py).
"""

from dataclasses import replace

import bpy

from ...core.errors import HairError
from ...core.params import declared
from ...core.styling import fitting
from ...core.styling.kinds import DESCRIPTIONS, KINDS, LABELS, MOST_STYLES, kind_of
from ..host.notices import text_of
from . import map_items, selection_names, setting_properties, style_keys
from .marks import mark_geometry, mark_wet_style
from .translations import CONTEXT

_UNKEYED = ("seed",)  # strands would jump


def _saved_selections(group, _context, _typed):
    guides = group.id_data.vellus.guide_curves
    return [] if guides is None else selection_names.names_of(guides)


_SEARCHES = {"center_guides": _saved_selections}  # {name: function that suggests values}


def _group_class(kind):
    """Return a property group class for the settings of a kind. Wetness also changes shading and motion."""
    update = mark_wet_style if kind == "WET" else mark_geometry
    annotations = setting_properties.annotations(KINDS[kind], update, unkeyed=_UNKEYED, searches=_SEARCHES)
    contents = {"__doc__": DESCRIPTIONS[kind], "__annotations__": annotations, "__module__": __name__}
    return type(f"Vellus{LABELS[kind]}", (bpy.types.PropertyGroup,), contents)


_GROUPS = {kind: _group_class(kind) for kind in KINDS}


def _renamed(item, name, present, _is_set):
    """Return a unique name for a style; data paths of keys with the old name are updated."""
    state = item.id_data.vellus
    others = [other for other in names_of(state) if other != present]
    name = unique_name(name.strip() or LABELS[item.kind], others)
    if present and name != present:
        names = names_of(state)
        renamed = [name if other == present else other for other in names]
        _follow_names(state, names, range(len(names)), renamed)
    return name


class VellusStyle(bpy.types.PropertyGroup):
    """A style of hair"""

    __annotations__ = {
        "name": bpy.props.StringProperty(
            name="Name", description="Name of the style", translation_context=CONTEXT, set_transform=_renamed
        ),
        "kind": bpy.props.EnumProperty(
            items=[(kind, LABELS[kind], DESCRIPTIONS[kind]) for kind in KINDS], options={"HIDDEN"}
        ),
        # The wanted and the enlarged size of a preset's locks [m], and the strand count at that time; zero
        # otherwise.
        "lock_wanted": bpy.props.FloatProperty(min=0.0, options={"HIDDEN"}),
        "lock_enlarged": bpy.props.FloatProperty(min=0.0, options={"HIDDEN"}),
        "lock_strands": bpy.props.IntProperty(min=0, options={"HIDDEN"}),
        **{kind.lower(): bpy.props.PointerProperty(type=_GROUPS[kind]) for kind in KINDS},
    }


CLASSES = (*_GROUPS.values(), VellusStyle)


def group_of(item):
    """Return the property group with an item's settings."""
    return getattr(item, item.kind.lower())


def settings_of(item):
    """Return the `StyleSettings` of an item. Raises `HairError`."""
    return setting_properties.to_settings(group_of(item), KINDS[item.kind])


def note_enlarged(item, wanted, enlarged, strand_count):
    """Note that locks of a wanted size [m] were enlarged because of a number of strands."""
    is_enlarged = enlarged > wanted
    item.lock_wanted, item.lock_enlarged = (wanted, enlarged) if is_enlarged else (0.0, 0.0)
    item.lock_strands = strand_count if is_enlarged else 0


def enlarged_of(item):
    """Return (wanted size [m], enlarged size [m], number of strands) of locks that still have their enlarged size.

    None for other styles.
    """
    if not item.lock_enlarged > 0.0:
        return None
    size = fitting.lock_size(settings_of(item))
    is_same = abs(size - item.lock_enlarged) <= 1e-4 * size
    return (item.lock_wanted, item.lock_enlarged, item.lock_strands) if is_same else None


def styles_of(state):
    """Return the `StyleSettings` of a hair's styles in order, disabled ones too; state: its `VellusCurves`."""
    return tuple(settings_of(item) for item in state.styles)


def names_of(state):
    """Return the names of a hair's styles in order."""
    return tuple(text_of(item, "name") for item in state.styles)


def make_names_readable(items, default_of):
    """Replace invalid UTF-8 bytes in names of a list, as in a damaged file: renaming such an item crashes Blender.

    default_of: function that returns the default name of an item.
    """
    for item in items:
        if not text_of(item, "name"):
            stored = item.bl_system_properties_get()
            name = stored.get("name", "").encode(errors="surrogateescape").decode(errors="replace")
            stored["name"] = unique_name(name or default_of(item), [text_of(other, "name") for other in items])


def default_name(item):
    """Return the name of a style without any."""
    return LABELS[item.kind]


def active_of(state):
    """Return the active item, None in an empty list."""
    return state.styles[state.active_style] if state.active_style < len(state.styles) else None


def wetness_of(state):
    """Return the amount of the wettest enabled style, from 0 to 1."""
    return max((item.wet.amount for item in state.styles if item.kind == "WET" and item.wet.is_on), default=0.0)


def masks_of(item):
    """Return (name of the group or attribute, name of the image) that mask a style; empty for none."""
    group = group_of(item)
    return text_of(group, "mask"), text_of(group, "mask_image")


def have_masks(state):
    """Whether any style of a hair's settings has a mask."""
    return any(any(masks_of(item)) for item in state.styles)


def center_guides_of(state):
    """Names of the selections of guides at the centers of a hair's locks."""
    return {text_of(group_of(item), "center_guides") for item in state.styles if is_at_guides(item)} - {""}


def is_at_guides(item):
    """Whether a style has the centers of its largest locks at guides."""
    return getattr(group_of(item), "centers", "") == "GUIDES"


def objects_named(state):
    """Names of the objects that a hair's styles read."""
    leaning = [item.lean for item in state.styles if item.kind == "LEAN" and item.lean.direction == "OBJECT"]
    cutters = {text_of(item.trim, "cutter") for item in state.styles if item.kind == "TRIM"}
    return (cutters | {text_of(lean, "target") for lean in leaning}) - {""}


def unique_name(name, others):
    """Return a name, numbered as in Blender if it is taken: Curl, Curl.001."""
    if name not in others:
        return name
    stem, _, number = name.rpartition(".")
    stem = stem if stem and number.isdigit() else name
    return next(tried for tried in (f"{stem}.{number:03d}" for number in range(1, 10**6)) if tried not in others)


def new_seed(state):
    """Return a seed that none of a hair's styles uses."""
    taken = {group_of(item).seed for item in state.styles}
    return next(seed for seed in range(len(taken) + 1) if seed not in taken)


def require_room(count):
    """Raise `HairError` if a number of styles exceeds the limit."""
    if count > MOST_STYLES:
        raise HairError("Hair has at most {count} styles: remove one first.", count=MOST_STYLES)


def add(state, settings, name="", place=None):
    """Add a style, at the end or at an index of the list, and make it active. Raises `HairError`."""
    require_room(len(state.styles) + 1)
    names = names_of(state)
    place = len(names) if place is None else place
    _append(state, settings, name)
    state.styles.move(len(names), place)
    places = [index + (index >= place) for index in range(len(names))]
    _follow_names(state, names, places, names_of(state))
    state.active_style = place
    mark_wet_style(state, None)


def duplicate(state, place):
    """Add a copy of a style after it, without keys and with a seed of its own. Raises `HairError`."""
    item = state.styles[place]
    name = text_of(item, "name")
    add(state, replace(settings_of(item), seed=new_seed(state)), name, place + 1)
    map_items.copy_of_style(state, name, names_of(state)[place + 1])


def move(state, place, to):
    """Move a style from one index of the list to another."""
    names = names_of(state)
    order = list(range(len(names)))
    order.insert(to, order.pop(place))
    state.styles.move(place, to)
    _follow(state, names, order)
    state.active_style = to


def remove(state, place):
    """Remove a style with its keys."""
    names = names_of(state)
    state.styles.remove(place)
    _follow(state, names, [index for index in range(len(names)) if index != place])
    state.active_style = min(state.active_style, max(len(state.styles) - 1, 0))


def assign(state, styles, names=None):
    """Replace all styles; names: of each; empty, or None for all, reuses names of present styles of that kind.

    Styles with an unchanged name and kind keep their keys. Nothing is marked if nothing changes. Raises `HairError`.
    """
    require_room(len(styles))
    styles = [setting_properties.as_stored(settings) for settings in styles]
    before = [(text_of(item, "name"), item.kind) for item in state.styles]
    wanted = _named(state, styles, names)
    if wanted != before:
        order = [before.index(pair) if pair in before else None for pair in wanted]
        state.styles.clear()
        for (name, _kind), settings in zip(wanted, styles, strict=True):
            _append(state, settings, name)
        _follow(state, [name for name, _kind in before], order)
        state.active_style = min(state.active_style, max(len(styles) - 1, 0))
    for item, settings in zip(state.styles, styles, strict=True):
        if settings_of(item) != settings:
            setting_properties.assign(group_of(item), settings)


def _append(state, settings, name):
    item = state.styles.add()
    item.kind = kind_of(settings)
    item.name = name or LABELS[item.kind]
    setting_properties.assign(group_of(item), settings)


def _named(state, styles, names):
    """Return unique [(name, kind)] of styles; unnamed styles take names of equal present styles, then of their kind."""
    present = dict(zip(names_of(state), styles_of(state), strict=True))
    taken = list(names or [""] * len(styles))
    for is_same in (lambda a, b: a == b, lambda a, b: type(a) is type(b)):
        for place, style in enumerate(styles):
            if not taken[place]:
                free = (name for name in present if name not in taken and is_same(present[name], style))
                taken[place] = next(free, "")
    named = []
    for style, name in zip(styles, taken, strict=True):
        kind = kind_of(style)
        others = [other for other, _kind in named] + ([] if name else taken)
        named.append((unique_name(name or LABELS[kind], others), kind))
    return named


def _follow(state, names, order):
    """Update keys and mark the hair; order: previous index of each style in the list, None for a new style."""
    places = [order.index(index) if index in order else None for index in range(len(names))]
    _follow_names(state, names, places, names_of(state))
    mark_wet_style(state, None)


def _follow_names(state, names, places, new_names):
    """Update keys and maps of styles; names: before; places: their new indices, None for a removed style."""
    style_keys.follow(state.id_data, style_keys.Rearrangement(names, places, new_names))
    map_items.follow_styles(state, names, places, new_names)


def values_of(item):
    """Return {name: value} of an item's settings, for comparison."""
    return setting_properties.values_of(group_of(item), [name for name, *_ in declared(KINDS[item.kind])])
