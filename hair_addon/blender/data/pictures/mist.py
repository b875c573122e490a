# SPDX-License-Identifier: GPL-3.0-or-later
"""Mist of the pass with the same name, by the settings of the world."""

from dataclasses import dataclass

_EXPONENTS = {"QUADRATIC": 2.0, "LINEAR": 1.0, "INVERSE_QUADRATIC": 0.5}


@dataclass(frozen=True)
class Mist:
    """start, depth: distances [m] from the camera at which mist begins, and from there until it hides everything.

    exponent: of the increase from 0 to 1.
    """

    start: float
    depth: float
    exponent: float


WITHOUT_WORLD = Mist(0.0, 100.0, 1.0)  # as in Cycles


def read_mist(blender_scene, view_layer):
    """Return the `Mist` of a scene, or of a view layer that overrides its world."""
    world = view_layer.world_override or blender_scene.world
    if world is None:
        return WITHOUT_WORLD
    settings = world.mist_settings
    return Mist(settings.start, settings.depth, _EXPONENTS[settings.falloff])
