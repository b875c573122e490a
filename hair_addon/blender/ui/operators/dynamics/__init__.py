# SPDX-License-Identifier: GPL-3.0-or-later
"""One file per operator of dynamics."""

from .apply_dynamics_preset import VELLUS_OT_apply_dynamics_preset
from .bake_dynamics import VELLUS_OT_bake_dynamics
from .deliver_dynamics import VELLUS_OT_deliver_dynamics
from .free_dynamics import VELLUS_OT_free_dynamics
from .play_dynamics import VELLUS_OT_play_dynamics
from .remove_delivery import VELLUS_OT_remove_delivery
from .stiffen_dynamics import VELLUS_OT_stiffen_dynamics

CLASSES = (
    VELLUS_OT_play_dynamics,
    VELLUS_OT_bake_dynamics,
    VELLUS_OT_free_dynamics,
    VELLUS_OT_deliver_dynamics,
    VELLUS_OT_remove_delivery,
    VELLUS_OT_apply_dynamics_preset,
    VELLUS_OT_stiffen_dynamics,
)
