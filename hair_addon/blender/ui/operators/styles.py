# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators of styles: their list, painted masks, presets and saved ones."""

import math

import bpy

from ....core.files import style_presets
from ....core.styling.kinds import DESCRIPTIONS, OFFERS
from ....core.styling.program import tree_settings
from ...data.strands.curves import grown_on, require_editable
from ...groom.selection import hair_of
from ...groom.styles import hair_styles, painted_density, painted_masks
from ...groom.transfer import groom_settings
from ...settings import properties, saved_styles, style_items
from .base.hair_operator import HairOperator, needs_hair
from .base.modal import LongOperator


def active_style_of(context):
    """Return the properties of the active hair's active style, None if there is none."""
    hair = hair_of(context.object)
    return None if hair is None else style_items.active_of(hair.vellus)


@classmethod
def needs_style(cls, context):
    """`applies` of operators on the active style of the active hair."""
    cls.poll_message_set("Select hair with styles.")
    return active_style_of(context) is not None


def fit_switch():
    """Return the property of operators that can fit lengths to the surface."""
    description = "Scale lengths, which suit a human head, to the size of the surface"
    return properties.switch("Fit to Surface", description, True)


def keep_switch():
    """Return the property of operators that can add styles instead of replacing them."""
    description = "Add the styles of the preset after the existing ones instead of replacing them"
    return properties.switch("Keep Styles", description, False)


class _GivesStyles(LongOperator):
    """Operators that add styles to hair; locks are placed in a thread."""

    applies = needs_hair
    has_run = True  # kernels of styles are loaded like those of hair

    def styles(self, context):
        """Return the styles to add that take time to place."""
        raise NotImplementedError

    def seconds(self, context):
        """Unknown for styles with locks: on slivers these take a hundred times as long as elsewhere."""
        return math.inf if any(tree_settings(style) is not None for style in self.styles(context)) else 0.0


class VELLUS_OT_add_style(_GivesStyles, bpy.types.Operator):
    """Add a style to the active hair, after its other styles"""

    bl_idname = "vellus.add_style"
    bl_label = "Add Style"
    __annotations__ = {
        "style": properties.choice(
            "Style",
            "Style to add",
            {identifier: offer.label for identifier, offer in OFFERS.items()},
            {identifier: DESCRIPTIONS[offer.kind] for identifier, offer in OFFERS.items()},
        ),
        "is_fitted": fit_switch(),
    }

    def styles(self, context):
        return [OFFERS[self.style].settings]

    def work(self, context):
        offer = OFFERS[self.style]
        return hair_styles.adding(hair_of(context.object), offer.settings, offer.label, self.is_fitted)

    def message(self, made):
        return OFFERS[self.style].label, {}


class VELLUS_OT_move_style(HairOperator, bpy.types.Operator):
    """Move the active style up or down; styles are applied from top to bottom"""

    bl_idname = "vellus.move_style"
    bl_label = "Move Style"
    applies = needs_style
    __annotations__ = {
        "direction": properties.choice("Direction", "Direction to move the style in", {"UP": "Up", "DOWN": "Down"})
    }

    def change(self, context):
        hair = hair_of(context.object)
        require_editable(hair)
        state = hair.vellus
        to = state.active_style + (1 if self.direction == "DOWN" else -1)
        if 0 <= to < len(state.styles):
            style_items.move(state, state.active_style, to)


class VELLUS_OT_remove_style(HairOperator, bpy.types.Operator):
    """Remove the active style and its keyframes"""

    bl_idname = "vellus.remove_style"
    bl_label = "Remove Style"
    applies = needs_style

    def change(self, context):
        hair = hair_of(context.object)
        require_editable(hair)
        style_items.remove(hair.vellus, hair.vellus.active_style)


class VELLUS_OT_duplicate_style(_GivesStyles, bpy.types.Operator):
    """Duplicate the active style, without its keyframes; the copy has another random seed"""

    bl_idname = "vellus.duplicate_style"
    bl_label = "Duplicate Style"
    applies = needs_style

    def styles(self, context):
        return [style_items.settings_of(active_style_of(context))]

    def work(self, context):
        return hair_styles.duplicating(hair_of(context.object))

    def message(self, made):
        return "Style duplicated", {}


class VELLUS_OT_use_points(HairOperator, bpy.types.Operator):
    """Increase the points per strand to what the curls of the active hair need to be smooth"""

    bl_idname = "vellus.use_points"
    bl_label = "Use Points for Curls"
    applies = needs_hair

    def change(self, context):
        return "{count} points per strand", {"count": hair_styles.use_points(hair_of(context.object))}


class _Paint(HairOperator):
    """Mixin of operators that start or stop painting on the surface of the active hair."""

    asked = ""  # message if nothing can be painted

    @classmethod
    def applies(cls, context):
        if painted_masks.is_painting(context.object):
            return True
        cls.poll_message_set(cls.asked)
        hair = hair_of(context.object)
        return context.mode == "OBJECT" and hair is not None and grown_on(hair) is not None

    def begin(self, hair, context):
        """Start painting for hair Curves. Raises `HairError`."""
        raise NotImplementedError

    def change(self, context):
        if painted_masks.is_painting(context.object):
            painted_masks.stop(context.object, context)
        else:
            self.begin(hair_of(context.object), context)


