# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators of hair systems: grow, comb, draw, select, delete."""

import bpy

from ....core.errors import HairError, cause_of
from ....core.grooming import cost
from ....core.grooming.groom import GuideSettings, HairSettings
from ...data import scene
from ...data.strands.curves import followers, require_editable
from ...groom import pipeline
from ...groom.guides import brushes, line_drawing
from ...groom.selection import (
    active_of_kind,
    guides_of,
    guides_to_regenerate,
    hair_of,
    make_active,
    object_of,
    parts_of,
    reveal,
    surface_of,
)
from ...groom.surfaces import kept_densities
from ...groom.systems import copied_hair, edits, mask_suggestions
from ...groom.systems.hair_systems import edited_system, name_guides, parts_of_system
from ...live.live_hair import update_once
from ...render.viewport import viewport
from ...settings import fitted_sizes, setting_properties
from ...settings.translations import CONTEXT
from .. import setting_rows
from .base.hair_operator import HairOperator, needs_guides, needs_hair
from .base.modal import LongOperator

_OWN = tuple(
    name for name in setting_properties.names_of(HairSettings) if name in setting_properties.names_of(GuideSettings)
)


class VELLUS_OT_add_hair(LongOperator, bpy.types.Operator):
    """Create a hair system on the active mesh: guides to comb and strands that follow them"""

    bl_idname = "vellus.add_hair"
    bl_label = "New Hair System"
    __annotations__ = setting_properties.annotations(GuideSettings) | setting_properties.annotations(
        HairSettings, skip=_OWN
    )

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select a mesh to grow hair on.")
        return surface_of(context.object) is not None

    def draw(self, context):
        surface = surface_of(context.object)
        setting_rows.all_guide_rows(self.layout, self.properties, surface)
        setting_rows.add_title(self.layout, "Strands")
        setting_rows.all_strand_rows(self.layout, self.properties, surface, skip=_OWN)

    def prefill(self, context):
        if not self.properties.is_property_set("density_group"):
            self.density_group = mask_suggestions.filled(surface_of(context.object))

    def seconds(self, context):
        guide_settings, hair_settings = self._settings()
        face_count = scene.triangle_count(surface_of(context.object), context.view_layer)
        return cost.guide_seconds(guide_settings, face_count) + cost.hair_seconds(hair_settings, face_count)

    def work(self, context):
        may_drape = fitted_sizes.is_open(self, "drape")
        surface, depsgraph = surface_of(context.object), context.evaluated_depsgraph_get()
        return pipeline.adding_hair(surface, *self._settings(), depsgraph, may_drape=may_drape)

    def message(self, made):
        guides, hair = made
        return "{guide_count} guides, {strand_count} strands", {
            "guide_count": len(guides.curves),
            "strand_count": len(hair.curves),
        }

    def after(self, context, made):
        guides, hair = made
        setting_properties.show(self, guides.vellus.guides, GuideSettings)
        setting_properties.show(self, hair.vellus.hair, HairSettings)
        mask_suggestions.forget_choice(guides.surface)
        context.view_layer.update()  # to evaluate the new objects
        hair_object = object_of(hair, context.view_layer)
        name_guides(hair_object)
        make_active(hair_object, context.view_layer)

    def _settings(self):
        """Return settings with one seed for both; strands use the mask of their guides."""
        hair_settings = setting_properties.given_settings(self, HairSettings, skip=("density_group", "density_image"))
        return setting_properties.given_settings(self, GuideSettings), hair_settings


class VELLUS_OT_distribute_guides(LongOperator, bpy.types.Operator):
    """Distribute guides evenly on the active mesh, or regenerate the active guides"""

    bl_idname = "vellus.distribute_guides"
    bl_label = "Generate Guides"
    __annotations__ = setting_properties.annotations(GuideSettings)

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select a mesh to grow guides on, or guides to regenerate.")
        return surface_of(context.object) is not None

    def draw(self, context):
        setting_rows.all_guide_rows(self.layout, self.properties, surface_of(context.object))

    def prefill(self, context):
        guides = guides_to_regenerate(context.object)
        if guides is not None:
            setting_properties.prefill(self, guides.vellus.guides, GuideSettings)

    def seconds(self, context):
        face_count = scene.triangle_count(surface_of(context.object), context.view_layer)
        return cost.guide_seconds(setting_properties.given_settings(self, GuideSettings), face_count)

    def work(self, context):
        settings = setting_properties.given_settings(self, GuideSettings)
        depsgraph = context.evaluated_depsgraph_get()
        surface, target = surface_of(context.object), guides_to_regenerate(context.object)
        if target is not None:
            require_editable(target)
        may_drape = fitted_sizes.is_open(self, "drape")
        return pipeline.distributing_guides(surface, settings, depsgraph, target, may_drape=may_drape)

    def after(self, context, made):
        setting_properties.show(self, made.vellus.guides, GuideSettings)

    def message(self, made):
        return "{count} guides", {"count": len(made.curves)}


