# SPDX-License-Identifier: GPL-3.0-or-later
"""Estimated times of work compared with measured ones, as ratios between sizes, in one run."""

import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import warp as wp

from hair_addon.core.geometry.mesh import TriMesh
from hair_addon.core.geometry.search import hash_grid
from hair_addon.core.grooming import cost, groom
from hair_addon.core.grooming.groom import GuideSettings, HairSettings
from tests.support.meshes import flat_grid
from tests.support.strands.hair import generate_hair

FACTOR = 3.0  # largest error of a ratio between two sizes


def hills(side_count):
    """Return an open square of hills with 2 side_count² triangles."""
    flat = flat_grid(side_count)
    vertices = flat.vertices.copy()
    vertices[:, 2] = 0.1 * np.sin(7.0 * vertices[:, 0]) * np.cos(5.0 * vertices[:, 1])
    return TriMesh(vertices, flat.triangles)


def seconds(work, repetitions=2):
    """Return the best time of several runs."""
    times = []
    for _ in range(repetitions):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def place(mesh, settings):
    """Place guides on a mesh without cached results of the last run."""
    return groom.distribute_guides(TriMesh(mesh.vertices, mesh.triangles), settings)


def assert_proportional(cases):
    """Assert that the quotients of measured and estimated values differ by at most the factor.

    cases: {what: (measured, estimated)}.
    """
    quotients = {what: measured / estimated for what, (measured, estimated) in cases.items()}
    for what, quotient in quotients.items():
        print(f"{what}: {cases[what][0]:.3f} s, {quotient:.2f} of the estimate")
    assert max(quotients.values()) <= FACTOR * min(quotients.values())


@pytest.mark.long
def test_placement_takes_the_estimated_time():
    place(hills(10), GuideSettings(guide_count=300))  # kernels are loaded
    cases = {}
    for side_count, guide_count in ((32, 1000), (32, 8000), (200, 1000), (350, 200), (350, 4000)):
        mesh, settings = hills(side_count), GuideSettings(guide_count=guide_count)
        face_count = len(mesh.triangles)
        measured = seconds(lambda mesh=mesh, settings=settings: place(mesh, settings))
        cases[f"{face_count} triangles, {guide_count} guides"] = measured, cost.guide_seconds(settings, face_count)
    assert_proportional(cases)


# In a process of its own, whose memory is the work's alone: its most, beside what it held before the work.
WORK = """
import json, sys, time
from pathlib import Path
sys.path.insert(0, ".")
from hair_addon.core.grooming import groom
from tests.benchmarks.test_estimates import hills, place
from tests.support.strands.hair import generate_hair

def most():  # not ru_maxrss, which a process inherits from the one that started it
    lines = Path("/proc/self/status").read_text().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith("VmHWM:"))

side_count, guide_count, strand_count = map(int, sys.argv[1:])
small = hills(20)
settings = groom.HairSettings(strand_count=strand_count)
generate_hair(small, place(small, groom.GuideSettings(guide_count=300)), groom.HairSettings(strand_count=100))
mesh = hills(side_count)
start, before = time.perf_counter(), most()
guides = place(mesh, groom.GuideSettings(guide_count=guide_count, relax_iterations=2))  # memory is of one
placed, placing = time.perf_counter(), most() - before
hair = generate_hair(mesh, guides, settings)
print(json.dumps({"seconds": [placed - start, time.perf_counter() - placed], "bytes": [placing, most() - before],
                  "counts": [len(guides), len(hair)]}))
"""


def worked(*counts):
    """Return the measured seconds, bytes and counts of placing and growing; counts: of side, guides and strands."""
    command = [sys.executable, "-W", "ignore", "-c", WORK, *map(str, counts)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=Path(__file__).parents[2])
    return json.loads(done.stdout.splitlines()[-1])


def assert_memory_is_as_said(side_count, guide_count, strand_count):
    found, face_count = worked(side_count, guide_count, strand_count), 2 * side_count**2
    reported = cost.guide_work_bytes(GuideSettings(guide_count=guide_count), face_count)
    reported = max(reported, cost.hair_work_bytes(HairSettings(strand_count=strand_count), face_count))
    took = found["bytes"][1]
    print(
        f"{face_count} triangles, {guide_count} guides, {strand_count} strands: {took / 1e6:.0f} MB, estimated "
        f"{reported / 1e6:.0f} MB; {found['seconds'][0]:.1f} s and {found['seconds'][1]:.1f} s"
    )
    assert found["counts"] == [guide_count, strand_count]
    assert reported / FACTOR < took < reported * FACTOR


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="no measure of a process's most memory")
@pytest.mark.parametrize(
    "counts", [pytest.param((400, 500, 1000), marks=pytest.mark.long), (30, 20_000, 1000), (30, 500, 200_000)]
)
def test_memory_equals_the_estimate(counts):
    assert_memory_is_as_said(*counts)


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="no measure of a process's most memory")
def test_two_million_triangles():
    """The estimates hold for 1,000 guides and 100,000 strands on two million triangles."""
    assert_memory_is_as_said(1000, 1000, 100_000)


@pytest.mark.long
def test_growth_takes_the_estimated_time():
    cases = {}
    for side_count, strand_count in ((32, 100_000), (32, 300_000), (350, 30_000), (350, 300_000)):
        mesh, settings = hills(side_count), HairSettings(strand_count=strand_count)
        guides = place(mesh, GuideSettings(guide_count=500, relax_iterations=0))
        face_count = len(mesh.triangles)

        def grow(mesh=mesh, guides=guides, settings=settings):
            return generate_hair(TriMesh(mesh.vertices, mesh.triangles), guides, settings)

        measured = seconds(grow)
        cases[f"{face_count} triangles, {strand_count} strands"] = measured, cost.hair_seconds(settings, face_count)
    assert_proportional(cases)


@pytest.mark.long
def test_time_goes_with_the_number_of_guides():
    """Ten times as many guides take at most thirty times as long; comparing all pairs would take a hundred times as
    long.
    """
    mesh = hills(30)
    few, many = (GuideSettings(guide_count=count, relax_iterations=1) for count in (6000, 60_000))
    assert seconds(lambda: place(mesh, many), 1) < 30.0 * seconds(lambda: place(mesh, few))


@pytest.mark.long
@pytest.mark.parametrize("count", [1, 3])
def test_a_lone_point_is_found_as_quickly_as_one_of_two(rng, count):
    queries = wp.array(rng.random((100_000, 3), dtype=np.float32), dtype=wp.vec3, device="cpu")

    def search(point_count):
        points = wp.array(np.tile(np.float32([0.5, 0.5, 0.5]), (point_count, 1)), dtype=wp.vec3, device="cpu")
        return seconds(lambda: hash_grid.neighbours(points, queries, 4.0, 1))

    pair = wp.array(np.float32([[0.2, 0.5, 0.5], [0.8, 0.5, 0.5]]), dtype=wp.vec3, device="cpu")
    assert search(count) < 4.0 * seconds(lambda: hash_grid.neighbours(pair, queries, 4.0, 1))
