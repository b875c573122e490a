# SPDX-License-Identifier: GPL-3.0-or-later
"""EEVEE's hair shape, a setting of scenes: set once in each scene that shows hair, and then left to the artist.

By Blender's default EEVEE draws lines at least a pixel wide. A scene that appends, links or instances hair has that
default, regardless of the scene in which the hair was made.
"""

import bpy

_SET = "vellus_thin_hair"  # custom property of scenes that `show_thin` has handled


def show_thin(blender_scene):
    """Let EEVEE draw strands with their true width, unless this was done in the scene before."""
    if blender_scene.library is not None or _SET in blender_scene:
        return
    blender_scene[_SET] = True
    if blender_scene.render.hair_type == "STRAND":
        blender_scene.render.hair_type = "STRIP"


def state_of(blender_scene):
    """Return (Whether `show_thin` has handled a scene, its hair shape type)."""
    return _SET in blender_scene, blender_scene.render.hair_type


def restore(blender_scene, was_set, hair_type):
    """Restore the values of `state_of` from before `show_thin`."""
    if not was_set and _SET in blender_scene:
        del blender_scene[_SET]
        blender_scene.render.hair_type = hair_type


def follow(blender_scenes):
    """`show_thin` in those scenes that show our hair: in their objects, in instances or in the background set."""
    waiting = [one for one in blender_scenes if one.library is None and _SET not in one]
    if waiting and any(curves.vellus.kind == "HAIR" for curves in bpy.data.hair_curves):
        for blender_scene in waiting:
            if _shows_hair(blender_scene):
                show_thin(blender_scene)


def _shows_hair(blender_scene):
    seen, waiting = set(), [blender_scene]
    while waiting:
        shown = waiting.pop()
        if shown is None or shown in seen:
            continue
        seen.add(shown)
        if isinstance(shown, bpy.types.Scene):
            waiting.append(shown.background_set)
        for one in shown.objects if isinstance(shown, bpy.types.Scene) else shown.all_objects:
            if one.type == "CURVES" and one.data.vellus.kind == "HAIR":
                return True
            waiting.append(one.instance_collection)
    return False