class VELLUS_OT_interpolate_hair(LongOperator, bpy.types.Operator):
    """Generate strands from the guides of the active object, or regenerate the active hair"""

    bl_idname = "vellus.interpolate_hair"
    bl_label = "Generate Strands"
    __annotations__ = setting_properties.annotations(HairSettings)

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select guides, the mesh they grow on, or hair to regenerate.")
        return guides_of(context.object) is not None

    def draw(self, context):
        setting_rows.all_strand_rows(self.layout, self.properties, surface_of(context.object))

    def prefill(self, context):
        hair = active_of_kind(context.object, "HAIR")
        if hair is not None:
            setting_properties.prefill(self, hair.vellus.hair, HairSettings)

    def seconds(self, context):
        surface = guides_of(context.object).surface
        face_count = 0 if surface is None else scene.triangle_count(surface, context.view_layer)
        return cost.hair_seconds(setting_properties.given_settings(self, HairSettings), face_count)

    def work(self, context):
        settings = setting_properties.given_settings(self, HairSettings)
        depsgraph = context.evaluated_depsgraph_get()
        hair = active_of_kind(context.object, "HAIR")
        if hair is not None:
            require_editable(hair)
        return pipeline.interpolating_hair(guides_of(context.object), settings, depsgraph, hair)

    def after(self, context, made):
        setting_properties.show(self, made.vellus.hair, HairSettings)

    def message(self, made):
        return "{count} strands", {"count": len(made.curves)}


class VELLUS_OT_keep_strand_density(HairOperator, bpy.types.Operator):
    """Keep the present number of strands per area when the surface changes, or stop keeping it"""

    bl_idname = "vellus.keep_strand_density"
    bl_label = "Keep Strand Density"
    applies = needs_hair

    def change(self, context):
        kept_densities.toggle(hair_of(context.object), context.evaluated_depsgraph_get())


class VELLUS_OT_keep_guide_density(HairOperator, bpy.types.Operator):
    """Keep the present number of guides per area when the surface changes, or stop keeping it"""

    bl_idname = "vellus.keep_guide_density"
    bl_label = "Keep Guide Density"
    applies = needs_guides

    def change(self, context):
        kept_densities.toggle(guides_of(context.object), context.evaluated_depsgraph_get())


def is_combing(context):
    """Whether guides are in Sculpt Mode."""
    return context.mode == "SCULPT_CURVES" and active_of_kind(context.object, "GUIDES") is not None


def _stop(context):
    """Switch to Object Mode and make the hair of the guides active, if there is any."""
    guides = context.object.data
    bpy.ops.object.mode_set(mode="OBJECT")
    shown = (object_of(hair, context.view_layer) for hair in followers(guides))
    hair_object = next((o for o in shown if o is not None and o.visible_get()), None)
    if hair_object is not None:
        make_active(hair_object, context.view_layer)


class VELLUS_OT_comb_guides(HairOperator, bpy.types.Operator):
    """Select the guides of the active mesh or hair and sculpt them with Blender's brushes; or stop combing"""

    bl_idname = "vellus.comb_guides"
    bl_label = "Comb Guides"

    @classmethod
    def applies(cls, context):
        if is_combing(context):
            return True
        cls.poll_message_set("Select a mesh with guides, or hair that follows guides, in Object Mode.")
        return context.mode == "OBJECT" and guides_of(context.object) is not None

    def change(self, context):
        if is_combing(context):
            _stop(context)
            return
        curves, view_layer = guides_of(context.object), context.view_layer
        require_editable(curves)
        guides = object_of(curves, view_layer)
        if guides is None and any(o.data == curves for o in bpy.data.objects):
            sentence = '"{name}" is not in this view layer: include one of its collections.'
            raise HairError(sentence, name=curves.name)
        if guides is None:
            raise HairError("The guides have no object in this view layer: restore the guides.")
        viewport = context.space_data if context.area is not None and context.area.type == "VIEW_3D" else None
        reveal(guides, view_layer, viewport)
        make_active(guides, view_layer)
        try:
            bpy.ops.object.mode_set(mode="SCULPT_CURVES")
        except RuntimeError as error:  # hidden by a library or driver
            sentence = '"{name}" cannot be combed: {cause}.'
            raise HairError(sentence, name=guides.name, cause=cause_of(error)) from error
        brushes.collide(guides.data)
        brushes.fit(guides.data, context.tool_settings.curves_sculpt)


