# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators of maps and ramps: a popover with the map of a setting, its painting and its removal; ramps."""

import bpy

from ....core.errors import HairError
from ....core.maps import varied_settings
from ...data.maps import ramps
from ...data.strands.curves import require_editable
from ...groom.selection import guides_of, hair_of
from ...groom.styles import painted_maps
from ...host.notices import name_of
from ...settings import map_items, properties, ramp_nodes
from .. import map_rows
from .base.hair_operator import HairOperator, needs_hair, needs_hair_or_guides


def setting_property():
    """Return the property with the setting of a map."""
    return properties.hidden_text()


class VELLUS_OT_edit_map(HairOperator, bpy.types.Operator):
    """Vary this setting over the hair by an image, a vertex group, an attribute or random numbers, or from root \
to tip by a curve"""

    bl_idname = "vellus.edit_map"
    bl_label = "Edit Map"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}
    applies = needs_hair_or_guides
    __annotations__ = {"setting": setting_property()}

    def invoke(self, context, _event):
        """Show the map of the setting in a popover."""
        if self.execute(context) == {"CANCELLED"}:
            return {"CANCELLED"}
        return context.window_manager.invoke_popup(self, width=280)

    def change(self, context):
        """Add a map without a source if the setting has no map. Existing maps need no change, also on linked hair."""
        owner = _owner_of(context, self.setting)
        if map_items.item_of(owner.vellus, self.setting) is None:
            require_editable(owner)
            map_items.add(owner.vellus, self.setting)

    def draw(self, context):
        """Draw the map."""
        owner = guides_of(context.object) if varied_settings.is_of_guides(self.setting) else hair_of(context.object)
        item = None if owner is None else map_items.item_of(owner.vellus, self.setting)
        if item is not None:
            map_rows.draw(self.layout, item, owner)


class VELLUS_OT_paint_map(HairOperator, bpy.types.Operator):
    """Paint the map on the surface with Blender's brushes, while the hair follows. If the map has no source, create \
one"""

    bl_idname = "vellus.paint_map"
    bl_label = "Paint Map"
    applies = needs_hair_or_guides
    __annotations__ = {"setting": setting_property()}

    def change(self, context):
        """Enter the paint mode of the map of the setting."""
        owner = _owner_of(context, self.setting)
        item = map_items.item_of(owner.vellus, self.setting)
        if item is None:
            raise HairError('The setting "{setting}" has no map to paint: add one first.', setting=self.setting)
        painted_maps.paint(owner, item, context)


class VELLUS_OT_add_ramp(HairOperator, bpy.types.Operator):
    """Set the thickness from root to tip by a curve, which begins as the current thickness"""

    bl_idname = "vellus.add_ramp"
    bl_label = "Thickness Curve"
    applies = needs_hair

    def change(self, context):
        """Add a ramp of the thickness if there is none."""
        hair = hair_of(context.object)
        require_editable(hair)
        state = hair.vellus
        if ramps.node_of(state.thickness_ramp) is None:
            state.thickness_ramp = ramps.new_ramp(f"{name_of(hair)} Thickness", state.hair.tip_taper)


class VELLUS_OT_remove_ramp(HairOperator, bpy.types.Operator):
    """Remove the curve of the thickness; the setting for the tip applies again"""

    bl_idname = "vellus.remove_ramp"
    bl_label = "Remove Thickness Curve"
    applies = needs_hair

    def change(self, context):
        """Remove the ramp of the thickness, and its node group if nothing else uses it."""
        hair = hair_of(context.object)
        require_editable(hair)
        tree, hair.vellus.thickness_ramp = hair.vellus.thickness_ramp, None
        ramp_nodes.remove_unused(tree)


class VELLUS_OT_add_map_ramp(HairOperator, bpy.types.Operator):
    """Change the values of the map by a curve, or turn them into colors by a color ramp"""

    bl_idname = "vellus.add_map_ramp"
    bl_label = "Add Ramp"
    applies = needs_hair_or_guides
    __annotations__ = {"setting": setting_property()}

    def change(self, context):
        """Add a ramp to the map of the setting: a line for numbers, from black to the setting's color for colors."""
        hair, item = _editable_map(context, self.setting)
        if ramp_nodes.node_of(item.ramp_tree) is None:
            map_items.set_ramp(item, _first_ramp(hair, item))


