# SPDX-License-Identifier: GPL-3.0-or-later
"""Menu entries: Add ▸ Curve, File ▸ Import and Export, the menus of objects and curves, also on a right-click.

Also a line in Blender's Cavity panel.
"""

import bpy

from ..groom.foreign import particle_hair
from ..groom.foreign.foreign_curves import is_foreign
from ..groom.selection import guides_of, hair_of, parts_of, surface_of
from ..live import refused_hair, unlocked_renders
from ..settings.translations import CONTEXT, interface_text
from . import tools

# In groups: length and shape, then number and place.
_GUIDE_TOOLS = (
    (
        ("guide_length", "DRIVER_DISTANCE"),
        ("trim_guides", "MOD_BOOLEAN"),
        ("smooth_guides", "MOD_SMOOTH"),
        ("lift_guides", "SORT_DESC"),
        ("attract_guides", "SNAP_ON"),
        ("drape_guides", "FORCE_FORCE"),
        ("push_outside", "MOD_SHRINKWRAP"),
        ("draw_tie", "GREASEPENCIL"),
        ("gather_guides", "FORCE_CURVE"),
    ),
    (
        ("change_guide_count", "PARTICLES"),
        ("mirror_guides", "MOD_MIRROR"),
        ("copy_guide_shape", "COPYDOWN"),
    ),
)

_MOST_REFUSALS = 5  # entries listed in a menu


def draw_guide_tools(layout):
    """Draw a button or menu entry for each tool that changes combed guides."""
    layout.operator_context = "INVOKE_DEFAULT"
    for place, group in enumerate(_GUIDE_TOOLS):
        if place:
            layout.separator()
        for name, icon in group:
            layout.operator(f"vellus.{name}", icon=icon)


class VELLUS_MT_guide_tools(bpy.types.Menu):
    """Tools that change guides and keep their combing"""

    bl_label = "Guide Tools"
    bl_idname = "VELLUS_MT_guide_tools"
    bl_translation_context = CONTEXT

    def draw(self, context):
        draw_guide_tools(self.layout)
        tools.draw_paint_flow(self.layout, context)


class VELLUS_MT_unlocked_render(bpy.types.Menu):
    """Hair that a render from a window could not show, and the setting that enables it"""

    bl_label = "Hair in This Render"
    bl_idname = "VELLUS_MT_unlocked_render"
    bl_translation_context = CONTEXT

    def draw(self, context):
        self.layout.label(text=interface_text(unlocked_renders.SENTENCE), icon="ERROR", translate=False)
        self.layout.prop(context.scene.render, "use_lock_interface")


class VELLUS_MT_refused_hair(bpy.types.Menu):
    """Hair that is missing or not simulated in a render, with the reasons"""

    bl_label = "Hair Is Missing or Not Simulated in This Render"
    bl_idname = "VELLUS_MT_refused_hair"
    bl_translation_context = CONTEXT

    def draw(self, context):
        sentences = refused_hair.sentences_of(context.scene)
        for sentence in sentences[:_MOST_REFUSALS]:
            self.layout.label(text=sentence, icon="ERROR", translate=False)
        if len(sentences) > _MOST_REFUSALS:
            more = interface_text("{count} more", count=len(sentences) - _MOST_REFUSALS)
            self.layout.label(text=more, icon="BLANK1", translate=False)


class VELLUS_MT_hair(bpy.types.Menu):
    """Operations on hair"""

    bl_label = "Hair"
    bl_idname = "VELLUS_MT_hair"
    bl_translation_context = CONTEXT

    def draw(self, context):
        layout = self.layout
        layout.operator_context = "INVOKE_DEFAULT"
        if context.object.type == "MESH":
            layout.operator("vellus.add_hair", icon="OUTLINER_OB_CURVES")
            if particle_hair.systems_of(context.object):
                layout.operator("vellus.convert_particles", icon="PARTICLES")
            layout.operator("vellus.mesh_to_hair", icon="MESH_PLANE")
        layout.operator("vellus.distribute_guides")
        if guides_of(context.object) is not None:
            layout.operator("vellus.interpolate_hair")
            layout.separator()
            layout.operator("vellus.comb_guides")
            layout.operator("vellus.select_guides")
            layout.menu("VELLUS_MT_guide_tools")
        if hair_of(context.object) is not None:
            layout.operator("vellus.select_hair")
            layout.operator("vellus.toggle_drawing")
            layout.separator()
            layout.operator_menu_enum("vellus.apply_preset", "preset")
            layout.operator_menu_enum("vellus.add_style", "style")
            layout.operator_menu_enum("vellus.apply_style_preset", "preset")
        if parts_of(context.object):
            layout.separator()
            layout.operator("vellus.attach_to_surface")
            if guides_of(context.object) is not None:
                layout.operator("vellus.transfer_groom")
            layout.operator("vellus.delete_hair", icon="TRASH")


