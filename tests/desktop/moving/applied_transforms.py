# SPDX-License-Identifier: GPL-3.0-or-later
"""Applied transforms on the sample head with hair in a window: pictures before and after.

Run by a desktop Blender as steps.py says. Writes pictures of the screen.
"""

import sys
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT))
from tests.desktop.steps import OUT, ZIP, facts, take  # noqa: E402
from tests.desktop.window import (  # noqa: E402
    activate,
    addon,
    import_head,
    in_viewport,
    install,
    mask_scalp,
    offscreen_light,
    refine_to,
    take_picture,
    viewport,
    wait,
)


def head():
    return bpy.data.objects["Head"]


def head_with_hair():
    install(ZIP)
    refine_to()
    for thing in list(bpy.data.objects):
        if thing.type == "MESH":
            bpy.data.objects.remove(thing)
    mask_scalp(import_head())
    with in_viewport():
        bpy.ops.vellus.add_hair("EXEC_DEFAULT", guide_count=100, strand_count=2000, density_group="scalp")
    head().location, head().rotation_euler = (0.12, -0.05, 0.08), (0.2, -0.1, 0.5)
    view = viewport()[0].spaces.active.region_3d
    view.view_location, view.view_distance = (0.12, -0.05, 0.85), 1.1
    yield from wait(0.5)


def compared(name, change):
    """Do something that leaves the head in place, and note the light of hair and the part of it that changed."""
    activate(head())
    yield from wait(0.3)
    before = offscreen_light(addon())
    take_picture(OUT / f"{name}_before.png")
    with in_viewport():
        change()
    yield from wait(0.3)
    after = offscreen_light(addon())
    take_picture(OUT / f"{name}_after.png")
    is_hair = (before[..., 3] > 0.0) | (after[..., 3] > 0.0)
    differ = float((np.abs(before - after)[..., 3] > 2.5 / 16.0)[is_hair].mean())
    facts[name] = [
        float(is_hair.mean()),
        differ,
        [o.data.vellus.status for o in bpy.data.objects if o.type == "CURVES"],
    ]


def all_transforms():
    yield from compared(
        "all_transforms", lambda: bpy.ops.object.transform_apply(location=True, rotation=True, scale=True)
    )


def set_origin():
    yield from compared("set_origin", lambda: bpy.ops.object.origin_set(type="ORIGIN_GEOMETRY"))


def mirrored():
    head().scale.x = -1.0
    yield from compared("mirrored", bpy.ops.vellus.apply_scale)


def rig_in_centimeters():
    """Put the head on a rig in centimeters, and apply all transforms to it with the rig."""
    rig = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.scene.collection.objects.link(rig)
    rig.scale, rig.location = (0.01,) * 3, (0.1, 0.2, 0.0)
    bpy.context.view_layer.update()
    place = head().matrix_world.copy()
    head().parent = rig
    bpy.context.view_layer.update()
    head().matrix_world = place
    yield from wait(0.3)

    def applied():
        rig.select_set(True)
        bpy.ops.object.transform_apply(location=True, rotation=True, scale=True)

    yield from compared("rig", applied)


if __name__ == "__main__":
    take((head_with_hair, all_transforms, set_origin, mirrored, rig_in_centimeters))
