# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair in each of Blender's shading modes, beside a mesh of its color that Blender draws, in a window.

Run by a desktop Blender as steps.py says; PART is one of `MODELS`, MORE how many samples a pixel and strands the hair
has. Writes a picture of the screen for each of `COLUMNS`, of which `tools/manual_pictures.py shading_modes` makes the
manual's.
"""

import math
import sys
from pathlib import Path

import bpy
from mathutils import Euler, Vector

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT))
from tests.desktop.steps import MORE, OUT, PART, ZIP, facts, take  # noqa: E402
from tests.desktop.window import (  # noqa: E402
    activate,
    addon,
    import_head,
    in_viewport,
    install,
    mask_scalp,
    of_kind,
    rectangle,
    shaders_compiled,
    take_picture,
    viewport,
    wait,
)

SAMPLES, STRAND_COUNT = map(int, MORE) if MORE else (2, 3_000)

SKIN = (0.45, 0.27, 0.2, 1.0)

_SOLID, _PREVIEW = {"type": "SOLID", "color_type": "MATERIAL"}, {"type": "MATERIAL"}
COLUMNS = {
    "studio_default": _SOLID | {"light": "STUDIO", "studio_light": "Default"},
    "studio_paint": _SOLID | {"light": "STUDIO", "studio_light": "paint.sl"},
    "studio_rim": _SOLID | {"light": "STUDIO", "studio_light": "rim.sl"},
    "matcap": _SOLID | {"light": "MATCAP", "studio_light": "basic_bright.exr"},
    "flat": _SOLID | {"light": "FLAT"},
    "forest": _PREVIEW | {"studio_light": "forest.exr"},
    "sunset": _PREVIEW | {"studio_light": "sunset.exr"},
    "studio": _PREVIEW | {"studio_light": "studio.exr"},
    "rendered": {"type": "RENDERED"},
}


def set_up():
    """Set up the hair on a model in Blender's initial scene, and beside it a mesh in its color."""
    install(ZIP)
    bpy.context.preferences.system.viewport_aa = "OFF"
    addon().render.viewport.hair_picture.SAMPLE_COUNT = SAMPLES
    area, _region = viewport()
    space = area.spaces.active
    space.overlay.show_overlays = space.show_gizmo = space.show_region_toolbar = False
    space.show_region_ui = space.show_region_header = space.show_region_tool_header = False
    yield
    bare = model()
    activate(bare)
    with in_viewport():
        bpy.ops.object.duplicate()
    beside = bpy.context.object
    activate(bare)
    with in_viewport():
        bpy.ops.vellus.add_hair()
    hair = of_kind("HAIR")
    hair.data.vellus.hair.strand_count = STRAND_COUNT
    if PART == "head":
        guides = of_kind("GUIDES").data.vellus.guides
        guides.density_group, guides.length, guides.gravity = "scalp", 0.07, 0.6
        hair.data.vellus.hair.radius = 1.2e-4
    bpy.context.view_layer.update()
    yield from wait(0.5)
    turn = 0.5 if PART == "cube" else 0.35
    right = Vector((math.cos(turn), math.sin(turn), 0.0)) * 1.55 * bare.dimensions.x
    beside.location += right
    # The mesh beside the hair is of its color, and so is the surface below, but for the head.
    tone = hair.active_material.diffuse_color if hair.active_material else (0.3, 0.2, 0.1, 1.0)
    beside.data = beside.data.copy()
    for colored, its in ((beside, tone), (bare, SKIN if PART == "head" else tone)):
        colored.data.materials.clear()
        colored.data.materials.append(material_of(its))
    bpy.context.scene.render.engine = "VELLUS"
    for chosen in bpy.context.view_layer.objects:
        chosen.select_set(False)
    view = space.region_3d
    view.view_perspective, view.view_rotation = "PERSP", Euler((1.25, 0.0, turn)).to_quaternion()
    middle = bare.matrix_world @ (0.125 * sum(map(Vector, bare.bound_box), Vector()))
    view.view_location = middle + 0.5 * right
    view.view_distance = 2.9 * max(bare.dimensions.x, 0.7 * bare.dimensions.z)
    yield from wait(0.5)


def material_of(color):
    """Return a material of this color in all shading modes."""
    material = bpy.data.materials.new("Color")
    material.diffuse_color = color
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = color
    return material


def model():
    """Return the surface of the hair."""
    cube = bpy.data.objects["Cube"]
    if PART == "cube":
        return cube
    bpy.data.objects.remove(cube)
    if PART == "head":
        mask_scalp(import_head())
    with in_viewport():
        if PART == "monkey":
            bpy.ops.mesh.primitive_monkey_add()
        bpy.ops.object.shade_smooth()
    return bpy.context.object


def show():
    """Take a picture in each mode."""
    area, region = viewport()
    shading = area.spaces.active.shading
    facts["view"] = rectangle(region)
    is_compiled = False
    for name, settings in COLUMNS.items():
        for setting, value in settings.items():
            setattr(shading, setting, value)
        area.tag_redraw()
        if settings["type"] == "MATERIAL" and not is_compiled:  # EEVEE compiles shaders from its first redraw on
            is_compiled = True
            for _ in range(2):
                take_picture(OUT / f"{PART}_{name}.png", 1)
                yield from shaders_compiled()
        yield from wait(0.2)
        # A picture that begins anew has the same samples, however often the window was redrawn before.
        addon().render.viewport.region_pictures.picture_cache.clear()
        take_picture(OUT / f"{PART}_{name}.png", SAMPLES)
        yield


if __name__ == "__main__":
    take([set_up, show])
