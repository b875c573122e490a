# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators of the layers of guides."""

import bpy

from ...data import scene
from ...groom.guides import layer_changes
from ...groom.selection import guides_of
from ...settings import layer_items, properties
from .base.hair_operator import HairOperator, needs_guides


class _LayerOperator(HairOperator):
    """Mixin of operators on the active layer."""

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Add a layer to the guides first.")
        guides = guides_of(context.object)
        return guides is not None and layer_items.active_of(guides.vellus) is not None


class VELLUS_OT_add_layer(HairOperator, bpy.types.Operator):
    """Add a layer above the active one. Combing is recorded in the active layer; the first layer takes all combing"""

    bl_idname = "vellus.add_layer"
    bl_label = "Add Layer"
    applies = needs_guides

    def change(self, context):
        layer_changes.add(guides_of(context.object), scene.present_depsgraph())


class VELLUS_OT_remove_layer(_LayerOperator, bpy.types.Operator):
    """Remove the active layer with its combing and its keyframes"""

    bl_idname = "vellus.remove_layer"
    bl_label = "Remove Layer"

    def change(self, context):
        layer_changes.remove(guides_of(context.object), scene.present_depsgraph())


class VELLUS_OT_duplicate_layer(_LayerOperator, bpy.types.Operator):
    """Add a copy of the active layer above it, without its keyframes"""

    bl_idname = "vellus.duplicate_layer"
    bl_label = "Duplicate Layer"

    def change(self, context):
        layer_changes.duplicate(guides_of(context.object), scene.present_depsgraph())


class VELLUS_OT_move_layer(_LayerOperator, bpy.types.Operator):
    """Move the active layer up or down; each layer deforms the result of the layers below it"""

    bl_idname = "vellus.move_layer"
    bl_label = "Move Layer"
    __annotations__ = {
        "direction": properties.choice("Direction", "Direction to move the layer in", {"UP": "Up", "DOWN": "Down"})
    }

    def change(self, context):
        step = 1 if self.direction == "UP" else -1
        layer_changes.move(guides_of(context.object), scene.present_depsgraph(), step)


class VELLUS_OT_merge_layer_down(_LayerOperator, bpy.types.Operator):
    """Merge the active layer into the one below it; guides keep their shape"""

    bl_idname = "vellus.merge_layer_down"
    bl_label = "Merge Layer Down"

    def change(self, context):
        layer_changes.merge_down(guides_of(context.object), scene.present_depsgraph())


class VELLUS_OT_apply_layers(_LayerOperator, bpy.types.Operator):
    """Remove all layers; guides keep their shape, as if combed without layers"""

    bl_idname = "vellus.apply_layers"
    bl_label = "Apply Layers"

    def change(self, context):
        return "{count} layers applied", {
            "count": layer_changes.apply(guides_of(context.object), scene.present_depsgraph())
        }


CLASSES = (
    VELLUS_OT_add_layer,
    VELLUS_OT_remove_layer,
    VELLUS_OT_duplicate_layer,
    VELLUS_OT_move_layer,
    VELLUS_OT_merge_layer_down,
    VELLUS_OT_apply_layers,
)
