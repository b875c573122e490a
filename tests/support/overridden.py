# SPDX-License-Identifier: GPL-3.0-or-later
"""A character that a shot links and overrides, with its hair."""

import bpy
import numpy as np

from tests.support.reading import points

_FRAMES = (1, 10)


def override(hair, folder):
    """Save hair with its sphere and guides to a file, and link and override it in a new file, which stays open.

    Returns the overridden collection; the new file is "shot.blend" in the folder.
    """
    character = bpy.data.collections.new("Character")
    for part in (bpy.data.objects["Sphere"], bpy.data.objects["Guides"], hair):
        part.users_collection[0].objects.unlink(part)
        character.objects.link(part)
    path = str(folder / "character.blend")
    bpy.data.libraries.write(path, {character})
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "shot.blend"))
    with bpy.data.libraries.load(path, link=True) as (_there, here):
        here.collections = ["Character"]
    bpy.context.scene.collection.children.link(here.collections[0])
    local = here.collections[0].override_hierarchy_create(bpy.context.scene, bpy.context.view_layer)
    bpy.context.view_layer.update()
    return local


def reopen(folder):
    """Save the shot and open it again."""
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=str(folder / "shot.blend"))


def parts():
    """Return (sphere, guides, hair) objects that are overridden in the open file."""
    found = [o for o in bpy.data.objects if o.override_library is not None]
    curves = {o.data.vellus.kind: o for o in found if o.type == "CURVES"}
    return next(o for o in found if o.type == "MESH"), curves["GUIDES"], curves["HAIR"]


def override_keyed(hair, folder, style, radii):
    """Key the radius of a style's curls at frames 1 and 10, override the hair, and assert that it plays as before.

    Returns the overridden hair.
    """
    for frame, radius in zip(_FRAMES, radii, strict=True):
        hair.data.vellus.styles[style].curl.radius = radius
        hair.data.keyframe_insert(f"vellus.styles[{style}].curl.radius", frame=frame)
    alone = _played(hair)
    override(hair, folder)
    overridden = _played(parts()[2])
    assert np.abs(alone[0] - alone[1]).max() > 1e-3
    np.testing.assert_allclose(overridden, alone, atol=1e-5)
    return parts()[2]


def _played(hair):
    found = []
    for frame in _FRAMES:
        bpy.context.scene.frame_set(frame)
        found.append(points(hair))
    return found
