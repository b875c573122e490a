# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's window for walks, with its 3-D view, screenshots and the mouse."""

import subprocess
import sys
import time
from pathlib import Path

import bpy
import numpy as np

# Seconds after which a window that was drawn is seen.
_SHOWN = 0.5

# Rounds of Blender's events after which timers of the add-on that start each other have run, at any processor speed.
_ROUNDS = 5

MODULE = "bl_ext.user_default.vellus"

_HEAD = Path(__file__).resolve().parents[2] / "blend_samples" / "head.obj"

# The hairline of the sample's head from the side, (y, z) [m], from the forehead to the nape; the face looks to -Y.
_HAIRLINE = np.array([(-0.17, 0.82), (-0.105, 0.787), (-0.068, 0.74), (-0.03, 0.744), (0.0, 0.69), (0.04, 0.68)])


def install(path):
    """Install the extension from its zip, unless the profile has it; returns its package `blender`."""
    if MODULE not in bpy.context.preferences.addons:
        bpy.ops.extensions.package_install_files(filepath=path, repo="user_default", enable_on_install=True)
    return addon()


def addon():
    """Return the package `blender` of the add-on that is installed."""
    return sys.modules[f"{MODULE}.hair_addon.blender"]


def refine_to(sample_count=2):
    """Set the number of samples of hair to which viewports refine, with one sample for everything else.

    For drivers without a GPU, which take as long for shadow maps, so these are small too; call it in each Blender of a
    walk once the add-on is installed.
    """
    bpy.context.preferences.system.viewport_aa = "OFF"
    addon().render.viewport.hair_picture.SAMPLE_COUNT = sample_count
    addon().gpu.scene_lights._MAP_SIZE = 256
    addon().gpu.ambient_visibility._SIZE, addon().gpu.ambient_visibility._LEAST_STRANDS = 64, 600


def remove_objects():
    """Remove all objects of the file."""
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)


def window():
    return bpy.context.window_manager.windows[0]


def viewport():
    """Return (area, region) of the 3-D view."""
    area = next(area for area in window().screen.areas if area.type == "VIEW_3D")
    return area, next(region for region in area.regions if region.type == "WINDOW")


def in_viewport():
    """Return the context of a click into the 3-D view."""
    area, region = viewport()
    return bpy.context.temp_override(window=window(), area=area, region=region)


def sidebar():
    """Return the 3D view's region of panels."""
    area, _region = viewport()
    return next(region for region in area.regions if region.type == "UI")


def activate(chosen):
    """Make an object active and the only selected one."""
    with in_viewport():
        bpy.ops.object.select_all(action="DESELECT")
    chosen.select_set(True)
    bpy.context.view_layer.objects.active = chosen


def of_kind(kind):
    """Return the first object of hair ("HAIR") or guides ("GUIDES"), None if there is none."""
    return next((o for o in bpy.data.objects if o.type == "CURVES" and o.data.vellus.kind == kind), None)


def curve_points(curves_object):
    """Return (N, 3) positions of an object's curves, in its own coordinates."""
    curves = curves_object.data
    values = np.empty((len(curves.points), 3), np.float32)
    curves.attributes["position"].data.foreach_get("vector", values.ravel())
    return values


def import_head():
    """Import the sample's head from its OBJ file."""
    with in_viewport():
        bpy.ops.wm.obj_import(filepath=str(_HEAD))
        head = bpy.context.object
        bpy.ops.object.transform_apply(rotation=True)
    head.name = "Head"
    return head


def take_picture(path, redraws=1):
    """Redraw until no viewport refines its picture, and write a picture of the whole screen."""
    with in_viewport():
        bpy.ops.wm.redraw_timer(type="DRAW_WIN", iterations=redraws)
        # Vulkan draws and shows beside Blender, up to two pictures late.
        bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=3)
    time.sleep(_SHOWN)
    subprocess.run(["import", "-window", "root", path], check=True)


def mask_scalp(head):
    """Add the group `scalp` above the hairline to the head; returns (V,) whether vertices are in it, and (V, 3)
    positions.
    """
    positions = np.empty((len(head.data.vertices), 3), np.float32)
    head.data.vertices.foreach_get("co", positions.ravel())
    above = positions[:, 2] > np.interp(positions[:, 1], *_HAIRLINE.T)
    head.vertex_groups.new(name="scalp").add(np.flatnonzero(above).tolist(), 1.0, "REPLACE")
    return above, positions


def wait(seconds):
    """Yield to Blender for some time, and for some rounds of events, timers and redraws, which may take longer."""
    end, rounds = time.monotonic() + seconds, 0
    while time.monotonic() < end or rounds < _ROUNDS:
        rounds += 1
        yield


