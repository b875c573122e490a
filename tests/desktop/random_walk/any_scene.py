# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene of any_setting.py: surfaces that are deformed, animated and linked, with hair."""

import bpy

from tests.desktop.window import in_viewport, viewport, wait

SURFACES = ("Plain", "Subdivided", "Bent", "Keyed", "Scaled")
LIBRARY = "library.blend"


def build(folder):
    """Build surfaces of every kind with hair, one of them linked with its hair from another file."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    yield
    with in_viewport():
        _build_library(folder)
        for number, name in enumerate(SURFACES):
            _add_surface(name, (2.5 * (number - 2), 0.0, 0.0))
            bpy.ops.vellus.add_hair("EXEC_DEFAULT", guide_count=30, strand_count=300, length=0.4)
        with bpy.data.libraries.load(str(folder / LIBRARY), link=True) as (found, wanted):
            wanted.objects = list(found.objects)
        for linked in wanted.objects:
            bpy.context.scene.collection.objects.link(linked)
        sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
        bpy.context.scene.collection.objects.link(sun)
        bpy.ops.curve.primitive_bezier_curve_add(radius=0.8, location=(-5.0, 0.0, 1.0))
        bpy.context.object.name = "Line"
        bpy.ops.ed.undo_push(message="Scene")
    space = viewport()[0].spaces.active
    space.region_3d.view_location, space.region_3d.view_distance = (0.0, 0.0, 0.0), 16.0
    space.show_region_ui = True
    yield from wait(0.5)
    _sidebar().active_panel_category = "Hair"  # its panels are drawn with every step
    yield


def _sidebar():
    return next(region for region in viewport()[0].regions if region.type == "UI")


def _build_library(folder):
    _add_surface("Linked", (0.0, 3.0, 0.0))
    bpy.ops.vellus.add_hair("EXEC_DEFAULT", guide_count=30, strand_count=300, length=0.4)
    curves = [o for o in bpy.context.view_layer.objects if o.type == "CURVES"]
    bpy.data.libraries.write(str(folder / LIBRARY), {bpy.data.objects["Linked"], *curves})
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    bpy.data.orphans_purge()


def _add_surface(name, place):
    if name == "Plain":
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, location=place)
    else:
        bpy.ops.mesh.primitive_monkey_add(location=place)
    surface = bpy.context.object
    surface.name = name
    surface.vertex_groups.new(name="half").add([v.index for v in surface.data.vertices if v.co.z > 0.0], 1.0, "REPLACE")
    if name == "Subdivided":
        surface.modifiers.new("Subdivision", "SUBSURF").levels = 1
    if name in {"Bent", "Linked"}:
        surface.modifiers.new("Bend", "SIMPLE_DEFORM").angle = 0.8
    if name == "Keyed":
        surface.shape_key_add(name="Basis")
        key = surface.shape_key_add(name="Long")
        for point in key.points:
            point.co.z *= 1.6
        for frame, value in ((1, 0.0), (20, 1.0)):
            key.value = value
            key.keyframe_insert("value", frame=frame)
    if name == "Scaled":
        surface.scale = (-1.0, 0.7, 1.3)
