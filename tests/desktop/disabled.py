# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on is disabled in the preferences while a window renders with its engine, and enabled again.

Run by a desktop Blender as steps.py says.
"""

import math
import sys
import threading
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))
from tests.desktop.steps import OUT, ZIP, facts, take  # noqa: E402
from tests.desktop.window import MODULE, addon, in_viewport, install, viewport, wait, wait_for, window  # noqa: E402

SAMPLES = 64


def is_rendering():
    return bpy.app.is_job_running("RENDER")


def is_there():
    """Whether the engine is registered, and hair has its settings."""
    engines = {getattr(cls, "bl_idname", "") for cls in bpy.types.RenderEngine.__subclasses__() if cls.is_registered}
    return ["VELLUS" in engines, hasattr(bpy.types.Curves, "vellus")]


def reports():
    return [report.message for report in bpy.context.window_manager.reports]


def build():
    install(ZIP)
    scene = bpy.context.scene
    with in_viewport():
        bpy.ops.object.select_all(action="SELECT")
        bpy.ops.object.delete()
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3)
        bpy.ops.vellus.add_hair(guide_count=30, strand_count=400)
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.camera.location, scene.camera.rotation_euler = (0.0, -6.0, 0.0), (math.pi / 2, 0.0, 0.0)
    scene.collection.objects.link(scene.camera)
    scene.render.engine, scene.render.resolution_x, scene.render.resolution_y = "VELLUS", 320, 240
    scene.render.image_settings.file_format = "PNG"
    world = scene.world or bpy.data.worlds.new("World")
    scene.world, damaged = world, OUT / "damaged.png"
    damaged.write_bytes(b"\x89PNG\r\n\x1a\n")
    sky = world.node_tree.nodes.new("ShaderNodeTexEnvironment")
    sky.image = bpy.data.images.new("Damaged", 4, 4)
    sky.image.filepath, sky.image.source = str(damaged), "FILE"
    world.node_tree.links.new(sky.outputs[0], world.node_tree.nodes["Background"].inputs[0])
    # A 3-D view waits for a render that has the GPU, and all of Blender with it: nobody can disable anything then.
    bpy.context.preferences.view.render_display_type = "NONE"
    viewport()[0].type = "PREFERENCES"
    yield


def begin_render(name, go_on):
    """Render by F12 into a file; the render draws nothing more until an event is set, with any driver."""
    begun, film = threading.Event(), addon().render.film.Film
    add_pass = film.add_pass

    def add_late(*given):
        begun.set()
        assert go_on.wait(120.0)
        return add_pass(*given)

    film.add_pass = add_late
    scene = bpy.context.scene
    scene.vellus.sample_count, scene.render.filepath = SAMPLES, str(OUT / name)
    bpy.ops.render.render("INVOKE_DEFAULT", write_still=True)
    yield from wait_for(begun.is_set)
    film.add_pass = add_pass


def disable():
    """Disable the add-on during a render: it continues, Blender handles events, and the add-on ends with the render."""
    go_on = threading.Event()
    yield from begin_render("disabled.png", go_on)
    bpy.ops.preferences.addon_disable(module=MODULE)
    facts["disable"] = {"renders on": is_rendering(), "there": is_there()}
    handled = 0
    while is_rendering():
        handled += is_there() == [True, True]
        if handled > 3:
            go_on.set()
        yield
    facts["disable"]["handled"] = handled
    facts["disable"]["rendered"] = (OUT / "disabled.png").exists()
    yield from wait_for(lambda: not any(is_there()))
    facts["disable"]["then there"] = is_there()
    # Blender shows the reports of a render at the next event of its operator, which is modal.
    window().event_simulate(type="MOUSEMOVE", value="NOTHING", x=window().width // 2, y=window().height // 2)
    yield from wait_for(lambda: any("damaged" in report for report in reports()))
    facts["disable"]["reports"] = reports()
    facts["disable"]["listed"] = MODULE in bpy.context.preferences.addons


def enable():
    """Enable the add-on; it stays if it was disabled and enabled within one render."""
    bpy.ops.preferences.addon_enable(module=MODULE)
    yield
    facts["enable"] = {"there": is_there()}
    bpy.context.scene.render.engine = "VELLUS"
    go_on = threading.Event()
    yield from begin_render("enabled.png", go_on)
    bpy.ops.preferences.addon_disable(module=MODULE)
    yield
    bpy.ops.preferences.addon_enable(module=MODULE)
    facts["enable"]["renders on"] = is_rendering()
    go_on.set()
    yield from wait_for(lambda: not is_rendering())
    yield from wait(2.0)
    facts["enable"] |= {"then there": is_there(), "rendered": (OUT / "enabled.png").exists()}


if __name__ == "__main__":
    take((build, disable, enable))
