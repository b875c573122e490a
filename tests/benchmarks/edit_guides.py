# SPDX-License-Identifier: GPL-3.0-or-later
"""What an edit of guides costs until the picture is finished: milliseconds of its parts, on the sample head.

.venv/bin/python tests/benchmarks/edit_guides.py --strands 30000 100000

Shaded by the Marschner model with shadows, as a viewport draws while guides are combed. Strands are made by the compute
device and uploaded, or made where they are drawn; the bytes that an edit uploads and reads back are counted.
"""

import argparse
import os
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
from hair_addon.blender.data import curves
from hair_addon.blender.gpu import maker_choice
from hair_addon.blender.groom import bindings
from hair_addon.blender.host import running
from hair_addon.blender.live import live_hair
from hair_addon.blender.render import drawn_scene, hair_cache
from hair_addon.blender.settings import preferences
from tests.benchmarks.draw_frames import Frame

REPETITIONS = 50
PARTS = ("host", "strands", "read, shadows", "drawing")


class Editing:
    """Guides of the sample head that are combed, with what follows until its hair is drawn."""

    def __init__(self, guides, hair, frame, share):
        self.guides, self.hair, self.frame = guides.data, hair.data, frame
        self.points = curves.read_points(self.guides).reshape(len(guides.data.curves), -1, 3)
        self.combed = slice(0, max(1, int(share * len(self.points))))
        self.turn = 0
        self.drawn = self.read(None)
        self.edit()
        self.drawn = self.read(None)  # bound now
        hair_cache.choose_makers()

    def read(self, before):
        """The `DrawnScene` as a viewport reads it."""
        context = bpy.context
        depsgraph = context.evaluated_depsgraph_get()
        return drawn_scene.read(
            context.scene, context.view_layer, depsgraph, before=before, is_draft=before is not None
        )

    def edit(self):
        """Follow guides that were combed back or forth."""
        self.turn += 1
        along = np.linspace(0.0, 1.0, self.points.shape[1], dtype=np.float32)[:, None]
        self.points = self.points.copy()  # those before are what hair has followed
        self.points[self.combed] += along * np.float32([0.0, 1e-3, 0.0]) * (1 if self.turn % 2 else -1)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        live_hair.follow_guides(self.hair, depsgraph, self.points.reshape(-1, 3))

    def once(self):
        """One edit to the finished picture."""
        self.edit()
        self.drawn = self.read(self.drawn)
        self.frame.draw(self.drawn)

    def parts(self):
        """Milliseconds of `PARTS` of one edit, each waited for."""
        times = [time.perf_counter()]

        def waited():
            self.frame.wait()
            times.append(time.perf_counter())

        self.edit()
        waited()
        hair_cache.strands_on_gpu(self.hair)
        waited()
        self.drawn = self.read(self.drawn)
        waited()
        self.frame.draw(self.drawn)
        times.append(time.perf_counter())
        return 1e3 * np.diff(times)


class Traffic:
    """Bytes that go to textures and come back while this is entered."""

    def __enter__(self):
        self.sent, self._buffer = 0, gpu.types.Buffer

        def buffer(kind, size, values):
            self.sent += int(np.prod(size)) * (1 if kind == "UBYTE" else 4)
            return self._buffer(kind, size, values)

        gpu.types.Buffer = buffer
        return self

    def __exit__(self, *_error):
        gpu.types.Buffer = self._buffer


def measure(editing, repetitions):
    """(median of one edit [ms], quartiles, medians of `PARTS`, bytes uploaded by one edit)."""
    totals = []
    for _ in range(repetitions + 2):
        started = time.perf_counter()
        editing.once()
        totals.append(1e3 * (time.perf_counter() - started))
    parts = np.median([editing.parts() for _ in range(max(3, repetitions // 3))], axis=0)
    with Traffic() as traffic:
        editing.once()
    return np.percentile(totals[2:], [50, 25, 75]), parts, traffic.sent


def main():
    """Print a row for each number of strands and each way."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--strands", type=int, nargs="+", default=[30_000, 100_000, 1_000_000])
    parser.add_argument("--guides", type=int, default=4000)
    parser.add_argument("--share", type=float, nargs="+", default=[1.0, 0.03], help="part of the guides that is combed")
    parser.add_argument("--size", type=int, nargs=2, default=[1920, 1080], metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--devices", nargs="+", default=["cpu"], help="Warp devices of the way by uploads")
    parser.add_argument("--repetitions", type=int, default=REPETITIONS)
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
    makes, uploads = maker_choice.times()
    print(f"measured once: made in {1e3 * makes:.2f} ms, uploaded in {1e3 * uploads:.2f} ms")
    for strand_count in options.strands:
        for device in options.devices:
            _measure_ways(options, strand_count, device)


def _measure_ways(options, strand_count, device):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    preferences.device = lambda: device
    built = head.build()
    guides, hair = head.grow(built, guide_count=options.guides, strand_count=strand_count)
    live_hair.write_all()
    head.light()
    bpy.context.view_layer.update()
    frame = Frame(*options.size, 1)
    for share in options.share:
        for way in ("COMPUTE", "GPU"):
            if way == "GPU" and device != options.devices[0]:
                continue  # it does not compute there
            preferences.stroke_device = lambda way=way: way
            hair_cache.strand_cache.clear()
            editing = Editing(guides, hair, frame, share)
            assert hair_cache.may_make(hair.data.session_uid) == (way == "GPU")
            few = options.repetitions if way == "GPU" or strand_count <= 200_000 else options.repetitions // 5
            (median, low, high), parts, sent = measure(editing, few)
            shown = "  ".join(f"{name} {part:7.2f}" for name, part in zip(PARTS, parts, strict=True))
            print(
                f"{strand_count:8} strands  {share:4.0%} of guides  {way:7} {device:6} {median:8.2f} "
                f"({low:.2f} to {high:.2f})   {shown}   sent {sent / 1e6:.2f} MB",
                flush=True,
            )
            _print_error(hair)


def _print_error(hair):
    """The greatest difference of what is drawn from what is written afterwards, in parts of a strand's length."""
    on_gpu = hair_cache.strands_on_gpu(hair.data)
    if on_gpu.strand_count > 200_000:
        live_hair.write_all()
        return
    texels = np.array(on_gpu.texture.read(), np.float32).reshape(on_gpu.texture.height, on_gpu.texture.width, 4)
    texels = texels[:, : on_gpu.row_strands * on_gpu.point_count].reshape(-1, on_gpu.point_count, 4)
    started = time.perf_counter()
    live_hair.write_all()
    points = bindings.of(hair.data).points
    written = 1e3 * (time.perf_counter() - started)
    error = np.linalg.norm(texels[: len(points), :, :3] - points, axis=2).max(axis=1)
    lengths = np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1)
    print(
        f"         drawn and written differ by {np.max(error / lengths):.1e} of a length; written in {written:.0f} ms"
    )


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing.
    os._exit(0)