class VELLUS_OT_remove_map_ramp(HairOperator, bpy.types.Operator):
    """Remove the ramp: the values of the map are used directly"""

    bl_idname = "vellus.remove_map_ramp"
    bl_label = "Remove Ramp"
    applies = needs_hair_or_guides
    __annotations__ = {"setting": setting_property()}

    def change(self, context):
        """Remove the ramp of the map of the setting."""
        _hair, item = _editable_map(context, self.setting)
        map_items.set_ramp(item, "")


class VELLUS_OT_add_course(HairOperator, bpy.types.Operator):
    """Multiply the setting by a curve from root to tip. A new curve is 1 everywhere and changes nothing"""

    bl_idname = "vellus.add_course"
    bl_label = "Curve from Root to Tip"
    applies = needs_hair
    __annotations__ = {"setting": setting_property()}

    def change(self, context):
        """Add a curve from root to tip to a setting of a style."""
        varied_settings.require_course(self.setting)
        hair = hair_of(context.object)
        require_editable(hair)
        item = map_items.item_of(hair.vellus, self.setting) or map_items.add(hair.vellus, self.setting)
        if ramp_nodes.node_of(item.course_tree) is None:
            map_items.set_course(item, "0:1 1:1")


class VELLUS_OT_remove_course(HairOperator, bpy.types.Operator):
    """Remove the curve, so that the setting is the same from root to tip"""

    bl_idname = "vellus.remove_course"
    bl_label = "Remove Curve"
    applies = needs_hair
    __annotations__ = {"setting": setting_property()}

    def change(self, context):
        """Remove the curve of a setting from root to tip."""
        varied_settings.require_course(self.setting)
        _hair, item = _editable_map(context, self.setting)
        map_items.set_course(item, "")


def _editable_map(context, setting):
    """Return (Curves that have a setting, item of its map). Raises `HairError`."""
    owner = _owner_of(context, setting)
    require_editable(owner)
    item = map_items.item_of(owner.vellus, setting)
    if item is None:
        raise HairError('The setting "{setting}" has no map: add one first.', setting=setting)
    return owner, item


def _owner_of(context, setting):
    """Return the active hair or guides, whichever have a setting that may vary. Raises `HairError`."""
    varied_settings.require_varied_or_course(setting)
    owner = guides_of(context.object) if varied_settings.is_of_guides(setting) else hair_of(context.object)
    if owner is None:
        raise HairError("Select hair or guides.")
    return owner


def _first_ramp(hair, item):
    """Return the text of a new ramp."""
    if not varied_settings.is_color(item.setting):
        return "0:0 1:1"
    color = getattr(properties.own_look_of(hair.vellus), item.setting.rpartition(".")[2])
    return "0:0/0/0 1:" + "/".join(f"{min(max(part, 0.0), 1.0):g}" for part in color)


class VELLUS_OT_remove_map(HairOperator, bpy.types.Operator):
    """Remove the map: all strands have the value of the setting. Its curve from root to tip stays"""

    bl_idname = "vellus.remove_map"
    bl_label = "Remove Map"
    applies = needs_hair_or_guides
    __annotations__ = {"setting": setting_property()}

    def change(self, context):
        """Remove the map of the setting."""
        owner = _owner_of(context, self.setting)
        require_editable(owner)
        map_items.clear(owner.vellus, self.setting)


CLASSES = (
    VELLUS_OT_edit_map,
    VELLUS_OT_paint_map,
    VELLUS_OT_add_ramp,
    VELLUS_OT_remove_ramp,
    VELLUS_OT_add_map_ramp,
    VELLUS_OT_remove_map_ramp,
    VELLUS_OT_add_course,
    VELLUS_OT_remove_course,
    VELLUS_OT_remove_map,
)