class _DrawLines(HairOperator):
    """Mixin of operators that start or stop drawing lines of the active object."""

    asked = ""  # message if no hair or guides are active

    @staticmethod
    def target_of(active):
        """Return the Curves of the active object that lines are drawn for, None if there are none."""
        raise NotImplementedError

    @staticmethod
    def begin(target, context):
        """Start drawing lines of Curves. Raises `HairError`."""
        raise NotImplementedError

    @classmethod
    def applies(cls, context):
        if line_drawing.drawn_for(context.object) is not None:
            return True
        cls.poll_message_set(cls.asked)
        return cls.target_of(context.object) is not None

    def change(self, context):
        if line_drawing.drawn_for(context.object) is not None:
            line_drawing.stop(context)
        else:
            self.begin(self.target_of(context.object), context)


class VELLUS_OT_draw_parting(_DrawLines, bpy.types.Operator):
    """Draw lines on the surface that part the hair, with Blender's Draw tool; or stop drawing"""

    bl_idname = "vellus.draw_parting"
    bl_label = "Draw Parting"

    asked = "Select hair to part."
    target_of = staticmethod(hair_of)
    begin = staticmethod(line_drawing.draw_parting)


class VELLUS_OT_draw_flow(_DrawLines, bpy.types.Operator):
    """Draw lines on the surface that set the direction of guides, with Blender's Draw tool; or stop drawing"""

    bl_idname = "vellus.draw_flow"
    bl_label = "Draw Flow"

    asked = "Select guides to draw flow lines for."
    target_of = staticmethod(guides_of)
    begin = staticmethod(line_drawing.draw_flow)


class VELLUS_OT_draw_tie(_DrawLines, bpy.types.Operator):
    """Draw curves that Gather leads guides along, starting at the tie, with Blender's Draw tool; or stop drawing"""

    bl_idname = "vellus.draw_tie"
    bl_label = "Draw Tie"

    asked = "Select guides to draw a tie for."
    target_of = staticmethod(guides_of)
    begin = staticmethod(line_drawing.draw_tie)


class VELLUS_OT_select_guides(HairOperator, bpy.types.Operator):
    """Select the guides of the active mesh or hair"""

    bl_idname = "vellus.select_guides"
    bl_label = "Select Guides"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select a mesh with guides, or hair that follows guides, in Object Mode.")
        return context.mode == "OBJECT" and guides_of(context.object) is not None

    def change(self, context):
        guides = object_of(guides_of(context.object), context.view_layer)
        if guides is None:
            raise HairError("The guides have no object in this view layer: restore the guides.")
        make_active(guides, context.view_layer)


class VELLUS_OT_select_hair(HairOperator, bpy.types.Operator):
    """Select the hair on the active mesh, or the hair that follows the active guides"""

    bl_idname = "vellus.select_hair"
    bl_label = "Select Hair"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select a mesh with hair, or guides that hair follows, in Object Mode.")
        return context.mode == "OBJECT" and hair_of(context.object) is not None

    def change(self, context):
        hair = object_of(hair_of(context.object), context.view_layer)
        if hair is None:
            raise HairError("The hair has no object in this view layer.")
        make_active(hair, context.view_layer)


