# SPDX-License-Identifier: GPL-3.0-or-later
"""Times of a viewport that shows a production shot, on a posed character with three hair systems, in milliseconds.

.venv/bin/python tests/benchmarks/viewports/production_shot.py

The sample head has 136,000 triangles, an armature and a shape key, 100,000 strands with Clump, Curl and Frizz, 2,000
strands of brows and 200,000 of fuzz, two area lights and an HDRI. The view turns, the animation plays, or a slider of a
style moves. Columns: Blender's evaluation with the handlers of the add-on, Blender's drawing, and drawing by Vellus,
each measured until the GPU has finished. Rows named "twice" are without hidden hair: Blender evaluates and draws all
strands too. `--parts` also prints the time of each stage, with a wait after it, and the functions that take the host's
time. `--small` tries the program without a GPU.
"""

import argparse
import cProfile
import os
import pstats
import sys
import time
from pathlib import Path

import bpy
import gpu
import numpy as np
import warp as wp
from mathutils import Matrix

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

import hair_addon
from blend_samples.heads import brows, head
from hair_addon.blender.data import scene
from hair_addon.blender.data.pictures import drawn_meshes
from hair_addon.blender.gpu.display_transform import DisplayTransform
from hair_addon.blender.gpu.shadows import ShadowMaps
from hair_addon.blender.gpu.strands.strand_bounds import StrandBounds
from hair_addon.blender.gpu.strands.strand_carrier import StrandCarrier
from hair_addon.blender.gpu.strands.strand_maker import StrandMaker
from hair_addon.blender.gpu.strands.style_maker import StyleMaker
from hair_addon.blender.groom import hidden_hair
from hair_addon.blender.host import running, scene_time
from hair_addon.blender.live import hidden_previews, live_hair
from hair_addon.blender.render import (
    drawn_hair,
    drawn_scene,
    drawn_surfaces,
    hair_cache,
    motion_vectors,
    scene_drawing,
)
from hair_addon.blender.render.viewport import hair_picture, viewport
from hair_addon.blender.render.viewport.history import History
from hair_addon.blender.settings import preferences, style_items
from hair_addon.core.styling.kinds import KINDS
from tests.benchmarks.draw_beside_blender import save
from tests.benchmarks.edit_guides import bend
from tests.benchmarks.viewports.crowd import TURN

SIZE, FRAMES, STARTS = (1920, 1080), 24, 4  # measured frames; those before them compile and warm up
STRANDS = {"hair": 100_000, "brows": 2_000, "fuzz": 200_000}
MAY_HIDE = hidden_hair._may_hide_any

# Stages whose time is measured without that of the stages within them.
STAGES = {
    "guides": (StrandMaker, "put_guides"),
    "fill": (StrandMaker, "fill_some"),
    "styles": (StyleMaker, "_style"),
    "carry": (StrandCarrier, "carry"),
    "bounds": (StrandBounds, "_read"),
    "pose": (hair_cache, "_pose_of"),
    "hair read": (drawn_hair, "read_shown"),
    "meshes": (drawn_meshes, "read_drawn_meshes"),
    "upload": (drawn_surfaces, "upload"),
    "lamps": (drawn_scene, "_lamps_of"),
    "maps": (ShadowMaps, "draw"),
    "lit": (drawn_scene, "_lit"),
    "world": (drawn_scene, "_renewed"),
    "all of the world": (drawn_scene, "visibility"),
    "scene": (viewport, "drawn_scene_of"),
    "surfaces": (scene_drawing, "draw_hiding"),
    "hair": (scene_drawing, "draw_hair"),
    "sums": (hair_picture.HairPicture, "_accumulate"),
    "motion": (motion_vectors, "draw_nearest"),
    "surface motion": (motion_vectors, "draw_surfaces"),
    "history": (History, "add"),
    "show": (hair_picture.HairPicture, "show"),
    "vellus": (None, "draw_vellus"),
}


def build(strands):
    """Build the shot: a posed head with three hair systems; returns the Curves of the longest hair."""
    surface = head.build()
    subdivision = surface.modifiers.new("Subdivision", "SUBSURF")
    bpy.ops.object.modifier_apply(modifier=subdivision.name)
    _guides, hair = head.grow(surface, guide_count=1000, strand_count=strands["hair"])
    for kind in ("CLUMP", "CURL", "FRIZZ"):
        style_items.add(hair.data.vellus, KINDS[kind]())
    _add_brow_group(surface)
    add_system(surface, strands["brows"], 200, length=0.009, density_group="brows")
    add_system(surface, strands["fuzz"], 1000, length=0.003, density_group="")
    live_hair.write_all()
    _pose(surface)
    head.light()
    bpy.data.objects.remove(bpy.data.objects["Fill"])
    bpy.context.view_layer.update()
    return hair


