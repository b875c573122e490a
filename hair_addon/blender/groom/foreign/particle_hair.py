# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair of Blender's particle systems → a Curves object, by Blender's own conversion; the system is switched off."""

from collections.abc import Iterator
from contextlib import contextmanager

import bpy
from bpy.types import Object, ParticleSystem

from ....core.errors import HairError
from ....core.grooming.derived_guides import DerivationSettings
from ....core.grooming.groom import HairSettings
from ....core.long_work import Progress, no_progress, run_now
from ...data import scene, whole_changes
from ...data.strands import curves, curves_objects
from ...host.notices import name_of
from . import hand_made_guides, kept_hair


def systems_of(surface: Object | None) -> list[ParticleSystem]:
    """Return the hair particle systems of a mesh object."""
    if surface is None or surface.type != "MESH":
        return []
    return [system for system in surface.particle_systems if system.settings.type == "HAIR"]


def system_to_convert(surface: Object) -> ParticleSystem:
    """Return a mesh object's active particle system if it is hair, else the first with hair. Raises `HairError`."""
    found = systems_of(surface)
    if not found:
        raise HairError('"{name}" has no particle system of hair.', name=name_of(surface))
    active = surface.particle_systems.active
    return next((system for system in found if system == active), found[0])


def convert(
    surface: Object, use: str, settings: DerivationSettings, progress: Progress = no_progress
) -> kept_hair.KeptHair | hand_made_guides.HandMade:
    """Convert a mesh object's particle hair to hair (use "HAIR") or to guides with hair between them ("GUIDES").

    settings: of the guides of "HAIR". Raises `HairError` before anything changes.
    """
    with as_curves(surface) as made:
        depsgraph = scene.present_depsgraph()
        if use == "HAIR":
            return run_now(kept_hair.using_as_hair(made, surface, depsgraph, settings), progress)
        work = hand_made_guides.using_as_guides(made, surface, depsgraph, hair_settings=HairSettings())
        return run_now(work, progress)


@contextmanager
def as_curves(surface: Object) -> Iterator[Object]:
    """Context with a new Curves object of a mesh object's particle hair. Raises `HairError`.

    On success the system is switched off; otherwise the object is removed.
    """
    system = system_to_convert(surface)
    curves.require_overridable(surface)
    surface.particle_systems.active_index = list(surface.particle_systems).index(system)
    name, before = system.name, set(bpy.data.objects)
    modifier = next(m for m in surface.modifiers if m.type == "PARTICLE_SYSTEM" and m.particle_system == system)
    if not (modifier.show_viewport and surface.visible_get()):
        raise HairError('"{name}" or its particle system is hidden: show it first.', name=name_of(surface))
    with whole_changes.whole_change(surface):
        _convert(surface, system.settings)
        made = next((o for o in bpy.data.objects if o not in before and o.type == "CURVES"), None)
        if made is None or not len(made.data.curves):
            raise HairError('The particle system "{system}" has no hair yet.', system=name)
        made.name = made.data.name = name
        made.data.surface = surface
        # Its points are in the surface's coordinates, but Blender gives it a transform without the surface's shear.
        curves_objects.attach_to_surface(made, surface)
        bpy.context.view_layer.update()
        yield made
    modifier = surface.modifiers[modifier.name]
    modifier.show_viewport = modifier.show_render = False


def _convert(surface, settings):
    """Convert the parents of the active system; otherwise Blender would convert their children instead."""
    layer = bpy.context.view_layer
    for other in layer.objects:
        if other is not None:
            other.select_set(other == surface)
    layer.objects.active = surface
    children = settings.child_type
    try:
        settings.child_type = "NONE"
        layer.update()
        bpy.ops.curves.convert_from_particle_system()
    finally:
        settings.child_type = children
        layer.update()
