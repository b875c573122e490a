# SPDX-License-Identifier: GPL-3.0-or-later
"""Processor time of viewports for hair with modifiers of the artist, in multiples of Blender's own evaluation.

.venv/bin/python tests/benchmarks/viewports/own_modifiers.py --strands 100000

Blender evaluates the hair of the sample head again, at rest or on a bending surface, and Vellus reads and uploads the
result. With a software driver uploads are processor time too.
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

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

import hair_addon
from blend_samples.heads import head
from hair_addon.blender.host import running
from hair_addon.blender.live import live_hair
from hair_addon.blender.render import modified_hair
from tests.benchmarks.edit_guides import bend
from tests.blender.ui.test_own_modifiers import add_asset

CHANGES, STARTS = 9, 2


def add_offset(hair):
    """Add a minimal modifier: one node that moves all points alike."""
    tree = bpy.data.node_groups.new("Offset", "GeometryNodeTree")
    for side in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=side, socket_type="NodeSocketGeometry")
    first, last, moved = (tree.nodes.new(kind) for kind in ("NodeGroupInput", "NodeGroupOutput", _MOVING))
    moved.inputs["Offset"].default_value = 0.01, 0.0, 0.0
    tree.links.new(first.outputs[0], moved.inputs[0])
    tree.links.new(moved.outputs[0], last.inputs[0])
    hair.modifiers.new("Offset", "NODES").node_group = tree


_MOVING = "GeometryNodeSetPosition"
MODIFIERS = {
    "one node": add_offset,
    "Curl Hair Curves": lambda hair: add_asset(hair, "Curl Hair Curves"),
    "Clump Hair Curves": lambda hair: add_asset(hair, "Clump Hair Curves"),
}


def measure(hair, change):
    """Return (Blender's, our) median processor time of a change [s]."""
    found = []
    for turn in range(STARTS + CHANGES):
        change(turn)
        started = time.process_time()
        bpy.context.view_layer.update()
        depsgraph = bpy.context.evaluated_depsgraph_get()
        evaluated = time.process_time()
        modified_hair.invalidate(hair)
        modified_hair.strands_on_gpu(hair, depsgraph)
        found.append((evaluated - started, time.process_time() - evaluated))
    return np.median(found[STARTS:], axis=0)


def main():
    """Print a row for each modifier."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--strands", type=int, default=100_000)
    options = parser.parse_args()
    hair_addon.register()
    gpu.init()
    wp.config.log_level = wp.LOG_WARNING
    running.has_window = lambda: True  # as while an artist works
    for name, add in MODIFIERS.items():
        _guides, hair = head.grow(head.build(), guide_count=500, strand_count=options.strands)
        live_hair.write_all()
        add(hair)
        bend(hair.data.surface, 0)
        key = hair.data.surface.data.shape_keys.key_blocks["Bent"]
        for how, change in (
            ("at rest", lambda _turn, hair=hair: hair.data.update_tag()),
            ("bending", lambda turn, key=key: setattr(key, "value", 0.2 + 0.05 * turn)),
        ):
            theirs, ours = measure(hair, change)
            times = f"Blender {1e3 * theirs:7.1f} ms, Vellus {1e3 * ours:6.1f} ms"
            print(f"{name:18} {how:8} {times}, together {1.0 + ours / theirs:.3f}", flush=True)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing.
    os._exit(0)
