# SPDX-License-Identifier: GPL-3.0-or-later
"""Times from a change of hair to the finished picture, by stage, on the sample head: milliseconds.

.venv/bin/python tests/benchmarks/edit_guides.py --strands 30000 100000

Guides are combed, a slider of their weights or of a style moves, the surface bends with the frames or by a slider,
simulated guides play, or a brush paints the image of maps. Hair is shaded by the Marschner model with shadows, as a
viewport draws meanwhile. Strands are made by the compute device and uploaded, or made where they are drawn; the bytes
that a change uploads are counted.
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

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.heads import head
from hair_addon.blender.data.strands import curves
from hair_addon.blender.gpu.shadows import ShadowMaps
from hair_addon.blender.gpu.strands import device_choice, strand_maker
from hair_addon.blender.groom import bindings
from hair_addon.blender.host import running, scene_time
from hair_addon.blender.live import live_hair
from hair_addon.blender.render import drawn_scene, hair_cache
from hair_addon.blender.settings import map_items, preferences, style_items
from hair_addon.core.maps.map_settings import MapSettings
from hair_addon.core.styling.kinds import KINDS
from tests.benchmarks.draw_frames import Frame
from tests.support.counting import Traffic
from tests.support.pictures import drawn_strands

REPETITIONS = 50
IMAGE_SIZE = 2048  # of painted images
ACTIONS = ("stroke", "slider", "surface", "bending", "playback", "paint")
_OF_SURFACE = {"surface", "bending"}

# Parts that are timed and waited for one by one; the remaining time is the host's.
PARTS = {
    "guides' upload": (strand_maker.StrandMaker, "put_guides"),
    "strands": (hair_cache, "strands_on_gpu"),
    "surfaces": (drawn_scene.drawn_meshes, "read_drawn_meshes"),
    "pose": (hair_cache, "_pose_of"),
    "shadows": (ShadowMaps, "draw"),
    "visibility": (drawn_scene, "_renewed"),
    "all of it": (drawn_scene, "visibility"),
    "drawing": (Frame, "draw"),
}
_WITHIN = {"guides' upload": "strands", "pose": "strands"}
_NESTED = {"shadows": ("visibility", "all of it")}  # both draw their own maps


class Editing:
    """Hair of the sample head that is changed, and all work until it is drawn."""

    def __init__(self, guides, hair, frame, share):
        self.guides, self.hair, self.frame = guides.data, hair.data, frame
        self.points = curves.read_points(self.guides).reshape(len(guides.data.curves), -1, 3)
        self.combed = slice(0, max(1, int(share * len(self.points))))
        self.turn = 0
        self.drawn = self.read()
        self.stroke()
        self.drawn = self.read()  # bound now
        hair_cache.choose_makers()
        while hair_cache.prepare_makers():
            pass

    def read(self, **details):
        """Return the `DrawnScene` as a viewport reads it."""
        context, areas = bpy.context, bpy.context.window_manager.windows[0].screen.areas
        viewport = next(area.spaces.active for area in areas if area.type == "VIEW_3D")
        depsgraph = context.evaluated_depsgraph_get()
        return drawn_scene.read(context.scene, context.view_layer, depsgraph, viewport, **details)

    def stroke(self):
        """Follow guides that were combed back or forth."""
        self._combed()
        depsgraph = bpy.context.evaluated_depsgraph_get()
        live_hair.follow_guides(self.hair, depsgraph, self.points.reshape(-1, 3))

    def slider(self):
        """Change a slider: the preserved length of plain hair, or the amount of the last style of styled hair."""
        self.turn += 1
        if len(self.hair.vellus.styles):
            style_items.group_of(self.hair.vellus.styles[-1]).amount = 0.9 if self.turn % 2 else 0.8
        else:
            self.hair.vellus.hair.keep_length = 0.9 if self.turn % 2 else 0.8
        bpy.context.view_layer.update()

    def surface(self):
        """Show the next frame of a surface that bends while the animation plays."""
        self.turn += 1
        self.evaluate(lambda: bpy.context.scene.frame_set(self.turn))

    def bending(self):
        """Bend the surface by a slider."""
        self.turn += 1
        key = self.hair.surface.data.shape_keys.key_blocks["Bent"]
        key.value = 0.2 + 0.1 * (self.turn % 8)
        self.evaluate(bpy.context.view_layer.update)

    def evaluate(self, work):
        """Let Blender evaluate the scene, and handlers follow."""
        work()

    def paint(self):
        """End a stroke of a brush of 512 × 512 texels on the image of maps."""
        self.turn += 1
        self.brush(bpy.data.images["Coat"])
        self.evaluate(bpy.context.view_layer.update)

    def brush(self, image):
        """Change an image as a brush does; a brush costs Blender less time."""
        pixels = np.empty(IMAGE_SIZE * IMAGE_SIZE * 4, np.float32)
        image.pixels.foreach_get(pixels)
        low, left = 512 * (self.turn // 4 % (IMAGE_SIZE // 512)), 512 * (self.turn % (IMAGE_SIZE // 512))
        pixels.reshape(IMAGE_SIZE, IMAGE_SIZE, 4)[low : low + 512, left : left + 512, :3] = 0.1 + 0.1 * (self.turn % 5)
        image.pixels.foreach_set(pixels)
        image.update_tag()

    def playback(self):
        """Show guides at their simulated points of the next frame."""
        self._combed()
        live_hair.show_guides(self.guides, self.points, bpy.context.evaluated_depsgraph_get())

    def _combed(self):
        self.turn += 1
        along = np.linspace(0.0, 1.0, self.points.shape[1], dtype=np.float32)[:, None]
        self.points = self.points.copy()  # those before are what hair has followed
        self.points[self.combed] += along * np.float32([0.0, 1e-3, 0.0]) * (1 if self.turn % 2 else -1)

    def once(self, action):
        """Make a change and draw the finished picture."""
        getattr(self, action)()
        is_played, is_hair_only = action in {*_OF_SURFACE, "playback"}, action not in _OF_SURFACE
        self.drawn = self.read(
            before=self.drawn if is_hair_only else None,
            former=self.drawn if is_played else None,
            is_draft=is_hair_only,
        )
        self.frame.draw(self.drawn)
        hair_cache.choose_makers()

    def parts(self, action):
        """Return {part: milliseconds} of one change; each part is timed until it has ended."""
        found, real = dict.fromkeys(PARTS, 0.0), {part: getattr(*where) for part, where in PARTS.items()}
        running_parts = []

        def timed(part):
            def call(*given, **named):
                if set(running_parts) & set(_NESTED.get(part, ())):
                    return real[part](*given, **named)
                self.frame.wait()
                started = time.perf_counter()
                running_parts.append(part)
                result = real[part](*given, **named)
                running_parts.pop()
                self.frame.wait()
                found[part] += 1e3 * (time.perf_counter() - started)
                return result

            return call

        for part, (owner, name) in PARTS.items():
            setattr(owner, name, timed(part))
        try:
            started = time.perf_counter()
            self.once(action)
            whole = 1e3 * (time.perf_counter() - started)
        finally:
            for part, (owner, name) in PARTS.items():
                setattr(owner, name, real[part])
        for part, outer in _WITHIN.items():
            found[outer] -= found[part]
        return found | {"host": whole - sum(found.values())}


PARTS["evaluation"] = (Editing, "evaluate")
PARTS["brush"] = (Editing, "brush")


def give_maps(hair, settings):
    """Give settings of the look maps of one image; a material shows the image, as while it is painted."""
    image = bpy.data.images.new("Coat", IMAGE_SIZE, IMAGE_SIZE, alpha=True)
    image.pixels.foreach_set(np.tile(np.float32([0.3, 0.15, 0.05, 1.0]), IMAGE_SIZE * IMAGE_SIZE))
    material = bpy.data.materials.new("Painted")
    material.node_tree.nodes.new("ShaderNodeTexImage").image = image
    hair.data.surface.data.materials.append(material)
    hair.data.vellus.appearance.parametrization = "COLOR"
    for setting in settings:
        map_items.keep(hair.data.vellus, MapSettings(setting=setting, source="Coat"))
    bpy.context.view_layer.update()
    if hair.data.vellus.shading_status:
        raise SystemExit(hair.data.vellus.shading_status)


def bend(surface, frames):
    """Let a surface bend to and fro by a shape key, with keyframes unless `frames` is 0."""
    surface.shape_key_add(name="Basis")
    key = surface.shape_key_add(name="Bent")
    places = np.empty(3 * len(key.data), np.float32)
    key.data.foreach_get("co", places)
    places = places.reshape(-1, 3)
    places += 0.01 * np.sin(20.0 * places[:, [1, 2, 0]])
    key.data.foreach_set("co", places.ravel())
    for frame in range(0, frames, 10):
        key.value = 0.2 + 0.8 * (frame // 10 % 2)
        key.keyframe_insert("value", frame=frame)


def measure(editing, action, repetitions):
    """Return (median time of a change [ms], quartiles, {part: median}, bytes uploaded by a change)."""
    totals = []
    for _ in range(repetitions + 3):
        started = time.perf_counter()
        editing.once(action)
        totals.append(1e3 * (time.perf_counter() - started))
    found = [editing.parts(action) for _ in range(max(3, repetitions // 3))]
    parts = {part: float(np.median([one[part] for one in found])) for part in found[0]}
    with Traffic() as traffic:
        editing.once(action)
    return np.percentile(totals[3:], [50, 25, 75]), parts, traffic.sent


def main():
    """Print a row for each number of strands and each way."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--strands", type=int, nargs="+", default=[30_000, 100_000, 1_000_000])
    parser.add_argument("--guides", type=int, default=4000)
    parser.add_argument("--share", type=float, nargs="+", default=[1.0, 0.03], help="part of the guides that is combed")
    parser.add_argument("--size", type=int, nargs=2, default=[1920, 1080], metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--styles", nargs="+", default=[], choices=sorted(KINDS), help="that the hair has")
    parser.add_argument("--actions", nargs="+", default=ACTIONS, choices=ACTIONS)
    parser.add_argument("--maps", nargs="*", default=["look.color"], help="settings with a map, for painting")
    parser.add_argument("--ways", nargs="+", default=["COMPUTE", "GPU"], help="where strands are made")
    parser.add_argument("--devices", nargs="+", default=["cpu"], help="Warp devices of the way by uploads")
    parser.add_argument("--repetitions", type=int, default=REPETITIONS)
    parser.add_argument(
        "--profile", type=int, default=0, metavar="LINES", help="also print what takes most on the host"
    )
    options = parser.parse_args()
    hair_addon.register()
    gpu.init()
    wp.config.log_level = wp.LOG_WARNING
    running.has_window = lambda: True  # hair is written when nobody edits it
    print(
        "{} × {}, {} guides, on {}, {}, median (quartiles) [ms]".format(
            *options.size, options.guides, gpu.platform.renderer_get(), gpu.platform.backend_type_get()
        )
    )
    makes, uploads = device_choice.times()
    print(f"measured once: made in {1e3 * makes:.2f} ms, uploaded in {1e3 * uploads:.2f} ms")
    for strand_count in options.strands:
        for device in options.devices:
            _measure_ways(options, strand_count, device)


def _measure_ways(options, strand_count, device):
    for action in options.actions:
        for share in options.share if action == "stroke" else (1.0,):
            for way in options.ways:
                if way == "COMPUTE" or device == options.devices[0]:
                    _measure_way(options, strand_count, device, action, share, way)


def _measure_way(options, strand_count, device, action, share, way):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    preferences.device, preferences.stroke_device = (lambda: device), (lambda: way)
    built = head.build()
    guides, hair = head.grow(built, guide_count=options.guides, strand_count=strand_count)
    for kind in options.styles:
        style_items.add(hair.data.vellus, KINDS[kind]())
    bpy.context.view_layer.update()
    live_hair.write_all()
    head.light()
    if action == "paint":
        give_maps(hair, options.maps)
    if action in _OF_SURFACE:
        bend(hair.data.surface, 4 * options.repetitions if action == "surface" else 0)
    scene_time.is_shown_moving = lambda: action == "surface"
    bpy.context.view_layer.update()
    frame = Frame(*options.size, 1)
    editing = Editing(guides, hair, frame, share)
    assert hair_cache.may_make(hair.data.session_uid) == (way == "GPU")
    few = options.repetitions if way == "GPU" or strand_count <= 200_000 else options.repetitions // 5
    (median, low, high), parts, sent = measure(editing, action, few)
    shown = "  ".join(f"{part} {value:.2f}" for part, value in parts.items() if value)
    print(
        f"{strand_count:8} strands  {action:8} {share:4.0%} of guides  {way:7} {device:6} {median:8.2f} "
        f"({low:.2f} to {high:.2f})   {shown}   sent {sent / 1e6:.2f} MB",
        flush=True,
    )
    if options.profile:
        _print_profile(editing, action, options.profile)
    if action not in _OF_SURFACE:
        _print_error(hair)


def _print_profile(editing, action, line_count):
    """Print the Python functions that take the most time in twenty changes."""
    profile = cProfile.Profile()
    profile.enable()
    for _ in range(20):
        editing.once(action)
    editing.frame.wait()
    profile.disable()
    for order in ("tottime", "cumulative"):
        pstats.Stats(profile).strip_dirs().sort_stats(order).print_stats(line_count)


def _print_error(hair):
    """Print the largest difference between drawn and later written points, relative to a strand's length."""
    on_gpu = hair_cache.strands_on_gpu(hair.data)
    if on_gpu.strand_count > 200_000:
        live_hair.write_all()
        return
    places = drawn_strands.places(on_gpu)
    started = time.perf_counter()
    live_hair.write_all()
    points = bindings.of(hair.data).points
    written = 1e3 * (time.perf_counter() - started)
    error = np.linalg.norm(places - points, axis=2).max(axis=1)
    lengths = np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1)
    print(
        f"         drawn and written differ by {np.max(error / lengths):.1e} of a length; written in {written:.0f} ms"
    )


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing.
    os._exit(0)
