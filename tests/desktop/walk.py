# SPDX-License-Identifier: GPL-3.0-or-later
"""An artist's steps in a window: install the extension, grow hair on the head, comb it, save and load.

Run by a desktop Blender as steps.py says, with one of `PARTS`; MORE is the folder of this Python's packages. Writes a
picture of the screen for each step, and the outcome of the shaders' tests (twins.xml).
"""

import os
import sys
from pathlib import Path

import bpy
import gpu
import numpy as np
from mathutils import Vector

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))
from tests.desktop.steps import MORE, OUT, PART, ZIP, facts, take  # noqa: E402
from tests.desktop.window import (  # noqa: E402
    MODULE,
    addon,
    curve_points,
    drag,
    import_head,
    in_viewport,
    no_hair_near,
    offscreen_light,
    places,
    press,
    rectangle,
    refine_to,
    remove_objects,
    shaders_compiled,
    take_picture,
    viewport,
    wait,
    wait_for,
)

# Enough to cover the head; software drivers take their time for each.
STRAND_COUNT = 3000
RADIUS = 4e-4

# Seconds after which hair that follows a stroke has been written.
_WRITTEN = 1.0

facts.setdefault("steps", {})


def screen(name, redraws=1):
    """Take a picture of the whole screen."""
    take_picture(OUT / f"{name}.png", redraws)


def points(name):
    """Return (N, 3) positions of an object's curves."""
    return curve_points(bpy.data.objects[name])


def show(step, **more):
    """Take a picture with hair and one without, and note facts about them."""
    hair = bpy.data.objects["Hair"]
    screen(step)
    hair.hide_set(True)
    screen(f"{step}_bare")
    hair.hide_set(False)
    at = places(points("Hair"))
    _area, region = viewport()
    facts["steps"][step] = {
        "view": rectangle(region),
        "least": at.min(axis=0).tolist(),
        "most": at.max(axis=0).tolist(),
        "display_type": hair.display_type,
        **more,
    }


def install():
    """Install the extension from its zip into an empty profile."""
    result = bpy.ops.extensions.package_install_files(filepath=ZIP, repo="user_default", enable_on_install=True)
    facts["installed"] = {"result": list(result), "enabled": MODULE in bpy.context.preferences.addons}
    facts["version"] = bpy.app.version_string
    yield


def head():
    """Show the sample's head alone, in the middle of the view, lit by a sun over the viewer's shoulder."""
    remove_objects()
    head_object = import_head()
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.rotation_euler = 4.0, (0.9, 0.2, 0.4)
    bpy.context.scene.collection.objects.link(sun)
    bpy.context.scene.render.dither_intensity = 0.0
    area, _region = viewport()
    view = area.spaces.active.region_3d
    area.spaces.active.show_region_ui = True
    area.spaces.active.overlay.show_floor = False
    view.view_perspective = "PERSP"
    view.view_rotation = Vector((0.80, -1.12, 0.25)).to_track_quat("Z", "Y")
    view.view_location, view.view_distance = (0.06, -0.04, 0.715), 0.75
    group = head_object.vertex_groups.new(name="scalp")
    positions = np.empty((len(head_object.data.vertices), 3), np.float32)
    head_object.data.vertices.foreach_get("co", positions.ravel())
    group.add([int(v) for v in np.flatnonzero(positions[:, 2] > 0.78)], 1.0, "REPLACE")
    yield


def grow():
    """Grow hair by the panel's operators."""
    area, _region = viewport()
    sidebar = next(region for region in area.regions if region.type == "UI")
    screen("empty")
    sidebar.active_panel_category = "Hair"
    with in_viewport():
        distributed = bpy.ops.vellus.distribute_guides(guide_count=60, length=0.12, density_group="scalp")
        bpy.context.view_layer.objects.active = bpy.data.objects["Guides"]
        interpolated = bpy.ops.vellus.interpolate_hair(strand_count=STRAND_COUNT, radius=RADIUS, density_group="scalp")
        bpy.data.objects["Hair"].data.vellus.marschner.size = 64
        bpy.context.view_layer.objects.active = bpy.data.objects["Hair"]
        bpy.ops.object.select_all(action="DESELECT")
    yield
    # Colored guides would stand between the hair and what its pixels are held to.
    bpy.data.objects["Guides"].hide_set(True)
    show("grown", results=[list(distributed), list(interpolated)])
    facts["sidebar"] = {"rectangle": rectangle(sidebar), "category": sidebar.active_panel_category}
    np.save(OUT / "offscreen.npy", offscreen_light(addon()))
    pictures, transforms = addon().data.pictures.viewport_shading, addon().gpu.display_transform
    used = transforms.DisplayTransform.of(bpy.context.scene, pictures.NO_SETTINGS)  # of Solid shading
    facts["transform"] = [used.view, used.look or "None", 0.0, used.gamma]
    yield