def wait_for(happened, seconds=180.0):
    """Yield to Blender until a condition is true or a time has passed."""
    end = time.monotonic() + seconds
    while not happened() and time.monotonic() < end:
        yield


def shaders_compiled():
    """Yield to Blender until EEVEE has compiled all shaders, which it does in other threads."""
    yield from wait(1.0)
    yield from wait_for(lambda: not bpy.app.is_job_running("SHADER_COMPILATION"), 12.0)


def rectangle(region):
    """Return (left, bottom, width, height) of a region [pixels]."""
    return [region.x, region.y, region.width, region.height]


def places(points):
    """Convert (N, 3) world positions to (N, 2) pixels of the screen, from its lower left corner."""
    area, region = viewport()
    clip = np.c_[points, np.ones(len(points))] @ np.array(area.spaces.active.region_3d.perspective_matrix).T
    return (0.5 * clip[:, :2] / clip[:, 3:] + 0.5) * (region.width, region.height) + (region.x, region.y)


def drag(start, end, steps=12):
    """Press the left mouse button at a place of the window, and release it at another."""
    for step in range(steps + 1):
        x, y = (int(value) for value in start + (end - start) * step / steps)
        window().event_simulate(type="MOUSEMOVE", value="NOTHING", x=x, y=y)
        yield
        if step == 0:
            window().event_simulate(type="LEFTMOUSE", value="PRESS", x=x, y=y)
            yield
    window().event_simulate(type="LEFTMOUSE", value="RELEASE", x=x, y=y)
    yield


def click(x, y):
    """Click the left mouse button at a place of the window."""
    place = np.array([x, y])
    yield from drag(place, place, steps=1)
    yield from wait(0.3)


def key(name, place=None, **held):
    """Press and release a key while the mouse is at a place, by default in the middle of the 3D view.

    held: `ctrl`, `shift`.
    """
    _area, region = viewport()
    x, y = place or (region.x + region.width // 2, region.y + region.height // 2)
    at = {"x": int(x), "y": int(y)}
    window().event_simulate(type="MOUSEMOVE", value="NOTHING", **at)
    yield
    for value in ("PRESS", "RELEASE"):
        window().event_simulate(type=name, value=value, **at, **held)
        yield


def press(key, in_window, area):
    """Press a key while the mouse is in the middle of an area, without releasing it, as the window may be gone by
    then.
    """
    at = {"x": area.x + area.width // 2, "y": area.y + area.height // 2}
    in_window.event_simulate(type="MOUSEMOVE", value="NOTHING", **at)
    yield
    in_window.event_simulate(type=key, value="PRESS", **at)
    yield


def offscreen_light(blender, has_shadow=True):
    """Return (height, width, 4) linear premultiplied light of hair in the 3-D view, 16 samples per pixel.

    blender: the add-on's package of this name; has_shadow: with the shadow of hair on its surface.
    """
    import gpu

    drawing, drawn_scene = blender.gpu.drawing, blender.render.drawn_scene
    area, region = viewport()
    view, samples = area.spaces.active.region_3d, 4
    size = (region.width * samples, region.height * samples)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    space, shading = area.spaces.active, blender.data.pictures.viewport_shading
    look = shading.read(space, bpy.context.scene, np.array(view.view_matrix, np.float64))
    drawn = drawn_scene.read(bpy.context.scene, bpy.context.view_layer, depsgraph, space, shown=look)
    matrices = np.array(view.view_matrix, np.float64), np.array(view.window_matrix, np.float64)
    record = drawing.pass_record(*matrices, size)
    buffer = blender.gpu.visibility_buffer.VisibilityBuffer(*size)
    with buffer.surfaces():
        draw_surfaces = blender.render.scene_drawing.draw_viewport_shadow
        if not has_shadow or space.shading.type != "SOLID":
            draw_surfaces = blender.render.scene_drawing.draw_hiding
        draw_surfaces(drawn, record)
    blender.render.scene_drawing.draw_hair(drawn, record, buffer)
    resolved = gpu.types.GPUTexture((region.width, region.height), format="RGBA32F")
    target = gpu.types.GPUFrameBuffer(color_slots=resolved)
    with target.bind():
        drawing.resolve(buffer.color, samples)
        pixels = np.array(target.read_color(0, 0, region.width, region.height, 4, 0, "FLOAT"), np.float32)
    return pixels.reshape(region.height, region.width, 4)


def no_hair_near(drawn, place):
    """Whether a pixel has no hair within the distance at which Blender takes a click for a hit."""
    around = np.add(place, np.indices((5, 5)).reshape(2, -1).T * 5 - 10)
    return not any(drawn.hair_at(bpy.context, int(x), int(y)) for x, y in around)
