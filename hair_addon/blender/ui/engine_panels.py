# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's panels that support our render engine: output, color management, lights, materials."""

import bpy

from ..render.frames.engine import NAME

# Blender's panels list their engines. Ours is added to panels for all engines, except those of unsupported features,
# and to a few of EEVEE's that have no general version.
_GENERAL = "BLENDER_RENDER"
_NOT_OURS = (
    *("RENDER_PT_freestyle", "VIEWLAYER_PT_freestyle", "MATERIAL_PT_freestyle", "RENDER_PT_stereoscopy"),
    *("RENDER_PT_gpencil", "RENDER_PT_grease_pencil", "RENDER_PT_simplify_greasepencil"),
    *("PARTICLE_PT", "DATA_PT_lightprobe", "DATA_PT_volume", "EEVEE_MATERIAL_PT_viewport_settings"),
    "DATA_PT_light",  # lacks the power of lights
)
_OURS = ("DATA_PT_EEVEE_light", "EEVEE_WORLD_PT_surface", "EEVEE_MATERIAL_PT_context_material")
_OURS += ("EEVEE_MATERIAL_PT_surface", "DATA_PT_light_animation")


def _panels():
    pending = [bpy.types.Panel]
    while pending:
        for panel in pending.pop().__subclasses__():
            pending.append(panel)
            # A panel of the shader editor shares its list with the panel that it was created from.
            engines, name = getattr(panel, "COMPAT_ENGINES", ()), panel.__name__.removeprefix("NODE_")
            if name in _OURS or (_GENERAL in engines and not name.startswith(_NOT_OURS)):
                yield panel


def register():
    """Show Blender's panels for the Vellus render engine."""
    for panel in _panels():
        panel.COMPAT_ENGINES.add(NAME)


def unregister():
    """Hide them again."""
    for panel in _panels():
        panel.COMPAT_ENGINES.discard(NAME)
