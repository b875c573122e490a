# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulated strands for tests, and their time steps."""

from dataclasses import replace

import numpy as np

from hair_addon.core.dynamics.rod import rod_solver, rotations
from hair_addon.core.dynamics.rod.material import material_of
from hair_addon.core.dynamics.rod.rods import Rods, combed_shape, step_of
from hair_addon.core.dynamics.rod.settings import DynamicsSettings
from tests.support.devices import DEVICE

FRAME = 1.0 / 24.0  # [s]
GRAVITY = (0.0, 0.0, -9.81)
SHEAR_MODULUS = 4.0 / 2.7  # [GPa] of an isotropic fiber with Poisson's ratio 0.35
FIBRE = DynamicsSettings(bend_stiffness=1.0, shear_modulus=SHEAR_MODULUS)
BENDING = 4e9 * np.pi * 4e-5**4 / 4.0  # EI of one fiber [N m²]
TWISTING = SHEAR_MODULUS * 1e9 * np.pi * 4e-5**4 / 2.0
LINE_MASS = 1300.0 * np.pi * 4e-5**2  # [kg/m]


def line(length, vertex_count, direction=(1.0, 0.0, 0.0)):
    """Return (1, N, 3): a straight strand from the origin."""
    direction = np.asarray(direction, float) / np.linalg.norm(direction)
    return (np.linspace(0.0, length, vertex_count)[:, None] * direction)[None]


def arc(radius, turns, vertex_count):
    """Return (1, N, 3): part of a level circle that leaves the origin along x and curves to y."""
    angle = np.linspace(0.0, 2.0 * np.pi * turns, vertex_count)
    return radius * np.stack([np.sin(angle), 1.0 - np.cos(angle), 0.0 * angle], axis=-1)[None]


def curl(length, vertex_count, turns=4.0, radius=0.006, fall=0.3):
    """Return (1, N, 3): a coil."""
    along = np.linspace(0.0, length, vertex_count)
    angle = 2.0 * np.pi * turns * along / length
    coil = [0.6 * along, radius * np.sin(angle), radius * (1.0 - np.cos(angle)) - fall * along]
    return np.stack(coil, axis=-1)[None]


class Simulation:
    """Strands that advance frame by frame; settings: of all strands; changes: of their material, {name: array}."""

    def __init__(self, groom, settings=FIBRE, substeps=4, gravity=GRAVITY, rest=None, device=DEVICE, **changes):
        self.groom = np.asarray(groom, float)
        combed = combed_shape(self.groom)
        self.rest = combed if rest is None else rest
        self.material = replace(material_of(settings, combed.lengths), **changes)
        self.rods = Rods(self.groom, self.material, self.rest, device)
        self.step = step_of(settings, self.material, FRAME, substeps, gravity)
        self.roots, self.turns = self.groom[:, 0], None

    def advance(self, frames=1, **details):
        """Simulate frames with fixed roots, or roots that end at `self.roots` and `self.turns`."""
        for _ in range(frames):
            self.rods.move_roots(self.roots, self.turns)
            self.rods.advance(self.step, **details)
        return self

    def substeps(self, count):
        """Return positions (count, S, N, 3) after each of `count` substeps with still roots."""
        step = replace(self.step, count=1)
        found = []
        for _ in range(count):
            self.rods.advance(step)
            found.append(self.rods.positions().astype(float))
        return np.array(found)

    def place(self, points, velocities=None):
        """Place strands (S, N, 3) out of rest, with frames rotated without twist."""
        state = self.rods.save()
        now = rotations.unit(np.diff(points, axis=1))
        then = rotations.unit(np.diff(self.groom, axis=1))
        frames = rotations.product(rotations.least_rotation(then, now), self.rest.frames)
        state["positions"] = np.asarray(points, np.float32).reshape(len(points), -1)
        state["frames"] = frames.astype(np.float32).reshape(len(points), -1)
        if velocities is not None:
            state["velocities"] = np.asarray(velocities, np.float32).reshape(len(points), -1)
        self.rods.load(state)
        return self

    @property
    def points(self):
        """Return (S, N, 3) float64 [m]."""
        return self.rods.positions().astype(float)

    @property
    def speed(self):
        """Return (S,) largest speed of each strand [m/s]."""
        return np.linalg.norm(self.rods.velocities(), axis=2).max(axis=1)


def in_lanes(values, device=DEVICE):
    """Return an array of `Surroundings` on a device from (S, points, numbers)."""
    return rod_solver.wp.array(rod_solver.to_lanes(values, rod_solver.lane_count(device)), dtype=float, device=device)
