# SPDX-License-Identifier: GPL-3.0-or-later
"""Dynamics panel: the simulation of the guides."""

import bpy

from ...data.simulation import simulated_world
from ...data.strands import delivered_hair
from ...groom.dynamics import dynamics_notes, frame_folders
from ...groom.selection import guides_of, hair_of, object_of
from ...live import dynamics_state, simulated_hair, unlocked_renders
from ...settings import shared_wetness
from ...settings.translations import error_text, interface_text
from .. import setting_rows
from .tab import HairTab, split, write, write_status


class _OfGuides(HairTab):
    @classmethod
    def poll(cls, context):
        return guides_of(context.object) is not None


class VELLUS_PT_dynamics(_OfGuides, bpy.types.Panel):
    """Simulation of the guides while the animation plays"""

    bl_label = "Dynamics"
    bl_idname = "VELLUS_PT_dynamics"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context):
        self.layout.prop(guides_of(context.object).vellus, "simulates", text="")

    def draw_header_preset(self, _context):
        layout = self.layout
        layout.emboss = "NONE"
        layout.operator_menu_enum("vellus.apply_dynamics_preset", "preset", text="", icon="PRESET")

    def draw(self, context):
        layout = split(self.layout)
        guides = guides_of(context.object)
        layout.active = guides.vellus.simulates
        column = layout.column(align=True)
        column.operator("vellus.play_dynamics", icon="PLAY")
        sides = column.row(align=True)
        sides.operator("vellus.bake_dynamics", text="Bake", icon="REC").starts_over = False
        if frame_folders.has_frames(guides):
            sides.operator("vellus.bake_dynamics", text="", icon="FILE_REFRESH").starts_over = True
        sides.operator("vellus.free_dynamics", text="", icon="TRASH")
        layout.prop(guides.vellus, "cache_folder")
        _draw_delivery(layout, context)
        if guides.vellus.simulates:
            sentence, values = dynamics_state.state_of(guides)
            write(layout, context, interface_text(sentence, **values))
            for error in simulated_hair.notes_of(guides):
                write(layout, context, error_text(error), "ERROR")
        write_status(layout, context, guides.vellus, "dynamics_status")
        if frame_folders.has_frames(guides) and not context.scene.render.use_lock_interface:
            write(layout, context, interface_text(unlocked_renders.SENTENCE), "INFO")
            layout.prop(context.scene.render, "use_lock_interface")
        note = dynamics_notes.size_note(guides, context.scene)
        if note:
            write(layout, context, note, "INFO")


def _draw_delivery(layout, context):
    """Draw the buttons of delivery, and the state of the delivered hair."""
    hair = hair_of(context.object)
    if hair is None:
        return
    layout.operator("vellus.deliver_dynamics", icon="EXPORT")
    hair_object = object_of(hair, context.view_layer)
    if hair_object is None or delivered_hair.modifier_of(hair_object) is None:
        return
    layout.operator("vellus.remove_delivery", icon="X")
    is_outdated = dynamics_notes.is_delivery_outdated(hair)
    message = "Delivered hair is outdated: deliver again" if is_outdated else "Renders play delivered hair"
    write(layout, context, interface_text(message), "ERROR" if is_outdated else "INFO")


def _settings_column(layout, context):
    """Return (column for rows of settings, their owner)."""
    state = guides_of(context.object).vellus
    column = split(layout).column()
    column.active = state.simulates
    return column, state.dynamics


class _OfDynamics(_OfGuides):
    bl_parent_id = "VELLUS_PT_dynamics"
    bl_options = {"DEFAULT_CLOSED"}


class VELLUS_PT_dynamics_material(_OfDynamics, bpy.types.Panel):
    """Stiffness, damping and weight of the hair"""

    bl_label = "Material"
    bl_idname = "VELLUS_PT_dynamics_material"
    bl_options = set()

    def draw(self, context):
        column, settings = _settings_column(self.layout, context)
        guides = guides_of(context.object)
        setting_rows.material_rows(column, settings, shared_wetness.slider_of(guides.vellus))
        note = dynamics_notes.bend_note(guides, context.scene)
        if note:
            write(column, context, note, "INFO")
        weakness = dynamics_notes.stiffness_note(guides)
        if weakness:
            write(column, context, weakness, "ERROR")
            column.operator("vellus.stiffen_dynamics")


class VELLUS_PT_dynamics_fiber(_OfDynamics, bpy.types.Panel):
    """Material and thickness of a single fiber"""

    bl_label = "Advanced"
    bl_idname = "VELLUS_PT_dynamics_fiber"
    bl_parent_id = "VELLUS_PT_dynamics_material"

    def draw(self, context):
        setting_rows.fibre_rows(*_settings_column(self.layout, context))


class VELLUS_PT_dynamics_forces(_OfDynamics, bpy.types.Panel):
    """Forces that move the guides"""

    bl_label = "Forces"
    bl_idname = "VELLUS_PT_dynamics_forces"

    def draw(self, context):
        setting_rows.force_rows(*_settings_column(self.layout, context))


class VELLUS_PT_dynamics_shape(_OfDynamics, bpy.types.Panel):
    """How closely the guides keep their combed shape"""

    bl_label = "Shape"
    bl_idname = "VELLUS_PT_dynamics_shape"

    def draw(self, context):
        setting_rows.hold_rows(*_settings_column(self.layout, context))


class VELLUS_PT_dynamics_collision(_OfDynamics, bpy.types.Panel):
    """Meshes that the guides collide with"""

    bl_label = "Collision"
    bl_idname = "VELLUS_PT_dynamics_collision"

    def draw(self, context):
        column, settings = _settings_column(self.layout, context)
        setting_rows.collision_rows(column, settings)
        problem = simulated_world.collider_problem(settings)
        if problem is not None:
            write(column, context, error_text(problem), "ERROR")


class VELLUS_PT_dynamics_hair(_OfDynamics, bpy.types.Panel):
    """Forces between strands"""

    bl_label = "Between Hairs"
    bl_idname = "VELLUS_PT_dynamics_hair"

    def draw(self, context):
        setting_rows.volume_rows(*_settings_column(self.layout, context))


class VELLUS_PT_dynamics_solver(_OfDynamics, bpy.types.Panel):
    """Accuracy, time and units of the simulation"""

    bl_label = "Solver"
    bl_idname = "VELLUS_PT_dynamics_solver"

    def draw(self, context):
        setting_rows.solver_rows(*_settings_column(self.layout, context))


CLASSES = (
    VELLUS_PT_dynamics,
    VELLUS_PT_dynamics_material,
    VELLUS_PT_dynamics_fiber,
    VELLUS_PT_dynamics_forces,
    VELLUS_PT_dynamics_shape,
    VELLUS_PT_dynamics_collision,
    VELLUS_PT_dynamics_hair,
    VELLUS_PT_dynamics_solver,
)
