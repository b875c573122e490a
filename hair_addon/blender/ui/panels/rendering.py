# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels of the Render and View Layer properties for the Vellus render engine."""

import bpy
from bl_ui import properties_view_layer

from ....core.imaging.pixel_sampling import PassSettings, RenderSettings
from ...data.pictures import unread_nodes
from ...render import data_passes, mattes
from ...render.frames.engine import NAME
from ...render.viewport import live_light
from ...settings.setting_properties import names_of
from ...settings.translations import CONTEXT, interface_text
from .. import setting_rows
from .tab import split, write, write_missing_pictures


class _OfEngine:
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    bl_translation_context = CONTEXT
    COMPAT_ENGINES = {NAME}

    @classmethod
    def poll(cls, context):
        return context.engine in cls.COMPAT_ENGINES


class VELLUS_PT_sampling(_OfEngine, bpy.types.Panel):
    """Number of samples per pixel"""

    bl_label = "Sampling"
    bl_idname = "VELLUS_PT_sampling"

    def draw(self, context):
        names = ("sample_count", "multiple_scattering")
        setting_rows.rows(self.layout, context.scene.vellus, RenderSettings, names)
        for sentence in map(interface_text, live_light.obstacles(context.scene)):
            write(self.layout, context, sentence, "INFO")
        write_missing_pictures(self.layout, context)
        for sentence, values in unread_nodes.shown_sentences(context.scene):
            write(self.layout, context, interface_text(sentence, **values), "INFO")


class VELLUS_PT_film(_OfEngine, bpy.types.Panel):
    """Pixel filter and background"""

    bl_label = "Film"
    bl_idname = "VELLUS_PT_film"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout, render = split(self.layout), context.scene.render
        layout.prop(render, "filter_size")
        layout.prop(render, "film_transparent", text="Transparent")
        layout.prop(context.scene.vellus, "is_hair_only")


class VELLUS_PT_motion_blur(_OfEngine, bpy.types.Panel):
    """Exposure of moving objects"""

    bl_label = "Motion Blur"
    bl_idname = "VELLUS_PT_motion_blur"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context):
        self.layout.prop(context.scene.render, "use_motion_blur", text="")

    def draw(self, context):
        layout, render = split(self.layout), context.scene.render
        layout.active = render.use_motion_blur
        layout.prop(render, "motion_blur_position", text="Position")
        layout.prop(render, "motion_blur_shutter")
        layout.prop(context.scene.vellus, "motion_steps")
        layout.template_curve_mapping(render, "motion_blur_shutter_curve")


class VELLUS_PT_passes(_OfEngine, bpy.types.Panel):
    """Render passes of the view layer"""

    bl_label = "Passes"
    bl_idname = "VELLUS_PT_passes"
    bl_context = "view_layer"

    def draw(self, context):
        layout, view_layer = split(self.layout), context.view_layer
        for name in ("use_pass_z", *data_passes.SETTINGS, "use_pass_vector", "use_pass_shadow"):
            layout.prop(view_layer, name)
        for name in mattes.INDICES:
            layout.prop(view_layer, name)
        for name in names_of(PassSettings):
            layout.prop(view_layer.vellus, name)
        layout.prop(view_layer, "samples")


class VELLUS_PT_cryptomatte(_OfEngine, bpy.types.Panel):
    """Mattes of the view layer"""

    bl_label = "Cryptomatte"
    bl_idname = "VELLUS_PT_cryptomatte"
    bl_parent_id = "VELLUS_PT_passes"
    bl_context = "view_layer"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        properties_view_layer.ViewLayerCryptomattePanelHelper.draw(self, context)


class VELLUS_PT_light_groups(_OfEngine, bpy.types.Panel):
    """Light groups of the view layer, with a pass for each"""

    bl_label = "Light Groups"
    bl_idname = "VELLUS_PT_light_groups"
    bl_parent_id = "VELLUS_PT_passes"
    bl_context = "view_layer"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        properties_view_layer.ViewLayerLightgroupsPanelHelper.draw(self, context)


def _draw_light_group(layout, owner, view_layer):
    split(layout).prop_search(
        owner, "lightgroup", view_layer, "lightgroups", text="Light Group", results_are_suggestions=True
    )


class VELLUS_PT_lamp_light_group(_OfEngine, bpy.types.Panel):
    """Light group of a light"""

    bl_label = "Light Group"
    bl_idname = "VELLUS_PT_lamp_light_group"
    bl_context = "object"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return super().poll(context) and context.object is not None and context.object.type == "LIGHT"

    def draw(self, context):
        _draw_light_group(self.layout, context.object, context.view_layer)


class VELLUS_PT_world_light_group(_OfEngine, bpy.types.Panel):
    """Light group of the world"""

    bl_label = "Light Group"
    bl_idname = "VELLUS_PT_world_light_group"
    bl_context = "world"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return super().poll(context) and context.world is not None

    def draw(self, context):
        _draw_light_group(self.layout, context.world, context.view_layer)


CLASSES = (
    *(VELLUS_PT_sampling, VELLUS_PT_film, VELLUS_PT_motion_blur),
    *(VELLUS_PT_passes, VELLUS_PT_cryptomatte, VELLUS_PT_light_groups),
    *(VELLUS_PT_lamp_light_group, VELLUS_PT_world_light_group),
)