class VELLUS_OT_paint_style_mask(_Paint, bpy.types.Operator):
    """Paint the mask of the active style with Blender's brushes, while the hair follows; or stop painting"""

    bl_idname = "vellus.paint_style_mask"
    bl_label = "Paint Style Mask"

    asked = "Select hair with styles, on a surface, in Object Mode."

    @classmethod
    def applies(cls, context):
        has_style = painted_masks.is_painting(context.object) or active_style_of(context) is not None
        return super().applies(context) and has_style

    def begin(self, hair, context):
        painted_masks.paint(hair, active_style_of(context), context)


class VELLUS_OT_paint_density(_Paint, bpy.types.Operator):
    """Paint the density of strands on the surface with Blender's brushes, or stop painting"""

    bl_idname = "vellus.paint_density"
    bl_label = "Paint Density"

    asked = "Select hair on a surface, in Object Mode."

    def begin(self, hair, context):
        painted_density.paint(hair, context)


class VELLUS_OT_mask_from_selection(HairOperator, bpy.types.Operator):
    """Limit the active style to the selected guides, as painted in Sculpt Mode"""

    bl_idname = "vellus.mask_from_selection"
    bl_label = "Mask from Selected Guides"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select hair with styles and guides.")
        hair = hair_of(context.object)
        has_guides = hair is not None and hair.vellus.guide_curves is not None
        return has_guides and active_style_of(context) is not None

    def change(self, context):
        count = painted_masks.from_selection(hair_of(context.object), active_style_of(context))
        return "{count} guides in the mask", {"count": count}


class VELLUS_OT_apply_style_preset(_GivesStyles, bpy.types.Operator):
    """Apply the styles of a built-in preset to the active hair"""

    bl_idname = "vellus.apply_style_preset"
    bl_label = "Apply Style Preset"
    __annotations__ = {
        "preset": properties.choice("Preset", "Preset to apply", style_presets.PRESETS),
        "is_fitted": fit_switch(),
        "keeps_styles": keep_switch(),
    }

    def styles(self, context):
        return style_presets.read(self.preset).styles or ()

    def work(self, context):
        preset = style_presets.read(self.preset)
        return hair_styles.applying_preset(hair_of(context.object), preset, self.is_fitted, self.keeps_styles)

    def message(self, made):
        return style_presets.PRESETS[self.preset], {}


class VELLUS_OT_apply_saved_style(_GivesStyles, bpy.types.Operator):
    """Apply the styles of a saved preset to the active hair"""

    bl_idname = "vellus.apply_saved_style"
    bl_label = "Apply Saved Style"
    __annotations__ = {
        "name": properties.text("Name", "Saved style preset"),
        "is_fitted": properties.switch(
            "Fit to Surface", "Multiply lengths by the size of the surface, as if saved from a human head", False
        ),
        "keeps_styles": keep_switch(),
    }

    def styles(self, context):
        return saved_styles.read(self.name).styles or ()

    def work(self, context):
        preset = saved_styles.read(self.name)
        return hair_styles.applying_preset(hair_of(context.object), preset, self.is_fitted, self.keeps_styles)

    def message(self, made):
        return "Style preset {name} applied", {"name": self.name}


class VELLUS_OT_save_style_preset(HairOperator, bpy.types.Operator):
    """Save the active hair's styles for use in every file"""

    bl_idname = "vellus.save_style_preset"
    bl_label = "Save Style Preset"
    bl_options = {"REGISTER"}
    __annotations__ = {"name": properties.text("Name", "Name of the preset")}
    applies = needs_hair

    def invoke(self, context, _event):
        return context.window_manager.invoke_props_dialog(self)

    def change(self, context):
        saved_styles.write(self.name, groom_settings.settings_of(hair_of(context.object)))
        return "Style preset {name} saved", {"name": self.name}


class VELLUS_OT_remove_style_preset(HairOperator, bpy.types.Operator):
    """Delete a saved style preset permanently"""

    bl_idname = "vellus.remove_style_preset"
    bl_label = "Remove Style Preset"
    bl_options = {"REGISTER", "INTERNAL"}
    __annotations__ = {"name": properties.text("Name", "Saved style preset")}

    def change(self, _context):
        saved_styles.remove(self.name)


CLASSES = (
    VELLUS_OT_add_style,
    VELLUS_OT_move_style,
    VELLUS_OT_remove_style,
    VELLUS_OT_duplicate_style,
    VELLUS_OT_use_points,
    VELLUS_OT_paint_style_mask,
    VELLUS_OT_paint_density,
    VELLUS_OT_mask_from_selection,
    VELLUS_OT_apply_style_preset,
    VELLUS_OT_apply_saved_style,
    VELLUS_OT_save_style_preset,
    VELLUS_OT_remove_style_preset,
)
