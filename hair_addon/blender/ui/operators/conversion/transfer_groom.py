# SPDX-License-Identifier: GPL-3.0-or-later
"""A hair system → the same on another mesh."""

import bpy

from .....core.errors import HairError
from .....core.grooming import cost
from .....core.grooming.transfer_settings import TransferSettings
from ....data import scene
from ....groom.selection import guides_of, hair_of, make_active, object_of
from ....groom.transfer import groom_transfers
from ....settings import properties, setting_properties
from ....settings.translations import report_text
from ... import setting_rows
from ..base.modal import LongOperator


class VELLUS_OT_transfer_groom(LongOperator, bpy.types.Operator):
    """Copy the active hair system to the other selected mesh, with guides, settings, styles and look"""

    bl_idname = "vellus.transfer_groom"
    bl_label = "Transfer Groom"
    __annotations__ = {
        "target": properties.mesh_name(
            "Target", "Mesh to copy the hair to. Leave empty to use the other selected mesh"
        ),
        **setting_properties.annotations(TransferSettings),
    }

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select the mesh to copy hair to, and then the hair, in Object Mode.")
        return context.mode == "OBJECT" and guides_of(context.object) is not None

    def draw(self, context):
        setting_rows.search_row(self.layout, self.properties, "target", bpy.data, "objects")
        setting_rows.row(self.layout, self.properties, "method")
        if self.method == "NEAREST":
            setting_rows.row(self.layout, self.properties, "alignment")
        if self.method != "UV":
            setting_rows.row(self.layout, self.properties, "reach")
        setting_rows.row(self.layout, self.properties, "scale_lengths")

    def seconds(self, context):
        hair = hair_of(context.object)
        face_count = scene.triangle_count(self._target(context), context.view_layer)
        return 0.0 if hair is None else cost.hair_seconds(hair.vellus.hair, face_count)

    def work(self, context):
        guides, hair = guides_of(context.object), hair_of(context.object)
        if hair is not None and hair.vellus.guide_curves != guides:
            hair = None
        settings = setting_properties.given_settings(self, TransferSettings)
        return groom_transfers.transferring(
            guides, hair, self._target(context), settings, context.evaluated_depsgraph_get()
        )

    def message(self, made):
        if made.hair is None:
            return "{count} guides", {"count": len(made.guides.curves)}
        counts = {"guide_count": len(made.guides.curves), "strand_count": len(made.hair.curves)}
        return "{guide_count} guides, {strand_count} strands", counts

    def after(self, context, made):
        shown = object_of(made.hair or made.guides, context.view_layer)
        if shown is not None:
            make_active(shown, context.view_layer)
        for sentence, values in made.notes():
            self.report({"WARNING"}, report_text(sentence, **values))

    def _target(self, context):
        if self.target:
            found = context.view_layer.objects.get(self.target)
            if found is None or found.type != "MESH":
                raise HairError('There is no mesh object "{name}".', name=self.target)
            return found
        surface = guides_of(context.object).surface
        others = [o for o in context.selected_objects if o.type == "MESH" and o != surface]
        if len(others) != 1:
            raise HairError("Select the one mesh to copy the hair to, and then the hair.")
        return others[0]
