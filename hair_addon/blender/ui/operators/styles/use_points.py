# SPDX-License-Identifier: GPL-3.0-or-later
"""Points per strand that the active hair's curls want."""

import bpy

from ....groom.selection import hair_of
from ....groom.styles import hair_styles
from ..base.hair_operator import HairOperator, needs_hair


class VELLUS_OT_use_points(HairOperator, bpy.types.Operator):
    """Increase the points per strand to what the curls of the active hair need to be smooth"""

    bl_idname = "vellus.use_points"
    bl_label = "Use Points for Curls"
    applies = needs_hair

    def change(self, context):
        return "{count} points per strand", {"count": hair_styles.use_points(hair_of(context.object))}
