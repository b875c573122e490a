# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/clump_beside_blender.png: clumped and curled hair by Blender's hair nodes, left, and by Vellus, right.

Both have the same strands, settings, light and renderer. Prints the processor time of one change of the curls' radius,
until Blender has evaluated the strands: the best of some, taken in turns.
"""

import os
import sys
import time
from pathlib import Path

import bpy
import gpu
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.heads import portrait
from blend_samples.pictures import styles
from blend_samples.sheets import picture_files
from hair_addon import api
from hair_addon.blender.data.strands import curves

OUT = Path(__file__).resolve().parents[2] / "docs" / "clump_beside_blender.png"
ASSETS = "/assets/nodes/procedural_hair_node_assets.blend"
STRAND_COUNT, POINT_COUNT = 20_000, 121
REPETITIONS = 4
SIZE, RADIUS, PITCH, SHAPE = 0.02, 0.0075, 0.036, 0.02


def main():
    """Draw both, time both, and write the picture."""
    hair_addon.register()
    gpu.init()
    hair = styles.build(STRAND_COUNT)
    hair_object = bpy.data.objects["Hair"]
    portrait.dress(hair_object.data.surface, portrait.AHEAD)
    clump = api.Clump(size=SIZE, levels=1, thickness=0.15, shape=SHAPE, crossover=0.0, stray=0.0)
    curl = api.Curl(radius=RADIUS, pitch=PITCH, coherence=1.0, seed=1)
    hair.vellus.hair.point_count = POINT_COUNT
    api.set_styles(hair, [clump, curl])
    bpy.context.view_layer.update()
    ours = styles.drawn()
    our_time = _best(lambda step: _curl_ours(hair, step))
    length = _mean_length(hair)
    api.set_styles(hair, [])
    bpy.context.view_layer.update()
    hair.vellus.is_live = False
    locks = {"Existing Guide Map": False, "Guide Distance": SIZE, "Shape": SHAPE, "Tip Spread": 0.001}
    _add(hair_object, "Clump Hair Curves", locks | {"Preserve Length": True})
    # The locks of Clump are the ones that curl alike.
    coils = {"Subdivision": 0, "Radius": RADIUS, "Frequency": length / PITCH}
    curled = _add(hair_object, "Curl Hair Curves", coils)
    bpy.context.view_layer.update()
    evaluated = hair_object.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    print(f"mean length {length:.3f} m, of Blender's nodes {_mean_length(evaluated):.3f} m")
    theirs = styles.drawn()
    their_time = _best(lambda step: _curl_theirs(hair_object, curled, step))
    print(f"Blender {1e3 * their_time:.0f} ms, Vellus {1e3 * our_time:.0f} ms: {their_time / our_time:.1f} times")
    pixels = picture_files.below_caption(np.concatenate([theirs, ours], axis=1))
    words = [
        ("Blender's nodes", 8, picture_files.BASELINE),
        ("Vellus", theirs.shape[1] + 8, picture_files.BASELINE),
    ]
    picture_files.write(pixels, OUT, words, picture_files.PAGE_BITS)


def _curl_ours(hair, step):
    hair.vellus.styles[1].curl.radius = RADIUS * (1.0 + 0.01 * (step % 2))
    bpy.context.view_layer.update()


def _curl_theirs(hair_object, modifier, step):
    _set(modifier, "Radius", RADIUS * (1.0 + 0.01 * (step % 2)))
    hair_object.update_tag()
    bpy.context.view_layer.update()


def _best(work):
    """Least processor time [s] of one call, after one that warms up."""
    times = []
    for step in range(1, REPETITIONS + 2):
        started = time.process_time()
        work(step)
        times.append(time.process_time() - started)
    print([round(1e3 * t) for t in times])
    return min(times[1:])


def _add(hair_object, name, inputs):
    """Add a modifier of one of Blender's hair assets."""
    with bpy.data.libraries.load(bpy.utils.system_resource("DATAFILES") + ASSETS, link=False) as (_there, here):
        here.node_groups = [name]
    modifier = hair_object.modifiers.new(name, "NODES")
    modifier.node_group = here.node_groups[0]
    for label, value in inputs.items():
        _set(modifier, label, value)
    return modifier


def _set(modifier, label, value):
    sockets = modifier.node_group.interface.items_tree
    inputs = [s for s in sockets if getattr(s, "in_out", "") == "INPUT" and s.name == label]
    getattr(modifier.properties.inputs, inputs[0].identifier).value = value


def _mean_length(hair):
    """Mean length [m] of strands."""
    points = curves.read_points(hair).reshape(len(hair.curves), -1, 3)
    return float(np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1).mean())


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing; all files are closed by now.
    os._exit(0)
