# SPDX-License-Identifier: GPL-3.0-or-later
"""Moving strands have the right periods, damping, momentum, energy and length, and first-order errors in time."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import j0

from hair_addon.core.dynamics.rod.rotations import IDENTITY, inverse, product
from tests.support.dynamics.rods import BENDING, FIBRE, FRAME, GRAVITY, LINE_MASS, Simulation, curl, line

FREE = replace(FIBRE, air_drag=0.0, damping=0.0)  # nothing brakes it
LIMP = replace(FREE, bend_stiffness=1e-3, youngs_modulus=4e-2, stretch_stiffness=1.0)


def periods(signal, size):
    """Return the periods between falling zeros of a signal that is sampled in steps of a size [s]."""
    falls = np.flatnonzero((signal[:-1] > 0.0) & (signal[1:] <= 0.0))
    return np.diff(size * (falls + signal[falls] / (signal[falls] - signal[falls + 1])))


@pytest.mark.gate(id="V2")
@pytest.mark.parametrize("substeps", [2, 8])
def test_a_hanging_chain_swings_in_its_first_mode(substeps):
    """A hanging chain swings in its mode x = J₀(2.4048 √(z / L)), ω = 1.2024 √(g / L), damped by exp(-ω² h t / 2)."""
    length = 0.2
    groom = line(length, 25, (0.0, 0.0, -1.0))
    swung = groom.copy()
    swung[..., 0] = 0.02 * length * j0(2.404826 * np.sqrt(1.0 + groom[..., 2] / length))
    simulation = Simulation(groom, LIMP, substeps).place(swung)
    size = simulation.step.size
    period = 2.0 * np.pi / 1.202413 * np.sqrt(length / 9.81)
    tip = simulation.substeps(int(4.0 / size))[:, 0, -1, 0]
    if substeps == 8:
        assert periods(tip, size).mean() == pytest.approx(period, rel=0.003)
    a_period = int(period / size) + 1
    after = int(3.0 * period / size)
    fallen = abs(tip[after : after + a_period]).max() / abs(tip[:a_period]).max()
    assert fallen == pytest.approx(np.exp(-((2.0 * np.pi / period) ** 2) * size * 1.5 * period), abs=0.02)


@pytest.mark.gate(id="V3")
def test_a_stiff_strand_on_a_hinge_is_a_pendulum():
    length = 0.1
    groom = line(length, 25, (0.0, 0.0, -1.0))
    swung = line(length, 25, (0.02, 0.0, -1.0))
    settings = replace(FREE, bend_stiffness=100.0)
    simulation = Simulation(groom, settings, 8)
    hinged = simulation.material.bend_compliances.copy()
    hinged[:, 0] = 1e20
    simulation = Simulation(groom, settings, 8, bend_compliances=hinged).place(swung)
    tip = simulation.substeps(int(3.0 / simulation.step.size))[:, 0, -1, 0]
    expected = 2.0 * np.pi * np.sqrt(2.0 * length / (3.0 * 9.81))
    assert periods(tip, simulation.step.size).mean() == pytest.approx(expected, rel=0.003)


@pytest.mark.gate(id="V4")
def test_a_cantilever_vibrates_in_its_first_mode():
    length = 0.05
    frequency = 3.516 / (2.0 * np.pi) * np.sqrt(BENDING / (LINE_MASS * length**4))
    groom = line(length, 25)
    place, ratio = 1.875104 * np.linspace(0.0, 1.0, 25), 0.7340955
    bent = groom.copy()
    mode = np.cosh(place) - np.cos(place) - ratio * (np.sinh(place) - np.sin(place))
    bent[..., 2] = 0.01 * length * mode / 2.0
    simulation = Simulation(groom, FREE, 1, (0.0, 0.0, 0.0)).place(bent)
    simulation.step = replace(simulation.step, size=0.03 / (2.0 * np.pi * frequency))
    tip = simulation.substeps(int(4.0 / frequency / simulation.step.size))[:, 0, -1, 2]
    assert 1.0 / periods(tip, simulation.step.size).mean() == pytest.approx(frequency, rel=0.004)


def momenta(simulation, masses):
    """Return the linear [kg m/s] and the angular momentum [kg m²/s], including that of frames."""
    rods = simulation.rods
    velocities = rods.velocities()[0, 1:].astype(float)
    spins = rods.read("spins").reshape(1, -1, 3)[0, 1:].astype(float)
    spin = (simulation.material.inertias[0, 1:, None] * spins).sum(axis=0)
    orbit = (masses[:, None] * np.cross(simulation.points[0, 1:], velocities)).sum(axis=0)
    return (masses[:, None] * velocities).sum(axis=0), orbit + spin


def free_rod(substeps, seconds):
    """Return the momenta before and after of a free rod; the origin follows the rod as it follows hair."""
    groom = curl(0.1, 25, 1)
    material = Simulation(groom, FREE).material
    bending, stretching = material.bend_compliances.copy(), material.stretch_compliances.copy()
    bending[:, :2] = stretching[:, :1] = 1e20
    simulation = Simulation(
        groom, FREE, substeps, (0.0, 0.0, 0.0), bend_compliances=bending, stretch_compliances=stretching
    )
    simulation.step = replace(simulation.step, most_stretch=1e9)
    thrown = np.cross([3.0, 5.0, -2.0], groom - groom.mean(axis=1, keepdims=True)) + np.array([0.4, -0.8, 1.2])
    simulation.place(groom, thrown)
    masses = simulation.material.masses[0, 1:]
    before, center = momenta(simulation, masses), np.zeros(3)
    for _ in range(int(seconds / FRAME)):
        way = -np.round(8.0 * simulation.advance().points[0].mean(axis=0)) / 8.0
        simulation.rods.carry([True], IDENTITY[None], np.zeros((1, 3)), way[None])
        simulation.roots, center = simulation.roots + way, center - way
    after, turning = momenta(simulation, masses)
    return before, (after, turning + np.cross(center, after))


@pytest.mark.gate(id="V7")
@pytest.mark.parametrize(("substeps", "gate"), [(1, 1e-6), (2, 1e-6), (8, 5e-6)])
def test_a_free_rod_keeps_its_momentum(substeps, gate):
    """Momentum is constant for two seconds, up to the rounding of positions, 4e-9 m, divided by the time step."""
    (before, turning), (after, _) = free_rod(substeps, 2.0)
    assert np.linalg.norm(after - before) < gate * np.linalg.norm(before)
    assert np.linalg.norm(turning) > 0.0


@pytest.mark.gate(id="V7")
def test_the_error_of_angular_momentum_is_of_first_order_in_time():
    errors = []
    for substeps in (4, 16):
        (_, before), (_, after) = free_rod(substeps, 0.5)
        errors.append(np.linalg.norm(after - before) / np.linalg.norm(before))
    assert errors[0] > 2.5 * errors[1]


@pytest.mark.gate(id="V8")
def test_a_strand_keeps_its_length():
    """A strand keeps its length at rest, shaken at 5 Hz by ten times gravity, and after a jump of the root by 1/3 m."""
    groom = np.concatenate([curl(0.15, 25), line(0.15, 25), line(0.15, 25, (0.0, 0.3, -1.0))])
    simulation = Simulation(groom).advance(48)
    assert abs(simulation.rods.stretch()).max() < 1e-4
    most = 0.0
    for frame in range(24):
        simulation.roots = groom[:, 0] + [
            10.0 * 9.81 / (10.0 * np.pi) ** 2 * np.sin(10.0 * np.pi * frame * FRAME),
            0,
            0,
        ]
        most = max(most, abs(simulation.advance().rods.stretch()).max())
    assert most < 0.025
    simulation.roots = groom[:, 0] + [0.0, 0.3, 0.0]
    assert abs(simulation.advance().rods.stretch()).max() < 0.02
    assert not simulation.rods.reset_counts().any()


@pytest.mark.gate(id="V8")
@pytest.mark.parametrize(
    ("length", "vertex_count", "modulus"), [(0.01, 65, 4.0), (0.02, 65, 4000.0), (0.0512, 33, 4.0), (2.0, 65, 400.0)]
)
def test_short_and_stiff_segments_keep_their_length(length, vertex_count, modulus):
    """Short and stiff segments keep their length, as LEAST_INERTIA keeps their matrix definite despite rounding."""
    settings = replace(FIBRE, youngs_modulus=min(modulus, 1e3), bend_stiffness=max(modulus / 1e3, 1.0))
    groom = np.concatenate([line(length, vertex_count), curl(length, vertex_count, 2, 0.05 * length)])
    simulation = Simulation(groom, settings)
    for frame in range(24):
        simulation.roots = groom[:, 0] + [0.05 * np.sin(frame), 0.05 * np.cos(frame), 0.0]
        assert abs(simulation.advance().rods.stretch()).max() < 0.02
    assert not simulation.rods.reset_counts().any()


def energy(simulation, stiffness):
    """Return the energies (S,) [J] of motion, height and bending."""
    rods, material = simulation.rods, simulation.material
    velocities = rods.velocities().astype(float)
    spins = rods.read("spins").reshape(*material.inertias.shape, 3).astype(float)
    moving = 0.5 * (material.masses[..., None] * velocities**2).sum(axis=(1, 2))
    moving += 0.5 * (material.inertias[..., None] * spins**2).sum(axis=(1, 2))
    height = (material.masses * 9.81 * simulation.points[..., 2]).sum(axis=1)
    frames = rods.read("frames").reshape(*material.inertias.shape, 4).astype(float)
    return moving + height + bending_energy(frames, simulation.rest, stiffness)


def bending_energy(frames, rest, stiffness):
    before = np.concatenate([rest.frames[:, :1], frames[:, :-1]], axis=1)
    back = inverse(rest.halves)
    bend = product(product(back, product(inverse(before), frames)), back)[..., :3]
    return 0.5 * (4.0 * bend**2 * stiffness).sum(axis=(1, 2))


@pytest.mark.gate(id="V9")
def test_energy_never_grows_without_drive():
    groom = np.concatenate([line(0.15, 25), line(0.15, 25, (0.1, 0.0, 1.0)), curl(0.15, 25)])
    simulation = Simulation(groom, FREE, 4)
    material = simulation.material
    per_joint = 1.0 / material.bend_compliances
    stiffness = np.stack([per_joint, per_joint, per_joint / material.twist_ratio], axis=-1)
    energies = [energy(simulation, stiffness)]
    for _ in range(72):
        energies.append(energy(simulation.advance(), stiffness))
    energies = np.array(energies)
    scale = material.masses.sum(axis=1) * 9.81 * 0.15
    assert (np.diff(energies, axis=0) / scale).max() < 1e-3
    assert (energies[-1] < energies[0]).all()


@pytest.mark.gate(id="V9")
def test_what_is_let_fall_comes_to_rest():
    """Strands of any shape, number of vertices, stiffness and number of substeps come to rest after they fall."""
    settled = [
        is_settled
        for vertex_count in (6, 13, 25)
        for substeps in (1, 2, 4, 8)
        for is_settled in settled_strands(vertex_count, substeps)
    ]
    assert len(settled) == 216
    assert sum(settled) >= 214


def settled_strands(vertex_count, substeps):
    shapes = np.concatenate(
        [
            line(0.15, vertex_count, (1.0, 0.0, 0.3)),
            line(0.15, vertex_count, (0.3, 0.0, 1.0)),
            curl(0.15, vertex_count, 2),
        ]
    )
    stiffness = np.repeat(np.logspace(-3, 3, 6), 3)[:, None]
    groom = np.tile(shapes, (6, 1, 1))
    compliances = Simulation(groom).material.bend_compliances / stiffness
    simulation = Simulation(groom, replace(FIBRE, air_drag=3.0), substeps, bend_compliances=compliances)
    simulation.advance(24 * 8)
    assert np.isfinite(simulation.points).all()
    return (simulation.speed < 5e-3) & (simulation.rods.reset_counts() == 0)


@pytest.mark.gate(id="V10")
def test_the_error_is_of_first_order_in_time():
    """The error is of first order in time for a level strand of 20 cm that falls for a quarter of a second."""
    tips = []
    for substeps in (4, 8, 16, 32, 256):
        simulation = Simulation(line(0.2, 25), replace(FIBRE, bend_stiffness=8.0), substeps, GRAVITY)
        tips.append(simulation.advance(6).points[0, -1])
    errors = np.linalg.norm(np.array(tips[:-1]) - tips[-1], axis=1)
    assert (errors[:-1] / errors[1:] > 1.6).all()