def add_system(surface, strand_count, guide_count, **settings):
    """Add another hair system to a surface."""
    bpy.context.view_layer.objects.active = surface
    bpy.ops.vellus.add_hair(guide_count=guide_count, strand_count=strand_count, radius=3e-5, **settings)


def _add_brow_group(surface):
    places = np.empty((len(surface.data.vertices), 3), np.float32)
    surface.data.vertices.foreach_get("co", places.ravel())
    heights = np.interp(np.abs(places[:, 0]), brows._BROW[:, 0], brows._BROW[:, 1])
    wide = (np.abs(places[:, 0]) > brows._BROW[0, 0]) & (np.abs(places[:, 0]) < brows._BROW[-1, 0])
    inside = wide & (np.abs(places[:, 2] - heights) < 0.004) & (places[:, 1] < -0.08)
    surface.vertex_groups.new(name="brows").add([int(i) for i in np.flatnonzero(inside)], 1.0, "REPLACE")


def _pose(surface):
    """Give a head an armature whose bone turns, and a shape key that bends it, with keyframes."""
    bend(surface, 4 * (FRAMES + STARTS))
    surface.data.shape_keys.key_blocks["Bent"].value = 0.2
    armature = bpy.data.objects.new("Armature", bpy.data.armatures.new("Armature"))
    bpy.context.scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    bone = armature.data.edit_bones.new("Neck")
    bone.head, bone.tail = (0.0, 0.02, 0.6), (0.0, 0.0, 0.8)
    bpy.ops.object.mode_set(mode="OBJECT")
    places = np.empty((len(surface.data.vertices), 3), np.float32)
    surface.data.vertices.foreach_get("co", places.ravel())
    weights = np.clip((places[:, 2] - 0.56) / 0.1, 0.0, 1.0)
    group = surface.vertex_groups.new(name="Neck")
    for index in np.flatnonzero(weights > 0.0):
        group.add([int(index)], float(weights[index]), "REPLACE")
    surface.modifiers.new("Armature", "ARMATURE").object = armature
    posed = armature.pose.bones["Neck"]
    posed.rotation_mode = "XYZ"
    for frame in range(0, 4 * (FRAMES + STARTS), 10):
        posed.rotation_euler = (0.1, 0.1 + 0.2 * (frame // 10 % 2), 0.0)
        posed.keyframe_insert("rotation_euler", frame=frame)


class Window:
    """The 3D viewport of Blender's start-up screen, drawn into a picture by Blender and then by Vellus."""

    def __init__(self, size):
        window = bpy.context.window_manager.windows[0]
        area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
        self.space, self._size = area.spaces.active, size
        region = next(region for region in area.regions if region.type == "WINDOW")
        self._where = {"window": window, "area": area, "region": region}
        self.space.overlay.show_overlays = False
        bpy.context.preferences.system.viewport_aa = "OFF"
        bpy.context.scene.eevee.taa_samples = 1
        depsgraph = bpy.context.evaluated_depsgraph_get()
        self._to_view, self._to_clip = scene.read_camera(bpy.context.scene, depsgraph, *size)
        self._target = gpu.types.GPUOffScreen(*size, format="RGBA16F")
        self._picture = hair_picture.HairPicture(size, 2)
        self._table = hair_picture.table_texture(DisplayTransform.of(bpy.context.scene).table())

    def turn(self):
        """Turn the view."""
        step = np.eye(4)
        step[:2, :2] = [[np.cos(TURN), -np.sin(TURN)], [np.sin(TURN), np.cos(TURN)]]
        self._to_view = self._to_view @ step

    def draw_blender(self):
        """Let Blender draw the scene."""
        context = bpy.context
        matrices = (Matrix(self._to_view.tolist()), Matrix(self._to_clip.tolist()))
        region, layer = self._where["region"], context.view_layer
        self._target.draw_view3d(context.scene, layer, self.space, region, *matrices, do_color_management=False)
        self.wait()

    def draw_vellus(self):
        """Draw hair over Blender's picture, with all updates, as the add-on does in a window."""
        with bpy.context.temp_override(**self._where):
            bpy.context.region_data.view_matrix = Matrix(self._to_view.tolist())
            drawn = viewport.drawn_scene_of(bpy.context)
        self._picture.restart(is_moved=True)
        self._picture.add_pass(drawn, self._to_view, self._to_clip)
        with self._target.bind():
            self._picture.show(self._table, 1.0, depth_test="ALWAYS")
        self.wait()

    def wait(self):
        """Wait for all drawing, by reading a pixel."""
        self.read(1, 1)

    def read(self, width, height):
        """Return the picture's corner (height, width, 4) float32."""
        with self._target.bind():
            pixels = gpu.state.active_framebuffer_get().read_color(0, 0, width, height, 4, 0, "FLOAT")
        return np.array(pixels, np.float32).reshape(height, width, 4)


def turn(window, _hair, _turn):
    """The view turns."""
    window.turn()


def play(_window, _hair, turn):
    """The animation plays."""
    bpy.context.scene.frame_set(turn)


def slide(_window, hair, turn):
    """A slider of the last style moves."""
    style_items.group_of(hair.data.vellus.styles[-1]).amount = 0.9 if turn % 2 else 0.8
    bpy.context.view_layer.update()


def measure(window, hair, action, has_hair=True):
    """Return the medians [ms] of evaluation, Blender's drawing and ours, and of their sum."""
    found, is_played = [], action is play
    scene_time.is_shown_moving = scene_time.is_playing = lambda: is_played
    for index in range(1, FRAMES + STARTS + 1):
        times = [time.perf_counter()]
        action(window, hair, index)
        times.append(time.perf_counter())
        window.draw_blender()
        times.append(time.perf_counter())
        if has_hair:
            window.draw_vellus()
            hair_cache.prepare_makers()
        times.append(time.perf_counter())
        found.append((*np.diff(times), times[-1] - times[0]))
    return 1e3 * np.median(found[STARTS:], axis=0)


def measure_stages(window, hair, action):
    """Return {stage: median time [ms]} of Vellus after an action, each waited for, and without stages within it."""
    found, real, stack = [], {}, []

    def timed(name, work):
        def call(*given, **named):
            window.wait()
            started, within = time.perf_counter(), 0.0
            stack.append(within)
            result = work(*given, **named)
            window.wait()
            taken = 1e3 * (time.perf_counter() - started)
            found[-1][name] = found[-1].get(name, 0.0) + taken - stack.pop()
            if stack:
                stack[-1] += taken
            return result

        return call

    for name, (owner, label) in STAGES.items():
        owner = owner or window
        real[name] = owner, label, getattr(owner, label)
        setattr(owner, label, timed(name, real[name][2]))
    for index in range(1, FRAMES + 1):
        found.append({})
        action(window, hair, index)
        window.draw_vellus()
    for owner, label, work in real.values():
        setattr(owner, label, work)
    return {name: float(np.median([one.get(name, 0.0) for one in found[STARTS:]])) for name in STAGES}


def print_parts(window, hair, action):
    """Print stages of an action, and the functions of the host that take the most time."""
    shown = measure_stages(window, hair, action)
    print("   ", "  ".join(f"{name} {value:.2f}" for name, value in shown.items() if value > 0.005), flush=True)
    profile = cProfile.Profile()
    for index in range(1, FRAMES + 1):
        action(window, hair, index)
        profile.enable()
        window.draw_vellus()
        profile.disable()
    pstats.Stats(profile).strip_dirs().sort_stats("tottime").print_stats(24)


def main():
    """Print a row for each mode of shading and each action."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--small", action="store_true", help="few strands, pixels and frames")
    parser.add_argument("--parts", action="store_true", help="print the time of each stage too")
    parser.add_argument("--limit", type=float, default=200.0, help="seconds after which no row begins")
    parser.add_argument("--out", type=Path, help="folder for a picture of each mode of shading")
    options = parser.parse_args()
    size, strands = SIZE, STRANDS
    if options.small:
        globals().update(FRAMES=3, STARTS=2)
        size, strands = (192, 108), {name: count // 100 for name, count in STRANDS.items()}
    hair_addon.register()
    gpu.init()
    wp.config.log_level = wp.LOG_WARNING
    running.has_window = lambda: True  # hair is written when nobody edits it
    preferences.stroke_device = lambda: "GPU"
    started = time.perf_counter()
    hair = build(strands)
    window = Window(size)
    triangles = sum(len(polygon.vertices) - 2 for polygon in hair.data.surface.data.polygons)
    print(f"{gpu.platform.renderer_get()}, {gpu.platform.backend_type_get()}, {size[0]} × {size[1]}, ", end="")
    print(f"{triangles} triangles, scene in {time.perf_counter() - started:.0f} s; medians [ms]")
    print("shading    hair     action   evaluation   Blender    Vellus   together", flush=True)
    for shading in ("MATERIAL", "SOLID"):
        window.space.shading.type = shading
        window.space.shading.use_scene_lights = True
        for label in ("none", "once", "twice"):
            hidden_hair._may_hide_any = MAY_HIDE if label == "once" else lambda: False
            window.space.show_object_viewport_curves = label != "none"
            hidden_previews.follow()
            bpy.context.view_layer.update()
            viewport.invalidate()
            if shading == "SOLID" and label == "twice":
                continue  # Solid shading does not draw hair that Vellus draws
            for action in (turn, play, slide):
                if time.perf_counter() > started + options.limit:
                    return
                times = measure(window, hair, action, label != "none")
                shown = "".join(f"{value:11.1f}" for value in times)
                print(f"{shading.lower():10} {label:8} {action.__name__:8}{shown}", flush=True)
                if options.parts and label == "once":
                    print_parts(window, hair, action)
            if options.out:
                save(window.read(*size), options.out / f"{shading}_{label}.png".lower())


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing.
    os._exit(0)
