# SPDX-License-Identifier: GPL-3.0-or-later
"""Baked guides → hair as frames of a file, which Blender plays without the add-on."""

import bpy

from ....groom.selection import guides_of
from ....io import delivery
from ....settings.translations import report_text
from ..base.hair_operator import needs_guides
from ..base.modal import LongOperator


class VELLUS_OT_deliver_dynamics(LongOperator, bpy.types.Operator):
    """Write the baked hair to a file beside the .blend, and let Blender play that: linked files, render farms and \
Blender without Vellus show the same hair"""

    bl_idname = "vellus.deliver_dynamics"
    bl_label = "Deliver Hair"
    applies = needs_guides

    def seconds(self, context):
        return float("inf")  # how long the animation itself takes is not known

    def work(self, context):
        guides = guides_of(context.object)
        return (yield from delivery.delivering(guides, delivery.path_of(guides), context.scene))

    def message(self, made):
        values = {"first": made.first, "last": made.last, "file": made.path.name}
        return "Frames {first} to {last} delivered in {file}", values

    def stopped(self):
        """What is reported after Esc."""
        return report_text("Canceled: hair was not delivered.")
