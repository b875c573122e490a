# SPDX-License-Identifier: GPL-3.0-or-later
"""The least stiffness at which the active guides hold their shape."""

import bpy

from .....core.dynamics.rod.settings import DynamicsSettings
from .....core.errors import HairError
from .....core.params import declared
from ....data.strands import curves
from ....groom.dynamics import dynamics_notes, guide_simulation
from ....groom.selection import guides_of
from ..base.hair_operator import HairOperator, needs_guides

_MOST = next(details.high for name, _default, details in declared(DynamicsSettings) if name == "bend_stiffness")


class VELLUS_OT_stiffen_dynamics(HairOperator, bpy.types.Operator):
    """Raise the bend stiffness to the least at which all guides can hold their shape under their weight"""

    bl_idname = "vellus.stiffen_dynamics"
    bl_label = "Stiffen"
    applies = needs_guides

    def change(self, context):
        guides = guides_of(context.object)
        curves.require_overridable(guides)
        needed = guide_simulation.needed_stiffness(guides, context.scene, context.evaluated_depsgraph_get())
        settings = guides.vellus.dynamics
        if needed.max() <= settings.bend_stiffness:
            return "All guides hold their shape with a bend stiffness of {stiffness}", {
                "stiffness": f"{settings.bend_stiffness:g}"
            }
        stiffness = dynamics_notes.rounded_up(float(needed.max()))
        if stiffness > _MOST:
            raise HairError(
                "Guides would need a bend stiffness of {stiffness}, more than there is: shorten them, or use Hold.",
                stiffness=f"{stiffness:g}",
            )
        settings.bend_stiffness = stiffness
        return "Bend stiffness {stiffness}: all guides can hold their shape", {"stiffness": f"{stiffness:g}"}
