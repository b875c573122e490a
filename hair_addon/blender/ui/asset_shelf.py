# SPDX-License-Identifier: GPL-3.0-or-later
"""The asset shelf of the 3D Viewport: grooms of asset libraries, applied to the active mesh with a click."""

import bpy

from ..groom.selection import surface_of
from ..settings.translations import CONTEXT


class VELLUS_AST_grooms(bpy.types.AssetShelf):
    """Grooms to apply to the active mesh"""

    bl_idname = "VELLUS_AST_grooms"
    bl_space_type = "VIEW_3D"
    bl_options = {"STORE_ENABLED_CATALOGS_IN_PREFERENCES"}
    bl_activate_operator = bl_drag_operator = "vellus.apply_groom"
    bl_default_preview_size = 96

    @classmethod
    def poll(cls, context):
        # Blender also polls without an area to draw in, where `context.object` is missing.
        return context.mode == "OBJECT" and surface_of(context.view_layer.objects.active) is not None

    @classmethod
    def asset_poll(cls, asset):
        return asset.id_type == "OBJECT" and "Vellus groom" in asset.metadata.tags


def _in_asset_menu(menu, context):
    asset = getattr(context, "asset", None)
    if asset is not None and VELLUS_AST_grooms.asset_poll(asset):
        menu.layout.separator()
        menu.layout.operator("vellus.apply_groom", text="Apply Groom to Active Mesh", text_ctxt=CONTEXT)


CLASSES = (VELLUS_AST_grooms,)


def register():
    """Add the entry to the asset menu."""
    bpy.types.ASSETBROWSER_MT_context_menu.append(_in_asset_menu)


def unregister():
    """Remove the entry from the asset menu."""
    bpy.types.ASSETBROWSER_MT_context_menu.remove(_in_asset_menu)