def shading_modes():
    """Show hair in each shading mode of a viewport."""
    area, _region = viewport()
    # EEVEE's pictures are not compared. Its lamps and shadows take software drivers a minute with Vulkan.
    bpy.context.scene.eevee.taa_samples, bpy.context.scene.eevee.use_shadows = 1, False
    has_lamps = gpu.platform.backend_type_get() == "OPENGL"
    for mode in ("WIREFRAME", "SOLID", "MATERIAL", *(["RENDERED"] if has_lamps else [])):
        area.spaces.active.shading.type = mode
        yield from shaders_compiled()
        screen(f"mode_{mode.lower()}")
    area.spaces.active.shading.type = "SOLID"
    area.spaces.active.overlay.show_overlays = False
    yield
    show("no_overlays")
    area.spaces.active.overlay.show_overlays = True
    bpy.context.scene.view_settings.view_transform = "Standard"
    bpy.context.scene.view_settings.exposure = 1.0
    yield
    show("standard")
    bpy.context.scene.view_settings.view_transform = "AgX"
    bpy.context.scene.view_settings.exposure = 0.0
    area.spaces.active.region_3d.view_perspective = "ORTHO"
    yield
    show("orthographic")
    area.spaces.active.region_3d.view_perspective = "PERSP"
    with in_viewport():
        bpy.ops.screen.region_quadview()
    yield
    screen("quad")
    with in_viewport():
        bpy.ops.screen.region_quadview()
    yield


def comb():
    """Comb guides by a stroke of the Comb brush with the mouse in Sculpt Mode, then undo and redo it."""
    guides = bpy.data.objects["Guides"]
    guides.hide_set(False)
    with in_viewport():
        bpy.context.view_layer.objects.active = guides
        guides.select_set(True)
        bpy.ops.object.mode_set(mode="SCULPT_CURVES")
        bpy.ops.brush.asset_activate(
            asset_library_type="ESSENTIALS",
            relative_asset_identifier="brushes/essentials_brushes-curve_sculpt.blend/Brush/Comb",
        )
        bpy.context.tool_settings.curves_sculpt.unified_paint_settings.size = 120
        bpy.ops.ed.undo_push(message="Hair")  # operators that a script runs leave no step behind
    yield from wait(_WRITTEN)
    before, hair_before = points("Guides"), points("Hair")
    middle = places(before).mean(axis=0)
    yield from drag(middle - np.array([60, 0]), middle + np.array([60, 40]))
    yield from wait(_WRITTEN)
    combed, hair_combed = points("Guides"), points("Hair")
    screen("combed")
    facts["combed"] = {
        "guides moved": float(np.linalg.norm(combed - before, axis=1).max()),
        "hair moved": float(np.linalg.norm(hair_combed - hair_before, axis=1).max()),
    }
    for step, guides_then, hair_then in (("undo", before, hair_before), ("redo", combed, hair_combed)):
        with in_viewport():
            getattr(bpy.ops.ed, step)()
        screen(step)
        yield from wait(_WRITTEN)
        facts[step] = {
            "guides": float(np.linalg.norm(points("Guides") - guides_then, axis=1).max()),
            "hair": float(np.linalg.norm(points("Hair") - hair_then, axis=1).max()),
        }
    with in_viewport():
        bpy.ops.object.mode_set(mode="OBJECT")
    bpy.data.objects["Guides"].hide_set(True)
    yield


def click():
    """Click hair, and places beside it, with each of the tools that select."""
    blender = addon()
    area, region = viewport()
    hair, head_object = bpy.data.objects["Hair"], bpy.data.objects["Head"]
    screen("clicks")
    with in_viewport():
        near = [(int(x) - region.x, int(y) - region.y) for x, y in places(points("Hair"))[20::41]]
        on_hair = next(place for place in near if blender.render.viewport.viewport.hair_at(bpy.context, *place) == hair)
        # The vertex closest to the viewer is in front of the rest of the head.
        eye = area.spaces.active.region_3d.view_matrix.inverted().translation
        skin = sorted(
            (head_object.matrix_world @ v.co for v in head_object.data.vertices), key=lambda p: (p - eye).length
        )
        near = places(np.array(skin)) - (region.x, region.y)
        on_head = next(place for place in near if no_hair_near(blender.render.viewport.viewport, place))
    facts["clicks"] = {}
    for tool in ("builtin.select_box", "builtin.select"):
        with in_viewport():
            bpy.ops.wm.tool_set_by_id(name=tool)
            bpy.ops.object.select_all(action="DESELECT")
        bpy.context.view_layer.objects.active = None
        selected = []
        for place in (on_hair, on_head, on_hair):
            at = np.add(place, (region.x, region.y))
            yield from drag(at, at, steps=1)
            yield from wait(0.3)
            selected.append([o.name for o in (head_object, hair) if o.select_get()])
        facts["clicks"][tool] = selected
    screen("selected")
    area.spaces.active.overlay.show_outline_selected = False
    show("not_outlined")
    np.save(OUT / "not_outlined_hair.npy", offscreen_light(addon(), has_shadow=False)[..., 3])


