# SPDX-License-Identifier: GPL-3.0-or-later
"""Composite Hair, depth of field and Export Groom in a window, on surfaces that are deformed, keyed and linked.

Run by a desktop Blender as steps.py says. Writes pictures. Those by Cycles have one sample: with the same seed they are
equal where the scene is.
"""

import sys
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))
from tests.desktop.random_walk import any_scene  # noqa: E402
from tests.desktop.steps import OUT, PART, ZIP, facts, take  # noqa: E402
from tests.desktop.window import (  # noqa: E402
    MODULE,
    in_viewport,
    install,
    press,
    rectangle,
    take_picture,
    viewport,
    wait,
    wait_for,
    window,
)

SCENE = str(OUT / "composited.blend")


def scene():
    return bpy.context.scene


def hair():
    """Return the objects of hair of the scene."""
    return [o for o in scene().objects if o.type == "CURVES" and o.data.vellus.kind == "HAIR"]


def pixels_of(path):
    """Return (height, width, 3) display colors of a file."""
    image = bpy.data.images.load(str(path))
    pixels = np.array(image.pixels, np.float32).reshape(image.size[1], image.size[0], 4)
    bpy.data.images.remove(image)
    return pixels[..., :3]


def differ(name, other):
    """Return the mean difference of two pictures."""
    return float(np.abs(pixels_of(OUT / f"{name}.png") - pixels_of(OUT / f"{other}.png")).mean())


def close_other_windows():
    for other in bpy.context.window_manager.windows[1:]:
        with bpy.context.temp_override(window=other):
            bpy.ops.wm.window_close()


def begin_render(name, **options):
    scene().render.filepath = str(OUT / name)
    with in_viewport():
        bpy.ops.render.render("INVOKE_DEFAULT", **options)


def rendering():
    """Wait for the end of a render, and close its window."""
    yield
    yield from wait_for(lambda: not bpy.app.is_job_running("RENDER"))
    yield
    close_other_windows()
    yield


def render(name):
    """Render by F12 into a file."""
    begin_render(f"{name}.png", write_still=True)
    yield from rendering()


def toggle():
    """Press the button, which adds a step to the undo history."""
    with in_viewport():
        bpy.ops.vellus.toggle_composite("EXEC_DEFAULT", True)
    yield


def undo():
    with in_viewport():
        bpy.ops.ed.undo()
    yield


def is_on():
    """Whether there is a scene of the hair, and no engine sees hair."""
    return [scene().vellus.hair_scene is not None, not any(o.visible_camera for o in hair())]


def browsers():
    """Return [(window, area)] of file browsers."""
    windows = bpy.context.window_manager.windows
    return [(other, area) for other in windows for area in other.screen.areas if area.type == "FILE_BROWSER"]


# The steps.


def build():
    """Set up the surfaces before a camera with one sample per pixel, and delete the hair of one by hand."""
    install(ZIP)
    yield from any_scene.build(OUT)
    emptied = next(o for o in hair() if o.data.surface.name == "Scaled")
    bpy.context.view_layer.objects.active = emptied
    with in_viewport():
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.curves.select_all(action="SELECT")
        bpy.ops.curves.delete()
        bpy.ops.object.mode_set(mode="OBJECT")
    camera = scene().camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, -16.0, 4.0), (1.35, 0.0, 0.0)
    camera.data.dof.focus_distance, camera.data.dof.aperture_fstop = 8.0, 0.05
    scene().collection.objects.link(camera)
    render_settings = scene().render
    render_settings.engine, render_settings.resolution_x, render_settings.resolution_y = "CYCLES", 160, 60
    render_settings.image_settings.file_format = "PNG"
    scene().cycles.samples, scene().cycles.use_denoising, scene().vellus.sample_count = 1, False, 4
    scene().frame_start, scene().frame_end, scene().frame_step = 1, 20, 19
    yield


def turn_on():
    """Take pictures by Cycles alone and with the hair by Vellus; undo and redo."""
    yield from render("own")
    yield from toggle()
    yield from render("on")
    facts["on"], facts["changed"] = is_on(), differ("on", "own")
    yield from undo()
    facts["undone"] = is_on()
    with in_viewport():
        bpy.ops.ed.redo()
    yield
    facts["redone"] = is_on()


