# SPDX-License-Identifier: GPL-3.0-or-later
"""Waiting times of users, for one checkout or alternating between several, to compare a change with its base.

    .venv/bin/python tests/support/comparison/timings.py
    .venv/bin/python tests/support/comparison/timings.py --checkouts ../before . --rounds 7

start         importing and registering the add-on in a running Blender: the additional time of its start
stroke        a few of 200 guides move, and Blender updates: 30,000 strands follow, and their Curves are written
regenerate    another random seed: 100,000 strands are placed, bound, grown and written
draw          one picture of 30,000 strands as scripts draw it, with its shadows

Prints medians [ms] over all rounds, of wall time and of the CPU time of all cores, which other programs affect less,
and for each further checkout the median ratio to the first one, round by round. A round runs a process for each
checkout in turn, in alternating order, and two that only start; a first round, which compiles kernels, does not
count. Only public names are used, so this file can time any checkout.
"""

import argparse
import importlib
import json
import math
import os
import subprocess
import sys
import time
from pathlib import Path

import bpy
import numpy as np

_STARTS = 2  # processes of a round that start and end, beside the one that measures everything


class Clock:
    """Times {name: [(wall time [s], CPU time of all cores [s])]}."""

    def __init__(self):
        self.found = {}

    def time(self, what, call, repetitions=1, spare=0):
        """Time calls one by one, except the first `spare` of them."""
        for repetition in range(spare + repetitions):
            started = time.perf_counter(), time.process_time()
            call()
            spent = time.perf_counter() - started[0], time.process_time() - started[1]
            if repetition >= spare:
                self.found.setdefault(what, []).append(spent)


# In a process of a checkout.


def measure(checkout, is_start_alone):
    """Return {what: [(clock, work)]} of a checkout's add-on."""
    sys.path.insert(0, str(checkout))
    clock = Clock()
    clock.time("start", lambda: importlib.import_module("hair_addon").register())
    if not is_start_alone:
        api = importlib.import_module("hair_addon.api")
        surface = scene(checkout)
        guides, hair = groom(api, surface)
        clock.time("stroke", lambda: comb(guides), 15, spare=2)
        clock.time("draw", lambda: api.draw(width=480, height=270, samples_per_side=1), 5, spare=1)
        hair.vellus.hair.strand_count = 100_000
        bpy.context.view_layer.update()
        clock.time("regenerate", lambda: regenerate(hair), 5, spare=1)
    return clock.found


def scene(checkout):
    """Return the sample head's object before a camera, in a sun's light."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.obj_import(filepath=str(checkout / "blend_samples" / "head.obj"))
    surface = bpy.context.selected_objects[0]
    surface.data.transform(surface.matrix_world)
    surface.matrix_world.identity()
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, -1.2, 0.75), (math.pi / 2, 0.0, 0.0)
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.rotation_euler = (0.8, 0.3, 0.0)
    for new in (camera, sun):
        bpy.context.scene.collection.objects.link(new)
    bpy.context.scene.camera = camera
    bpy.context.view_layer.update()
    return surface


def groom(api, surface):
    """Return Curves of 200 guides and of 30,000 strands."""
    settings = api.GroomSettings(api.GuideSettings(guide_count=200), api.HairSettings(strand_count=30_000))
    made = api.add_hair(surface, settings)
    bpy.context.view_layer.update()
    return made


def comb(guides):
    """Move eight neighboring guides, as one step of a brush."""
    points = np.empty((len(guides.points), 3), np.float32)
    guides.attributes["position"].data.foreach_get("vector", points.ravel())
    strands = points.reshape(len(guides.curves), -1, 3)
    near = np.linalg.norm(strands[:, 0] - strands[0, 0], axis=1).argsort()[:8]
    strands[near, 1:] += np.float32([0.0, 0.0, 1e-3])
    guides.attributes["position"].data.foreach_set("vector", points.ravel())
    guides.update_tag()
    bpy.context.view_layer.update()


def regenerate(hair):
    """Regenerate all strands with other roots."""
    hair.vellus.hair.seed += 1
    bpy.context.view_layer.update()


# Rounds.


def measured(checkout, *words):
    """Run `measure` in a separate process; returns its result."""
    command = [sys.executable, __file__, "--measure", str(checkout), *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    lines = done.stdout.splitlines()
    if done.returncode or not lines:
        sys.exit(f"{checkout} could not be timed:\n{done.stderr}")
    return json.loads(lines[-1])


def one_round(checkout):
    """Return {what: (clock, work)}, the medians of one round [s]."""
    found = measured(checkout)
    for _ in range(_STARTS):
        found["start"] += measured(checkout, "--start-alone")["start"]
    return {what: np.median(times, axis=0) for what, times in found.items()}


def report(checkouts, rounds):
    """Print a line for each measurement and checkout; rounds: [{checkout: {what: (clock, work)}}]."""
    for what in rounds[0][checkouts[0]]:
        print(what)
        first = np.array([found[checkouts[0]][what] for found in rounds])
        for checkout in checkouts:
            times = np.array([found[checkout][what] for found in rounds])
            clock, work = 1e3 * np.median(times, axis=0)
            parts = np.median(times / first, axis=0)
            beside = "" if checkout == checkouts[0] else f"   {parts[0]:5.2f} and {parts[1]:5.2f} of the first"
            print(f"  {clock:9.1f} ms, work {work:9.1f} ms{beside}   {checkout}")


def main():
    """Time checkouts in alternating order."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    own = Path(__file__).resolve().parents[3]
    parser.add_argument("--checkouts", type=Path, nargs="+", default=[own], metavar="FOLDER", help="[this one]")
    parser.add_argument("--rounds", type=int, default=4, metavar="N", help="[4]")
    parser.add_argument("--measure", type=Path, metavar="FOLDER", help=argparse.SUPPRESS)
    parser.add_argument("--start-alone", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.measure:
        print("\n" + json.dumps(measure(options.measure, options.start_alone)))
        return
    checkouts = [checkout.resolve() for checkout in options.checkouts]
    for checkout in checkouts:
        measured(checkout)
    orders = [checkouts, checkouts[::-1]]
    rounds = [{checkout: one_round(checkout) for checkout in orders[n % 2]} for n in range(options.rounds)]
    print(f"Medians of {options.rounds} rounds, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")
    report(checkouts, rounds)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing.
    os._exit(0)