def write_files():
    """Write a picture, and tables to the path in the file browser, while the window remains open."""
    with in_viewport():
        bpy.ops.object.camera_add()
        camera = bpy.context.scene.camera = bpy.context.object
        camera.matrix_world = viewport()[0].spaces.active.region_3d.view_matrix.inverted()
        bpy.context.view_layer.objects.active = bpy.data.objects["Hair"]
        bpy.ops.vellus.render_picture("INVOKE_DEFAULT", filepath=str(OUT / "picture.png"), width=320, height=240)
    yield from wait_for((OUT / "picture.png").exists)
    with in_viewport():
        bpy.ops.vellus.bake_tables("INVOKE_DEFAULT")
    yield from wait(1.0)
    browser_window, browser = next(
        (window, area)
        for window in bpy.context.window_manager.windows
        for area in window.screen.areas
        if area.type == "FILE_BROWSER"
    )
    folder = OUT / "tables"
    folder.mkdir()
    browser.spaces.active.params.directory = str(folder).encode()
    yield from press("RET", browser_window, browser)
    yield from wait_for((folder / "n_g.exr").exists)
    facts["table_folder"] = bpy.data.hair_curves["Hair"].vellus.table_folder


def render():
    """Render with our engine in a viewport with Rendered shading, and by F12, which opens another window."""
    scene, hair = bpy.context.scene, bpy.data.objects["Hair"]
    area, _region = viewport()
    scene.render.engine, scene.render.film_transparent = "VELLUS", False
    area.spaces.active.shading.type = "RENDERED"
    yield from wait(2.0)
    screen("engine")
    hair.hide_set(True)
    screen("engine_bare")
    hair.hide_set(False)
    with in_viewport():
        bpy.ops.object.camera_add()
        camera = scene.camera = bpy.context.object
        camera.matrix_world = area.spaces.active.region_3d.view_matrix.inverted()
        camera.hide_set(True)
    area.spaces.active.shading.type = "SOLID"
    scene.render.resolution_x, scene.render.resolution_y, scene.vellus.sample_count = 320, 240, 16
    scene.render.use_motion_blur, scene.vellus.motion_steps = True, 2
    scene.render.image_settings.file_format = "PNG"
    scene.render.filepath = str(OUT / "rendered.png")
    with in_viewport():
        bpy.ops.render.render("INVOKE_DEFAULT", write_still=True)
    yield from wait_for((OUT / "rendered.png").exists)
    yield from wait(1.0)
    facts["windows"] = len(bpy.context.window_manager.windows)
    screen("f12")


def save_and_load():
    """Save the file and open it again."""
    hair = points("Hair")
    bpy.ops.wm.save_as_mainfile(filepath=str(OUT / "head.blend"))
    with in_viewport():
        bpy.ops.wm.open_mainfile(filepath=str(OUT / "head.blend"))
    yield
    facts["loaded"] = {"hair": float(np.linalg.norm(points("Hair") - hair, axis=1).max())}
    show("loaded")
    yield


def switch_off():
    """Disable the add-on, so that Blender draws the hair."""
    bpy.ops.preferences.addon_disable(module=MODULE)
    yield
    show("off")
    bpy.ops.preferences.addon_enable(module=MODULE)
    yield


def twins():
    """Run the tests of the shaders' functions on this window's backend."""
    sys.path += [str(ROOT), *MORE]  # behind what this Blender has of its own
    os.chdir(ROOT)  # where pytest finds its settings
    os.environ["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"  # those that are there are built for another Python
    import pytest

    options = ["--noconftest", "-p", "tests.conftest", "-p", "no:cacheprovider", f"--junitxml={OUT / 'twins.xml'}"]
    facts["twins"] = pytest.main(
        ["-q", *options, "tests/blender/gpu/test_glsl.py", "tests/blender/gpu/test_varied_glsl.py"]
    )
    yield


def break_shader():
    """Act as a driver that refuses the shader that lays hair over the viewport, twice, and then restore the shader."""
    shaders = addon().gpu.programs.shaders
    file = shaders.FOLDER / "picture" / "display_transform.glsl"
    text = file.read_text()
    file.write_text(text.replace("return log2", "return nonsense + log2"))
    shaders.program_cache.invalidate((addon().gpu.programs.scene_programs.display_program.__wrapped__, ()))
    screen("broken")
    screen("broken_again")
    file.write_text(text)
    shaders.error_cache.clear()
    yield
    show("mended")


def reopen():
    """Open the file that earlier parts saved, and set what it does not store."""
    with in_viewport():
        bpy.ops.wm.open_mainfile(filepath=str(OUT / "head.blend"))
    yield


def hurry():
    """Draw four samples per pixel in each pass, as with a graphics card, and 16 in all, so that four redraws are
    enough.
    """
    refine_to(16)
    addon().render.viewport.hair_picture.samples_per_side = lambda: 2
    yield


PARTS = {
    "groom_and_view": (install, hurry, head, grow, comb, save_and_load, reopen, click, shading_modes),
    "grown": (install, hurry, head, grow, save_and_load),
    "view": (hurry, reopen, click, shading_modes),
    "render": (hurry, reopen, render),
    "mend": (hurry, reopen, break_shader, switch_off, twins),
    "render_and_mend": (hurry, reopen, render, reopen, break_shader, write_files, switch_off, twins),
}


if __name__ == "__main__":
    take(PARTS[PART])
