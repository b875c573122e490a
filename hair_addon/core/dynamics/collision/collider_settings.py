# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of a mesh object that hair collides with."""

from dataclasses import dataclass

from ...params import Settings, param, param_of
from ..rod.settings import DynamicsSettings


@dataclass(frozen=True)
class ColliderSettings(Settings):
    """Collision settings of a mesh object, which override the settings of the hair."""

    overrides_friction: bool = param(
        False, "Use the friction of this object instead of that of the hair", label="Own friction"
    )
    friction: float = param_of(DynamicsSettings, "friction")
    overrides_distance: bool = param(
        False, "Use the collision distance of this object instead of that of the hair", label="Own distance"
    )
    collision_distance: float = param_of(DynamicsSettings, "collision_distance")
    is_double_sided: bool = param(
        False,
        "Hair collides with both sides, as for cloth, and stays on its side. Otherwise hair is kept outside",
        label="Double-Sided",
    )


def contact_of(collider: ColliderSettings, settings: DynamicsSettings) -> tuple[float, float]:
    """Return (coefficient of friction, distance [units of length]) between hair and a collider."""
    friction = collider.friction if collider.overrides_friction else settings.friction
    distance = collider.collision_distance if collider.overrides_distance else settings.collision_distance
    return friction, distance
