# SPDX-License-Identifier: GPL-3.0-or-later
"""The Hair tab of the N-panel: the pipeline in order. Layout, nothing else."""

import bpy

from ..core.groom import GuideSettings, HairSettings
from ..core.params import declared
from ..core.shading import appearance, lookup_tables
from ..core.shading.appearance import Appearance
from .selection import active_of_kind, guides_again, guides_of, surface_of


class _HairTab:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Hair"

    @staticmethod
    def split(layout):
        """The layout with names in a column of their own."""
        layout.use_property_split = True
        layout.use_property_decorate = False
        return layout

    @staticmethod
    def rows(layout, group, settings_class, skip=()):
        """A row for each setting of a class, in the order of declaration."""
        for name, _default, _details in declared(settings_class):
            if name not in skip:
                layout.prop(group, name)


class VELLUS_PT_guides(_HairTab, bpy.types.Panel):
    """Guides on the surface"""

    bl_label = "Guides"
    bl_idname = "VELLUS_PT_guides"

    def draw(self, context):
        layout = self.split(self.layout)
        surface = surface_of(context.object)
        layout.label(text=surface.name if surface else "Select a mesh to grow hair on", icon="MESH_DATA")
        guides = guides_of(context.object)
        if guides_again(context.object) is None:
            layout.operator("vellus.distribute_guides", icon="OUTLINER_OB_CURVES")
        if guides is None:
            return
        _draw_status(layout, guides.vellus.status)
        group = guides.vellus.guides
        if surface:
            layout.prop_search(group, "density_group", surface, "vertex_groups")
        self.rows(layout, group, GuideSettings, skip=("density_group",))
        layout.prop(guides.vellus, "is_live")
        if guides_again(context.object) is not None:
            layout.operator("vellus.distribute_guides", text="Distribute Again", icon="FILE_REFRESH")


class VELLUS_PT_interpolation(_HairTab, bpy.types.Panel):
    """Strands between the guides"""

    bl_label = "Interpolation"
    bl_idname = "VELLUS_PT_interpolation"

    def draw(self, context):
        layout = self.split(self.layout)
        hair = active_of_kind(context.object, "HAIR")
        if hair is None:
            if guides_of(context.object) is None:
                layout.label(text="Distribute guides first", icon="INFO")
            layout.operator("vellus.interpolate_hair", icon="CURVES")
            return
        _draw_status(layout, hair.vellus.status)
        layout.prop(hair.vellus, "guide_curves")
        group = hair.vellus.hair
        if hair.surface:
            layout.prop_search(group, "density_group", hair.surface, "vertex_groups")
        self.rows(layout, group, HairSettings, skip=("density_group", "influence_distance"))
        row = layout.row()
        row.active = not group.automatic_influence
        row.prop(group, "influence_distance")
        layout.prop(hair.vellus, "is_live")
        layout.operator("vellus.interpolate_hair", text="Interpolate Again", icon="FILE_REFRESH")


# The classic mode's alone, of the tables' settings.
_GLINTS = ("caustic", "glint_gain", "glint_width", "glint_fade", "glint_limit")


class _OfHair(_HairTab):
    @classmethod
    def poll(cls, context):
        return active_of_kind(context.object, "HAIR") is not None


class VELLUS_PT_shading(_OfHair, bpy.types.Panel):
    """How strands scatter light"""

    bl_label = "Shading"
    bl_idname = "VELLUS_PT_shading"

    def draw(self, context):
        layout = self.split(self.layout)
        state = context.object.data.vellus
        _draw_status(layout, state.shading_status)
        layout.operator_menu_enum("vellus.apply_preset", "preset", text="Presets")
        layout.prop(state, "is_drawn")
        layout.prop(state, "model")
        look = state.appearance
        # The viewport draws every strand as the average one at its root: what would change nothing is not offered.
        hidden = [*appearance.STRAND_FIELDS]
        hidden += [
            name for kind, names in appearance.COLOR_FIELDS.items() if kind != look.parametrization for name in names
        ]
        if state.model == "KAJIYA_KAY":
            hidden.append("mode")
        self.rows(layout, look, Appearance, skip=hidden)


class VELLUS_PT_tables(_OfHair, bpy.types.Panel):
    """The Marschner model's tables"""

    bl_label = "Tables"
    bl_idname = "VELLUS_PT_tables"

    def draw(self, context):
        layout = self.split(self.layout)
        state = context.object.data.vellus
        hidden = (*appearance.TABLE_FIELDS, *(_GLINTS if state.appearance.mode == "energy" else ()))
        self.rows(layout, state.marschner, lookup_tables.Settings, skip=hidden)
        layout.prop(state, "table_folder")
        layout.operator("vellus.bake_tables", icon="RENDER_STILL")


class VELLUS_PT_output(_HairTab, bpy.types.Panel):
    """Pictures of the hair"""

    bl_label = "Output"
    bl_idname = "VELLUS_PT_output"

    def draw(self, context):
        self.layout.operator("vellus.render_picture", icon="IMAGE_DATA")


def _draw_status(layout, status):
    if status:
        layout.label(text=status, icon="ERROR")


CLASSES = (
    VELLUS_PT_guides,
    VELLUS_PT_interpolation,
    VELLUS_PT_shading,
    VELLUS_PT_tables,
    VELLUS_PT_output,
)
