# SPDX-License-Identifier: GPL-3.0-or-later
"""Python interface: the hair systems of the open file, and names of looks and style presets."""

from typing import Any

from .blender_access import blender

Curves = Any
MeshObject = Any

__all__ = ["delete_hair", "hair_systems", "look_names", "style_preset_names"]


def hair_systems(surface: MeshObject | None = None) -> list[Curves]:
    """Return the hair systems of the open scene, or those on one mesh object, oldest first.

    A system is its hair Curves, or its guide Curves if it has no hair. `settings_of`, `styles_of` and `points` read
    them; `hair.vellus.guide_curves` are the guides of hair.

    >>> api.hair_systems(bpy.data.objects["Scalp"])[0].name
    'Hair'
    """
    view_layer = blender.data.scene.present_depsgraph().view_layer
    if surface is not None:
        return blender.groom.systems.hair_systems.systems_of(blender.data.arguments.surface_object(surface), view_layer)
    return blender.groom.systems.hair_systems.all_systems(view_layer)


def delete_hair(system: Curves) -> None:
    """Delete a hair system with its objects: its hair, and its guides unless other hair follows them.

    system: hair or guide Curves; of guides with hair, the hair is deleted too.

    >>> count = len(api.hair_systems())
    >>> hair = api.interpolate_hair(bpy.data.objects["Guides"], strand_count=50)
    >>> api.delete_hair(hair)
    >>> len(api.hair_systems()) == count
    True
    """
    target = blender.data.arguments.curves_of(system)
    followers = blender.data.strands.curves.followers(target) if target.vellus.kind == "GUIDES" else []
    parts = [*followers, target] if followers else blender.groom.systems.hair_systems.parts_of_system(target)
    blender.groom.systems.edits.delete(parts)


def look_names() -> list[str]:
    """Return the names of looks that `shade` accepts: built-in looks, then looks that the user saved.

    >>> api.look_names()[:2]
    ['BLACK', 'DARK_BROWN']
    """
    return blender.settings.saved_looks.all_names()


def style_preset_names() -> list[str]:
    """Return the names of presets that `apply_style_preset` accepts: built-in presets, then those that the user saved.

    >>> api.style_preset_names()[0]
    'STRAIGHT'
    """
    return blender.settings.saved_styles.all_names()