class VELLUS_OT_pick_hair(bpy.types.Operator):
    """Select the hair under the mouse pointer; hold Shift to extend the selection"""

    bl_idname = "vellus.pick_hair"
    bl_label = "Pick Hair"
    bl_options = {"UNDO", "INTERNAL"}
    bl_translation_context = CONTEXT

    @classmethod
    def poll(cls, context):
        return context.mode == "OBJECT" and context.region_data is not None

    def invoke(self, context, event):
        """Pass the click through to Blender if there is no hair."""
        picked = viewport.hair_at(context, event.mouse_region_x, event.mouse_region_y)
        if picked is None:
            return {"CANCELLED", "PASS_THROUGH"}
        is_off = event.shift and picked.select_get() and context.view_layer.objects.active == picked
        for other in () if event.shift else context.selected_objects:
            other.select_set(False)
        picked.select_set(not is_off)
        context.view_layer.objects.active = picked
        return {"FINISHED"}


class VELLUS_OT_delete_hair(HairOperator, bpy.types.Operator):
    """Delete the active hair with its guides, or all hair on the active mesh"""

    bl_idname = "vellus.delete_hair"
    bl_label = "Delete Hair"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select hair, guides, or a mesh with hair, in Object Mode.")
        return context.mode == "OBJECT" and bool(parts_of(context.object))

    def change(self, context):
        surface, parts = surface_of(context.object), parts_of(context.object)
        edits.delete(parts)
        make_active(surface, context.view_layer)
        return "{count} objects deleted", {"count": len(parts)}


class VELLUS_OT_delete_system(HairOperator, bpy.types.Operator):
    """Delete the edited hair system: its hair, and its guides unless other hair follows them"""

    bl_idname = "vellus.delete_system"
    bl_label = "Delete Hair System"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select a hair system in Object Mode.")
        return context.mode == "OBJECT" and edited_system(context.view_layer) is not None

    def change(self, context):
        surface = surface_of(context.object)
        edits.delete(parts_of_system(edited_system(context.view_layer)))
        make_active(surface, context.view_layer)


class VELLUS_OT_restore_guides(HairOperator, bpy.types.Operator):
    """Restore the deleted object of the active hair's guides"""

    bl_idname = "vellus.restore_guides"
    bl_label = "Restore Guides"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select hair whose guides were deleted.")
        guides = guides_of(context.object)
        return guides is not None and object_of(guides, context.view_layer) is None

    def change(self, context):
        edits.restore_object(guides_of(context.object))


class VELLUS_OT_make_own_guides(HairOperator, bpy.types.Operator):
    """Give the active hair a copy of its guides on its surface, so that combing them changes no other hair"""

    bl_idname = "vellus.make_own_guides"
    bl_label = "Make Own Guides"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select hair that shares its guides, in Object Mode.")
        return context.mode == "OBJECT" and bool(_sharing(context))

    def change(self, context):
        made = copied_hair.make_own_guides(_sharing(context), context.evaluated_depsgraph_get())
        return "{count} guides", {"count": sum(len(guides.curves) for guides in made)}


def _sharing(context):
    """Return the active hair if it shares its guides, or the hair whose guides grow on another surface."""
    hair = active_of_kind(context.object, "HAIR")
    if hair is not None:
        return [hair] if copied_hair.sharing(hair) or copied_hair.are_elsewhere(hair) else []
    return [part for part in parts_of(context.object) if part.vellus.kind == "HAIR" and copied_hair.are_elsewhere(part)]


class VELLUS_OT_update_hair(HairOperator, bpy.types.Operator):
    """Update the active hair and its guides, which are not updated automatically"""

    bl_idname = "vellus.update_hair"
    bl_label = "Update Now"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select hair or guides whose Auto Update is off, in Object Mode.")
        return context.mode == "OBJECT" and not all(part.vellus.is_live for part in parts_of(context.object))

    def change(self, context):
        update_once(parts_of(context.object), context.view_layer)


CLASSES = (
    VELLUS_OT_add_hair,
    VELLUS_OT_distribute_guides,
    VELLUS_OT_interpolate_hair,
    VELLUS_OT_keep_strand_density,
    VELLUS_OT_keep_guide_density,
    VELLUS_OT_comb_guides,
    VELLUS_OT_draw_parting,
    VELLUS_OT_draw_flow,
    VELLUS_OT_draw_tie,
    VELLUS_OT_select_guides,
    VELLUS_OT_select_hair,
    VELLUS_OT_pick_hair,
    VELLUS_OT_delete_hair,
    VELLUS_OT_delete_system,
    VELLUS_OT_restore_guides,
    VELLUS_OT_make_own_guides,
    VELLUS_OT_update_hair,
)
