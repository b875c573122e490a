# SPDX-License-Identifier: GPL-3.0-or-later
"""Times of a GPU for simulating a frame of guides, free and on a deforming body.

    .venv/bin/python tests/benchmarks/dynamics_on_gpu.py
    .venv/bin/python tests/benchmarks/dynamics_on_gpu.py --strands 1000 --device cpu

Strands of 15 cm and 32 points in frames of 1/24 s and 8 substeps. Free: their roots are shaken. On a body: a ball of
20,000 triangles with strands all over, which bulges and turns, with hair volume and without. Milliseconds a frame on
the clock, the shortest, the median and the mean; where roots and the body go is found before it starts. Last, the
largest stretch of a segment.
"""

import argparse
import sys
import time
from pathlib import Path

import numpy as np
import warp as wp
from scipy.spatial import ConvexHull

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from hair_addon.core.dynamics import root_motion, simulation
from hair_addon.core.dynamics.rod import rotations
from hair_addon.core.dynamics.rod.settings import DynamicsSettings
from tests.support.dynamics import rods

POINTS, LENGTH, SUBSTEPS = 32, 0.15, 8
RADIUS = 0.1  # [m] of the ball
TRIANGLES = 20_000


def measured(name, way, device, frames):
    """Print the times of frames."""
    for _ in range(4):
        way.prepare()
        way.advance()
    times = []
    for _ in range(frames):
        way.prepare()
        wp.synchronize_device(device)
        start = time.perf_counter()
        way.advance()
        wp.synchronize_device(device)
        times.append(1e3 * (time.perf_counter() - start))
    found = f"{min(times):8.2f} ms, median {np.median(times):8.2f} ms, mean {np.mean(times):8.2f} ms"
    print(f"  {name:34} {found}; stretch {way.stretch():.1e}")


class Free:
    """Level strands whose roots are shaken, without other forces."""

    def __init__(self, count, device):
        roots = np.random.default_rng(0).normal(scale=0.05, size=(count, 1, 3))
        groom = rods.line(LENGTH, POINTS) + roots
        self.simulation = rods.Simulation(groom, substeps=SUBSTEPS, device=device)
        self.frame = 0

    def prepare(self):
        """Find the positions of the roots in the next frame."""
        self.frame += 1
        way = 0.02 * np.sin(2.0 * np.pi * rods.FRAME * self.frame)
        self.simulation.roots = self.simulation.groom[:, 0] + [way, 0.0, 0.0]

    def advance(self):
        """Simulate the next frame."""
        self.simulation.advance()

    def stretch(self):
        """Return the largest stretch of a segment."""
        return abs(self.simulation.rods.stretch()).max()


def ball():
    """Return (directions (V, 3), triangles (F, 3) int32) of a ball with triangles of nearly equal size."""
    count = TRIANGLES // 2 + 2
    height = 1.0 - (2.0 * np.arange(count) + 1.0) / count  # a spiral that is even in area
    angle = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    flat = np.sqrt(1.0 - height**2)
    directions = np.stack([flat * np.cos(angle), flat * np.sin(angle), height], axis=-1)
    triangles = ConvexHull(directions).simplices
    a, b, c = np.moveaxis(directions[triangles], 1, 0)
    is_inward = np.einsum("fc,fc->f", np.cross(b - a, c - a), a) < 0.0
    triangles[is_inward] = triangles[is_inward][:, ::-1]
    return directions, triangles.astype(np.int32)


class OnBody:
    """Strands on all sides of a ball that bulges and turns, with or without friction and pressure between hairs."""

    def __init__(self, count, device, volume):
        rng = np.random.default_rng(0)
        directions, self.triangles = ball()
        self.vertices = RADIUS * directions
        out = rng.normal(size=(count, 3))
        self.out = out / np.linalg.norm(out, axis=1, keepdims=True)
        along = np.linspace(0.0, LENGTH, POINTS)[:, None]
        groom = (RADIUS + 5e-4 + along) * self.out[:, None]
        settings = DynamicsSettings(
            hair_friction=volume, hair_pressure=volume, automatic_substeps=False, substeps=SUBSTEPS
        )
        self.frame = 0
        pose, world = self._now()
        self.simulation = simulation.Simulation(groom, settings, pose, world, device)

    def _now(self):
        """Return (pose of the roots, world) of the current frame."""
        swing = np.sin(2.0 * np.pi * 1.5 * rods.FRAME * self.frame)
        turn = np.array([0.0, 0.0, np.sin(0.25 * swing), np.cos(0.25 * swing)])

        def there(points):
            bulge = 1.0 + 0.05 * swing * points[:, 2:] / RADIUS
            return rotations.rotated(turn, points * bulge)

        pose = root_motion.RootPose(there((RADIUS + 5e-4) * self.out), np.tile(turn, (len(self.out), 1)))
        body = simulation.Obstacle("Body", there(self.vertices), self.triangles)
        return pose, simulation.World(obstacles=(body,))

    def prepare(self):
        """Find the positions of the roots and of the body in the next frame."""
        self.frame += 1
        self.next = self._now()

    def advance(self):
        """Simulate the next frame."""
        self.simulation.advance(*self.next, rods.FRAME)

    def stretch(self):
        """Return the largest stretch of a segment."""
        return abs(self.simulation.stretch()).max()


def main():
    """Print times."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--strands", type=int, nargs="+", default=[10_000, 100_000], help="[10000 100000]")
    parser.add_argument("--free", action="store_true", help="without the body, which takes long to begin with 100,000")
    parser.add_argument("--frames", type=int, default=24, help="[24]")
    parser.add_argument("--device", default="cuda:0" if wp.get_cuda_devices() else "cpu")
    options = parser.parse_args()
    device = wp.get_device(options.device)
    for count in options.strands:
        print(f"{device.name or device}: {count:,} strands of {POINTS} points, {SUBSTEPS} substeps")
        ways = {
            "free": lambda count=count: Free(count, device),
            "on a body of 20,000 triangles": lambda count=count: OnBody(count, device, 0.0),
            "on that body, hair among hair": lambda count=count: OnBody(count, device, 0.1),
        }
        for name in ["free"] if options.free else ways:
            way = ways[name]()
            measured(name, way, device, options.frames)


if __name__ == "__main__":
    main()
