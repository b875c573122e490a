# SPDX-License-Identifier: GPL-3.0-or-later
"""A preset of dynamics → the active guides."""

import bpy

from .....core.dynamics.rod.presets import PRESETS, applied
from ....groom.selection import guides_of
from ....groom.transfer import groom_settings
from ....settings import properties
from ..base.hair_operator import HairOperator, needs_guides


class VELLUS_OT_apply_dynamics_preset(HairOperator, bpy.types.Operator):
    """Make the simulated guides move like another kind of hair"""

    bl_idname = "vellus.apply_dynamics_preset"
    bl_label = "Apply Dynamics Preset"
    __annotations__ = {
        "preset": properties.choice(
            "Preset",
            "Preset to apply",
            {identifier: label for identifier, (label, _tooltip, _changes) in PRESETS.items()},
            {identifier: tooltip for identifier, (_label, tooltip, _changes) in PRESETS.items()},
        )
    }
    applies = needs_guides

    def change(self, context):
        guides = guides_of(context.object)
        wanted = applied(properties.own_dynamics_of(guides.vellus), self.preset)
        groom_settings.assign_dynamics(guides, wanted)
        return PRESETS[self.preset][0], {}
