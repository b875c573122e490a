# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that repair or prepare a surface for hair."""

import bpy

from ...groom.selection import mesh_to_attach_to, parts_of, surface_of
from ...groom.surfaces import attached_hair
from ...groom.systems import edits
from ...live import last_update
from .base.hair_operator import HairOperator, needs_surface


class VELLUS_OT_attach_to_surface(HairOperator, bpy.types.Operator):
    """Attach the active hair and its guides to their surface, or to the selected mesh"""

    bl_idname = "vellus.attach_to_surface"
    bl_label = "Attach to Surface"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("In Object Mode, select hair or guides and a mesh.")
        return context.mode == "OBJECT" and mesh_to_attach_to(context) is not None

    def change(self, context):
        parts, depsgraph = parts_of(context.object), context.evaluated_depsgraph_get()
        attached_hair.attach(parts, mesh_to_attach_to(context), depsgraph, last_update.place_before)


class VELLUS_OT_make_uv_map(HairOperator, bpy.types.Operator):
    """Unwrap the surface to a new UV map without overlaps, which hair nodes use to find roots"""

    bl_idname = "vellus.make_uv_map"
    bl_label = "Make UV Map"
    applies = needs_surface

    def change(self, context):
        edits.make_uv_map(surface_of(context.object), context.view_layer)


class VELLUS_OT_use_uv_map(HairOperator, bpy.types.Operator):
    """Update the root coordinates of all hair on the surface from the active UV map"""

    bl_idname = "vellus.use_uv_map"
    bl_label = "Use Active UV Map"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select a mesh with hair, or hair on one.")
        return surface_of(context.object) is not None

    def change(self, context):
        edits.renew_uvs(surface_of(context.object), context.evaluated_depsgraph_get())


class VELLUS_OT_check_uvs(HairOperator, bpy.types.Operator):
    """Check the surface's UV map for overlaps, where hair nodes misplace strands"""

    bl_idname = "vellus.check_uvs"
    bl_label = "Check UVs"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select a mesh, or hair on one.")
        return surface_of(context.object) is not None

    def change(self, context):
        share = edits.check_uvs(surface_of(context.object), context.evaluated_depsgraph_get())
        return "{percent:.1f}% of the surface has overlapping or missing UVs", {"percent": 100.0 * share}


class VELLUS_OT_apply_scale(HairOperator, bpy.types.Operator):
    """Apply the surface's scale to its mesh and leave its guides in place"""

    bl_idname = "vellus.apply_scale"
    bl_label = "Apply Scale"
    applies = needs_surface

    def change(self, context):
        edits.apply_scale(surface_of(context.object), context.view_layer)


class VELLUS_OT_flip_normals(HairOperator, bpy.types.Operator):
    """Flip the normals of the surface's faces. Guides that were not combed are regenerated on the other side"""

    bl_idname = "vellus.flip_normals"
    bl_label = "Flip Normals"
    applies = needs_surface

    def change(self, context):
        edits.flip_normals(surface_of(context.object), context.view_layer)


CLASSES = (
    VELLUS_OT_attach_to_surface,
    VELLUS_OT_make_uv_map,
    VELLUS_OT_use_uv_map,
    VELLUS_OT_check_uvs,
    VELLUS_OT_apply_scale,
    VELLUS_OT_flip_normals,
)