class VELLUS_MT_hair_pie(bpy.types.Menu):
    """Operations on hair that are needed while grooming"""

    bl_label = "Hair"
    bl_idname = "VELLUS_MT_hair_pie"
    bl_translation_context = CONTEXT

    @classmethod
    def poll(cls, context):
        return surface_of(getattr(context, "object", None)) is not None

    def draw(self, context):
        pie = self.layout.menu_pie()
        if guides_of(context.object) is None:
            pie.operator("vellus.add_hair", icon="OUTLINER_OB_CURVES")
            return
        is_combing = context.mode == "SCULPT_CURVES"
        # On the left; the order is that of Blender's pie menus.
        pie.operator("vellus.comb_guides", text="Stop Combing" if is_combing else "Comb Guides", icon="SCULPTMODE_HLT")
        pie.menu("VELLUS_MT_guide_tools", icon="OUTLINER_OB_CURVES")
        pie.operator("vellus.freeze_selected", icon="FREEZE")
        pie.operator("vellus.select_hair", icon="RESTRICT_SELECT_OFF")
        pie.operator("vellus.select_guides", icon="RESTRICT_SELECT_OFF")
        pie.operator_menu_enum("vellus.add_style", "style", icon="ADD")
        pie.operator("vellus.unfreeze_all")
        pie.operator("vellus.toggle_drawing", icon="SHADING_RENDERED")


def _in_add_menu(menu, _context):
    menu.layout.separator()
    menu.layout.operator("vellus.add_hair", text="Hair System", icon="OUTLINER_OB_CURVES")


def _in_object_menu(menu, context):
    active = context.object
    if is_foreign(active):
        menu.layout.separator()
        menu.layout.operator("vellus.use_as_guides", icon="OUTLINER_OB_CURVES")
        menu.layout.operator("vellus.use_as_hair", icon="CURVES")
    elif active is not None and (active.type == "MESH" or parts_of(active)):
        menu.layout.separator()
        menu.layout.menu("VELLUS_MT_hair", icon="OUTLINER_OB_CURVES")


def _in_curves_menu(menu, context):
    if guides_of(context.object) is not None:
        menu.layout.separator()
        menu.layout.menu("VELLUS_MT_guide_tools", icon="OUTLINER_OB_CURVES")


def _in_export_menu(menu, context):
    if hair_of(context.object) is not None:
        menu.layout.operator("vellus.export_groom", text="Hair (.abc/.usd*/.hair/.data/.ply/.npz)")


def _in_cavity_panel(panel, _context):
    if any(datablock.vellus.kind == "HAIR" and datablock.vellus.is_drawn for datablock in bpy.data.hair_curves):
        panel.layout.label(text=interface_text("Cavity changes meshes, not hair"), icon="INFO")


def _in_import_menu(menu, context):
    if surface_of(context.object) is not None:
        menu.layout.operator(
            "vellus.import_groom", text="Hair on This Mesh (.abc/.usd*/.npz/.hair/.data/.bin/.ply/.obj/.tfx)"
        )


_ENTRIES = (
    ("TOPBAR_MT_file_import", _in_import_menu),
    ("TOPBAR_MT_file_export", _in_export_menu),
    ("VIEW3D_MT_curve_add", _in_add_menu),
    ("VIEW3D_MT_object", _in_object_menu),
    ("VIEW3D_MT_object_context_menu", _in_object_menu),
    ("VIEW3D_MT_sculpt_curves", _in_curves_menu),
    ("VIEW3D_MT_edit_curves", _in_curves_menu),
    ("VIEW3D_MT_edit_curves_context_menu", _in_curves_menu),
    ("VIEW3D_PT_shading_cavity", _in_cavity_panel),
)

CLASSES = (VELLUS_MT_guide_tools, VELLUS_MT_hair, VELLUS_MT_hair_pie, VELLUS_MT_unlocked_render, VELLUS_MT_refused_hair)


def register():
    """Extend Blender's menus and its Cavity panel."""
    for menu, entry in _ENTRIES:
        getattr(bpy.types, menu).append(entry)


def unregister():
    """Remove the menu entries."""
    for menu, entry in _ENTRIES:
        getattr(bpy.types, menu).remove(entry)
