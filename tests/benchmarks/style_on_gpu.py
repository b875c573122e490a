# SPDX-License-Identifier: GPL-3.0-or-later
"""Times of a GPU for styling strands, and its agreement with the processor.

    .venv/bin/python tests/benchmarks/style_on_gpu.py
    .venv/bin/python tests/benchmarks/style_on_gpu.py --strands 100000 --device cuda:0

Clump, Curl, Frizz and Braid on a million strands of 41 points: milliseconds a launch, beside copying the same memory.
The first thousands of strands are styled by the processor as well: the difference is printed as a part of the size.
"""

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import warp as wp

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from hair_addon.core.geometry.strands import segment_lengths
from hair_addon.core.styling import braid, clump, curl, frizz, steps
from hair_addon.core.styling import program as programs

STYLES = {
    "clump": (clump.Settings(levels=1),),
    "curl": (curl.Settings(),),
    "clump, curl": (clump.Settings(levels=1), curl.Settings()),
    "frizz": (frizz.Settings(),),
    "braid": (braid.Settings(),),  # its profile begins steeply at a point, where rounding shows first
    "all three": (clump.Settings(levels=1), curl.Settings(), frizz.Settings()),
}
STRANDS_A_LOCK = 60
AGREEMENT = 2e-6  # of the size


@dataclass(frozen=True)
class Hair:
    """Strands as arrays: points (S, P, 3), normals (S, 3), identities and locks (S,), centers (K, P, 3) [m]."""

    points: np.ndarray
    normals: np.ndarray
    identities: np.ndarray
    locks: np.ndarray
    centres: np.ndarray

    def first(self, count):
        """Some of the strands."""
        return Hair(
            self.points[:count], self.normals[:count], self.identities[:count], self.locks[:count], self.centres
        )

    def on(self, device):
        """Return (points, `StrandData`) on a device."""
        arcs = np.pad(np.cumsum(segment_lengths(self.centres), axis=1), ((0, 0), (1, 0)))
        count, centre_count = len(self.points), len(self.centres)

        def there(array, kind):
            return wp.array(np.ascontiguousarray(array), dtype=kind, device=device)

        data = steps.StrandData(
            there(self.normals, wp.vec3),
            there(self.identities, int),
            wp.empty((0, count), dtype=float, device=device),
            there(np.stack([self.locks, self.locks]), int),
            there(np.dstack([self.centres, arcs]).astype(np.float32), wp.vec4),
            there(np.tile(np.float32([0.0, 0.0, 1.0]), (2 * centre_count, 1)), wp.vec3),
            there(np.tile(np.arange(centre_count, dtype=np.int32), 2), int),
        )
        return there(self.points, wp.vec3), data


def hair(strand_count, point_count):
    """Return strands that rise and bend over, in locks."""
    rng = np.random.Generator(np.random.PCG64(1))
    lock_count = max(strand_count // STRANDS_A_LOCK, 1)
    locks = np.sort(rng.integers(0, lock_count, strand_count)).astype(np.int32)

    def grown(roots, bends):
        x = np.linspace(0.0, 1.0, point_count, dtype=np.float32)
        angle, length = bends[:, :1] * x, 0.2 * bends[:, 1:]
        path = np.cumsum(np.stack([np.sin(angle), 0.0 * angle, np.cos(angle)], axis=-1), axis=1) / point_count
        return (roots[:, None] + length[:, :, None] * (path - path[:, :1])).astype(np.float32)

    centres = np.pad(rng.uniform(-0.15, 0.15, (lock_count, 2)), ((0, 0), (0, 1)))
    bends = rng.uniform((1.0, 0.7), (2.5, 1.0), (lock_count, 2)).astype(np.float32)
    roots = centres[locks] + np.pad(rng.uniform(-0.006, 0.006, (strand_count, 2)), ((0, 0), (0, 1)))
    normals = np.tile(np.float32([0.0, 0.0, 1.0]), (strand_count, 1))
    identities = rng.integers(-(2**31), 2**31, strand_count).astype(np.int32)
    own = bends[locks] + rng.uniform(-0.05, 0.05, (strand_count, 2)).astype(np.float32)
    return Hair(grown(roots, own), normals, identities, locks, grown(centres, bends))


def program_of(styles, centre_count):
    """Return the `Program` of styles whose levels all have the same centers, with as many guides without points."""
    first_centres = [0] * len(programs.tree_levels(styles)) + [centre_count]
    return programs.compiled(programs.strand_steps(styles, {}), [], first_centres)


def best_time(work, device, repetitions=20):
    """Return the shortest time [s] of a call on a device, by the device's own clock if it has one."""
    work()
    times = []
    for _ in range(repetitions):
        with wp.ScopedTimer("work", print=False, synchronize=True, cuda_filter=0) as timer:
            work()
        times.append(timer.elapsed)
    return 1e-3 * min(times)


def main():
    """Print times and differences."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--strands", type=int, default=1_000_000, help="[1000000]")
    parser.add_argument("--points", type=int, default=41, help="a strand [41]")
    parser.add_argument("--compared", type=int, default=4000, help="strands that the processor styles as well [4000]")
    parser.add_argument("--device", default="cuda:0" if wp.get_cuda_devices() else "cpu")
    options = parser.parse_args()
    everything = hair(options.strands, options.points)
    points, data = everything.on(options.device)
    few = everything.first(options.compared)
    plain = wp.clone(points)
    size = np.ptp(few.points.reshape(-1, 3), axis=0).max()
    device = wp.get_device(options.device)
    print(f"{device.name or device}: {options.strands:,} strands of {options.points} points")
    copying = best_time(lambda: wp.copy(points, plain), device)
    print(f"  {'copying them':12} {1e3 * copying:8.3f} ms")
    axes = np.eye(4)
    for name, styles in STYLES.items():
        program = program_of(styles, len(everything.centres))
        time = best_time(lambda program=program: steps.apply_steps(points, program, data, axes), device)
        wp.copy(points, plain)
        steps.apply_steps(points, program, data, axes)
        there = points[: options.compared].numpy()
        here, own_data = few.on("cpu")
        steps.apply_steps(here, program, own_data, axes)
        difference = np.linalg.norm(here.numpy() - there, axis=2).max() / size
        verdict = "agrees" if difference < AGREEMENT else "DIFFERS"
        print(
            f"  {name:12} {1e3 * time:8.3f} ms, {time / copying:5.1f} copies; {verdict} ({difference:.1e} of the size)"
        )


if __name__ == "__main__":
    main()
