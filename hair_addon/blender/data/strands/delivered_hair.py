# SPDX-License-Identifier: GPL-3.0-or-later
"""Delivered hair: Blender's *Mesh Sequence Cache* plays frames of a file, in place of following the surface.

Files that link the hair, render farms and Blender without the add-on play it.
"""

from pathlib import Path

import bpy

from . import curves_objects, follow_nodes

ROOT = "vellus_hair"  # root of the file's hierarchy, which identifies the modifier even if renamed

_NAME = "Delivered Hair"


def modifier_of(hair_object):
    """Return the modifier that plays delivered frames; None if hair follows its surface."""
    found = (modifier for modifier in hair_object.modifiers if is_ours(modifier))
    return next(found, None)


def modifiers_in_viewports(hair_object):
    """Modifiers of the artist that viewports show: neither those that follow the surface nor delivered frames."""
    following = follow_nodes.modifier_of(hair_object)
    shown = [m for m in hair_object.modifiers if m.show_viewport and m != following and not is_ours(m)]
    return [m for m in shown if m.type != "NODES" or m.node_group is not None]


def is_ours(modifier):
    """Whether a modifier plays delivered frames."""
    return modifier.type == "MESH_SEQUENCE_CACHE" and modifier.object_path.startswith(f"/{ROOT}/")


def is_delivered(hair):
    """Whether an object of hair Curves plays delivered frames."""
    return any(modifier_of(user) is not None for user in objects_of(hair))


def files_of(hair):
    """Return the files that objects of hair Curves play."""
    playing = [modifier_of(user) for user in objects_of(hair)]
    return {_absolute(m.cache_file.filepath) for m in playing if m is not None and m.cache_file is not None}


def objects_of(hair):
    """Return the objects of hair Curves, in all scenes."""
    return [user for user in bpy.data.objects if user.type == "CURVES" and user.data == hair]


def deliver(hair, cache_file, object_path):
    """Let all objects of hair Curves play frames of a CacheFile, in place of following their surface."""
    for user in objects_of(hair):
        if user.library is not None:
            continue
        take_off(user)
        modifier = user.modifiers.new(_NAME, "MESH_SEQUENCE_CACHE")
        modifier.cache_file, modifier.object_path = cache_file, object_path
        following = follow_nodes.modifier_of(user)
        place = 0
        if following is not None:
            place = user.modifiers.find(following.name)
            following.show_viewport = following.show_render = False
        user.modifiers.move(len(user.modifiers) - 1, place)


def take_off(hair_object):
    """Let an object's hair follow its surface again; returns whether it played delivered frames."""
    modifier = modifier_of(hair_object)
    if modifier is None:
        return False
    hair_object.modifiers.remove(modifier)
    following = follow_nodes.modifier_of(hair_object)
    if following is not None:
        following.show_viewport = following.show_render = True
    if hair_object.parent is not None and hair_object.parent == hair_object.data.surface:
        curves_objects.attach_to_surface(hair_object, hair_object.parent)  # applied transforms had moved the object
    return True


def open_file(path):
    """Return a new CacheFile of a file; its path is relative if the .blend is saved."""
    before = {*bpy.data.cache_files}
    bpy.ops.cachefile.open(filepath=str(path))
    (opened,) = {*bpy.data.cache_files} - before
    if bpy.data.filepath:
        opened.filepath = bpy.path.relpath(str(path))
    return opened


def close_files(path):
    """Remove the CacheFiles of a file that is about to be replaced: modifiers play nothing until it is opened."""
    opened = [c for c in bpy.data.cache_files if c.library is None and _absolute(c.filepath) == path]
    bpy.data.batch_remove(opened)


def _absolute(filepath):
    return Path(bpy.path.abspath(filepath)).resolve()


def new_probe(hair_object):
    """Add a copy of a hair object without the modifiers after the one that follows the surface, and return it.

    The copy is always visible. The caller removes it.
    """
    probe = hair_object.copy()
    bpy.context.scene.collection.objects.link(probe)
    probe.hide_viewport = probe.hide_render = False
    following = follow_nodes.modifier_of(probe)
    last = -1 if following is None else probe.modifiers.find(following.name)
    for place, modifier in reversed([*enumerate(probe.modifiers)]):
        if place > last or is_ours(modifier):
            probe.modifiers.remove(modifier)
    if following is not None:
        follow_nodes.modifier_of(probe).show_viewport = True
        follow_nodes.hide(probe, False)
    return probe