def animate():
    begin_render("frame_", animation=True)
    yield from rendering()
    facts["frames"] = [differ("frame_0001", "on"), differ("frame_0020", "on")]


def reload_while_it_renders():
    """Open another file in the middle of a render."""
    bpy.ops.wm.save_as_mainfile(filepath=SCENE)
    scene().vellus.sample_count = 64
    yield
    begin_render("stopped.png", write_still=True)
    yield from wait(0.5)
    with in_viewport():
        bpy.ops.wm.open_mainfile(filepath=SCENE)
    yield from rendering()
    facts["opened"] = is_on()
    yield from render("opened")
    facts["as before"] = differ("opened", "on")


def copy():
    """Copy the scene with its objects, and delete the scene of the copy's hair."""
    with in_viewport():
        bpy.ops.scene.new(type="FULL_COPY")
    yield from wait_for(lambda: scene().vellus.hair_scene.background_set == scene())
    owner = scene().vellus.hair_scene.background_set
    facts["copy"] = {"has its own": owner == scene(), "scenes": len(bpy.data.scenes)}
    yield from render("copy")
    facts["copy"]["picture"] = differ("copy", "on")
    bpy.data.scenes.remove(scene().vellus.hair_scene)
    yield from wait_for(lambda: is_on() == [False, False])
    facts["copy"]["without its scene"] = is_on()
    bpy.data.scenes.remove(scene())
    yield
    window().scene = bpy.data.scenes["Scene"]
    yield


def disable():
    """Disable and enable the add-on, and restore everything."""
    bpy.ops.preferences.addon_disable(module=MODULE)
    yield from render("disabled")
    bpy.ops.preferences.addon_enable(module=MODULE)
    yield from wait_for(lambda: is_on() == [True, True])
    facts["enabled"] = is_on()
    yield from toggle()
    yield from render("off")
    facts["disabled"], facts["off"] = differ("disabled", "own"), differ("off", "own")


def focus():
    """Show our engine in the viewport through the camera, in focus and out of focus."""
    area, region = viewport()
    scene().render.engine, area.spaces.active.shading.type = "VELLUS", "RENDERED"
    area.spaces.active.region_3d.view_perspective = "CAMERA"
    area.spaces.active.overlay.show_overlays = False
    area.spaces.active.show_region_ui = False  # the sidebar lies over the picture
    for name in ("sharp", "blurred"):
        scene().camera.data.dof.use_dof = name == "blurred"
        yield
        take_picture(OUT / f"{name}.png", redraws=7)
    left, bottom, width, height = rectangle(region)
    rows, columns = slice(bottom + height // 4, bottom + 3 * height // 4), slice(left, left + width)
    shown = [pixels_of(OUT / f"{name}.png")[rows, columns].max(axis=-1) > 0.05 for name in ("sharp", "blurred")]
    facts["shown"] = [float(part.mean()) for part in shown]
    area.spaces.active.shading.type = "SOLID"


def export():
    """Export a groom of hair that moves with its surface, to the path in the file browser."""
    keyed = next(o for o in hair() if o.data.surface.name == "Keyed")
    bpy.context.view_layer.objects.active = keyed
    with in_viewport():
        bpy.ops.vellus.export_groom("INVOKE_DEFAULT", animation="ALL")
    yield from wait_for(lambda: browsers() and browsers()[0][1].spaces.active.params is not None)
    params = browsers()[0][1].spaces.active.params
    params.directory, params.filename = str(OUT).encode(), "groom.abc"
    for _time in range(5):  # a browser that is not drawn yet takes no keys
        if browsers():
            yield from press("RET", *browsers()[0])
            yield from wait_for(lambda: not browsers(), 3.0)
    yield from wait_for((OUT / "groom.abc").exists)
    facts["exported"] = (OUT / "groom.abc").exists() and (OUT / "groom.abc").stat().st_size
    facts["frame"] = scene().frame_current


PARTS = {"renders": (build, turn_on, animate, reload_while_it_renders)}
PARTS["all"] = (*PARTS["renders"], copy, disable, focus, export)


if __name__ == "__main__":
    take(PARTS[PART])
