# SPDX-License-Identifier: GPL-3.0-or-later
"""Notes on styles without effect, or in a misleading place in the list.

Panels call these on every redraw, so geometry is not read.
"""

from collections.abc import Iterator
from dataclasses import replace

import bpy
from bpy.types import Curves, PropertyGroup

from ....core.styling import clump_trees, fitting, program
from ....core.styling.base import ProfiledSettings
from ....core.styling.kinds import KINDS
from ...data.strands import curves, selection_sets
from ...host.notices import text_of
from ...settings import style_items
from ...settings.translations import interface_text
from .. import bindings

# {kind: settings}; a style has no effect if all of them are zero or empty.
_WITHOUT = {
    "CURL": ("radius",),
    "FRIZZ": ("amplitude",),
    "BEND": ("angle",),
    "TRIM": ("random", "to_length", "undercoat", "cutter"),
}

_NEARLY = 0.9  # fraction of the size of locks above which the fitting size is not noted

_OBJECTS = {"TRIM": "cutter", "LEAN": "target"}


def notes_of(hair: Curves, item: PropertyGroup) -> list[str]:
    """Return translated sentences about a style of a hair Curves datablock; item: the style's properties."""
    return [
        *_without_effect(item),
        *_missing_data(hair, item),
        *_too_small(hair, item),
        *_enlarged(hair, item),
        *_order(hair, item),
    ]


def _without_effect(item: PropertyGroup) -> Iterator[str]:
    group = style_items.group_of(item)
    if not group.is_on:
        yield interface_text("The style is disabled.")
    elif group.amount == 0.0:
        yield interface_text("No effect: the amount is zero.")
    elif issubclass(KINDS[item.kind], ProfiledSettings) and group.root == group.tip == 0.0:
        yield interface_text("No effect: the amount is zero at root and tip.")
    elif _is_neutral(item, group):
        yield interface_text("No effect with these settings.")


def _is_neutral(item, group):
    if item.kind == "TRIM" and group.factor != 1.0:
        return False
    return item.kind in _WITHOUT and not any(text_of(group, name) for name in _WITHOUT[item.kind])


def _missing_data(hair: Curves, item: PropertyGroup) -> Iterator[str]:
    group = style_items.group_of(item)
    name = text_of(group, _OBJECTS[item.kind]) if item.kind in _OBJECTS else ""
    mask, image = style_items.masks_of(item)
    is_used = item.kind != "LEAN" or group.direction == "OBJECT"
    if is_used and name and name not in bpy.data.objects:
        yield interface_text('No object "{name}": pick another.', name=name)
    if is_used and item.kind == "LEAN" and not name:
        yield interface_text("Pick an object to lean along.")
    if mask and not _has_mask(hair, mask):
        yield interface_text('No vertex group or attribute "{name}".', name=mask)
    selection = text_of(group, "center_guides") if style_items.is_at_guides(item) else ""
    guides = hair.vellus.guide_curves
    if selection and guides is not None and not selection_sets.has(guides, selection):
        yield interface_text('No selection "{name}": pick another.', name=selection)
    if image and image not in bpy.data.images:
        yield interface_text('No image "{name}": pick another.', name=image)


def _has_mask(hair, name):
    """Whether surface or guides have a mask; modifiers of the surface may create any attribute."""
    surface, guides = curves.grown_on(hair), hair.vellus.guide_curves
    if surface is not None and (surface.modifiers or name in surface.vertex_groups or name in surface.data.attributes):
        return True
    return surface is None or (guides is not None and name in guides.attributes)


def _too_small(hair: Curves, item: PropertyGroup) -> Iterator[str]:
    """Yield a note on locks that are too small; only for hair styled since the file was opened."""
    bound = bindings.of(hair)
    if bound is None or bound.styles.styling is None:
        return
    styling, tree = bound.styles.styling, program.tree_settings(style_items.settings_of(item))
    if tree is None:
        return
    # A map of the size gives a style several trees.
    used = next((known for known, _level in styling.tree_levels if _has_settings(known, tree)), tree)
    finest = min(used.variants or (tree,), key=lambda each: min(each.sizes))
    factor = clump_trees.size_factor(styling.trees.area, finest)
    if factor > 1.0:
        size = _shown(factor * finest.sizes[0])
        yield interface_text("The locks are too small for this surface: a size of {size} is used.", size=size)


def _has_settings(known, tree):
    """Whether a clump tree has the settings of a style's tree."""
    return replace(known, variants=(), guides=None) == tree


def _enlarged(hair: Curves, item: PropertyGroup) -> Iterator[str]:
    """Yield a note on locks of a preset that were enlarged because there were few strands."""
    known = style_items.enlarged_of(item)
    is_without_size = style_items.is_at_guides(item) and getattr(style_items.group_of(item), "levels", 1) == 1
    if known is None or is_without_size:
        return
    fitting_now = fitting.lock_size_for(*known, hair.vellus.hair.strand_count)
    sizes = dict(zip(("wanted", "size", "fitting"), map(_shown, (*known[:2], fitting_now)), strict=True))
    if fitting_now > _NEARLY * known[1]:
        yield interface_text("Locks have a size of {size} instead of {wanted}, because there are few strands.", **sizes)
    else:
        yield interface_text("Strands are denser now: locks with a size of {fitting} fit them.", **sizes)


def _shown(length):
    """Return a length [m] as text in the scene's units."""
    return bpy.utils.units.to_string(bpy.context.scene.unit_settings.system, "LENGTH", length, precision=3)


def _order(hair: Curves, item: PropertyGroup) -> Iterator[str]:
    items = list(hair.vellus.styles)
    place = items.index(item)
    if item.kind == "WET" and any(style_items.group_of(below).is_on for below in items[place + 1 :]):
        yield interface_text("Wet should be the last style: move it down.")
    if item.kind == "LEAN" and any(above.kind != "LEAN" for above in items[:place]):
        yield interface_text("Lean acts on guides, before all other styles.")
