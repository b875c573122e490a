# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python interface's functions of dynamics; api.py offers them."""

from typing import Any

from .api_arguments import changed, choice
from .core import lazy
from .core.dynamics.presets import PRESETS, applied
from .core.dynamics.settings import DynamicsSettings
from .core.params import Param, plain_value

blender = lazy.Package(".blender", __package__)

Curves = Any

__all__ = ["DynamicsSettings", "dynamics_of", "set_dynamics"]

_SWITCH = Param("")


def dynamics_of(guides: Curves) -> DynamicsSettings:
    """Return the settings of the simulation of guide Curves.

    >>> api.dynamics_of(bpy.data.objects["Guides"]).bend_stiffness
    8.0
    """
    return blender.settings.properties.own_dynamics_of(blender.data.arguments.curves_of(guides, "GUIDES").vellus)


def set_dynamics(
    guides: Curves,
    settings: DynamicsSettings | str | None = None,
    *,
    simulates: bool | None = None,
    **changes: Any,
) -> DynamicsSettings:
    """Change the simulation of guide Curves; returns its settings.

    settings: `DynamicsSettings`, the name of a preset such as "STYLED", or None for the current ones; changes: fields
    of `DynamicsSettings`; simulates: whether the guides are simulated while the animation plays, None to leave that as
    it is.

    >>> guides = bpy.data.objects["Guides"]
    >>> api.set_dynamics(guides, "STYLED", simulates=True, colliders="Body").hold
    20.0
    """
    target = blender.data.arguments.curves_of(guides, "GUIDES")
    if settings is None or isinstance(settings, str):
        present = blender.settings.properties.own_dynamics_of(target.vellus)
        settings = present if settings is None else applied(present, choice(settings, "dynamics preset", PRESETS))
    wanted = changed(DynamicsSettings, settings, changes)
    if simulates is not None:
        simulates = plain_value("simulates", simulates, False, _SWITCH)
    blender.groom.groom_settings.assign_dynamics(target, wanted)
    if simulates is not None:
        target.vellus.simulates = simulates
    return wanted
