# SPDX-License-Identifier: GPL-3.0-or-later
"""Grooms in a window: tubes by the dialog and the redo panel, and an asset applied from the shelf.

Steps of a walk in which there is hair.
"""

import bpy
import numpy as np

from tests.desktop.window import addon, drag, in_viewport, press, take_picture, viewport, wait, wait_for, window


def tubes(hair, facts):
    """Create tubes by the dialog, fewer by the redo panel, and undo; notes numbers of polygons."""
    with in_viewport():
        bpy.context.view_layer.objects.active = hair
        bpy.ops.ed.undo_push(message="Hair")
        facts["asked"] = list(bpy.ops.vellus.hair_tubes("INVOKE_DEFAULT", True))
    yield from wait(0.5)
    facts["before it is confirmed"] = _polygons()
    yield from press("RET", window(), viewport()[0])
    yield from wait_for(lambda: _polygons() > 0)
    facts["made"] = _polygons()
    bpy.context.window_manager.operators[-1].properties.tube_count = 5
    with in_viewport():
        bpy.ops.ed.undo_redo("EXEC_DEFAULT", True)
    facts["redone"] = _polygons()
    with in_viewport():
        bpy.ops.ed.undo()
    facts["undone"] = _polygons()
    yield


def _polygons():
    made = bpy.data.meshes.get("Hair Tubes")
    return 0 if made is None else len(made.polygons)


def shelf(hair, folder, facts):
    """Save a groom to a library with the shelf open, apply it to another mesh by a click, and undo; notes numbers of
    hair.

    folder: of the library, which does not exist yet.
    """
    folder.mkdir()
    bpy.context.preferences.use_preferences_save = False
    bpy.context.preferences.filepaths.asset_libraries.new(name="Grooms", directory=str(folder))
    area, _region = viewport()
    area.spaces.active.show_region_asset_shelf = True
    with in_viewport():
        bpy.context.view_layer.objects.active = hair
        yield from wait(1.0)  # the empty library is read
        bpy.ops.vellus.save_groom("INVOKE_DEFAULT", True, name="Saved", library="Grooms")
    yield from wait(0.5)
    yield from press("RET", window(), area)
    yield from wait_for(lambda: any(folder.iterdir()))
    with in_viewport():
        bpy.ops.object.select_all(action="DESELECT")
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, location=(0.0, 0.0, 3.0))
        bpy.ops.ed.undo_push(message="Sphere")
    yield from wait(1.5)  # until its picture is there
    take_picture(folder.with_suffix(".png"), 2)
    facts["before"] = _hair_count()
    region = next(region for region in area.regions if region.type == "ASSET_SHELF")
    first = np.array([region.x + 50, region.y + region.height - 45])
    for _time in range(10):  # a shelf ignores clicks until its assets are read
        yield from drag(first, first, steps=1)
        yield from wait_for(lambda: _hair_count() > facts["before"], 5.0)
        yield from wait_for(lambda: addon().host.running.job() is None)
        if _hair_count() > facts["before"]:
            break
    facts["applied"] = _hair_count()
    with in_viewport():
        bpy.ops.ed.undo()
    facts["undone"] = _hair_count()
    yield


def _hair_count():
    return sum(o.type == "CURVES" and o.data.vellus.kind == "HAIR" for o in bpy.context.scene.objects)
