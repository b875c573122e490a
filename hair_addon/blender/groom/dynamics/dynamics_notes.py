# SPDX-License-Identifier: GPL-3.0-or-later
"""Notes on the effect of dynamics settings at the current guide length.

Panels call these on every redraw, so geometry is read once after each change.
"""

import math

import bpy
from bpy.types import Curves, Scene

from ....core.dynamics.rod.stiffness_advice import bend_under_weight
from ....core.errors import HairError
from ...data.simulation import simulated_world
from ...data.strands.curves import is_hand_made
from ...settings import properties
from ...settings.translations import error_text, interface_text
from ..guides import guide_states
from . import frame_folders, guide_simulation

LONGEST = 1.5  # [m]: longer hair suggests a character that is not modeled to scale


def bend_note(guides: Curves, blender_scene: Scene) -> str:
    """Return a translated sentence on how far guides bend under their weight; empty without gravity."""
    try:
        settings = properties.dynamics_of(guides.vellus)
    except HairError as error:
        return error_text(error)
    gravity = blender_scene.gravity.length * abs(settings.gravity) if blender_scene.use_gravity else 0.0
    length = _length(guides, blender_scene)
    if gravity == 0.0 or length == 0.0:
        return ""
    return interface_text(
        "A {length} guide of this material bends by {sink} under its weight.",
        length=_in_words(length, blender_scene),
        sink=_in_words(bend_under_weight(settings, length, gravity), blender_scene),
    )


def stiffness_note(guides: Curves) -> str:
    """Return a translated sentence with the number of guides that cannot hold their shape; empty if none or unknown."""
    try:
        settings = properties.dynamics_of(guides.vellus)
    except HairError:
        return ""  # `bend_note` reports it
    needed = guide_simulation.known_stiffness(guides, settings)
    if needed is None or settings.hold > 0.0:
        return ""
    count = int((needed > settings.bend_stiffness).sum())
    if not count:
        return ""
    return interface_text(
        "{count} of {total} guides cannot hold their shape: they need a bend stiffness of {stiffness}.",
        count=count,
        total=len(needed),
        stiffness=f"{rounded_up(float(needed.max())):g}",
    )


def rounded_up(stiffness: float) -> float:
    """Round a stiffness up to two digits."""
    unit = 10.0 ** (math.floor(math.log10(stiffness)) - 1)
    return float(f"{math.ceil(stiffness / unit) * unit:.2g}")


def size_note(guides: Curves, blender_scene: Scene) -> str:
    """Return translated advice for guides that are too long to be hair; empty otherwise."""
    length = _length(guides, blender_scene)
    if is_hand_made(guides) or not length > LONGEST:
        return ""
    return interface_text(
        "Guides of {length} move slowly: decrease Size if the character is modeled larger than life.",
        length=_in_words(length, blender_scene),
    )


def is_delivery_outdated(hair: Curves) -> bool:
    """Whether guides were baked again since their hair was delivered, as far as is known without reading files."""
    cached = frame_folders.folder_cache.get(hair.vellus.guide_curves.session_uid)
    manifest = None if cached is None or cached[1] is None else cached[1].manifest
    return manifest is not None and hair.vellus.delivered_key != manifest.key


def _length(guides, blender_scene):
    """Return the length of grown guides, or the median length of combed guides [m]."""
    state = guide_states.of(guides)
    length = state.length if state.is_combed else guides.vellus.guides.length
    return length * simulated_world.meters_of(blender_scene, guides.vellus.dynamics)


def _in_words(meters, blender_scene):
    """Format a length with two digits, in scene units."""
    system = blender_scene.unit_settings.system
    return bpy.utils.units.to_string("METRIC" if system == "NONE" else system, "LENGTH", meters, precision=2)
