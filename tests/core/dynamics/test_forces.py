# SPDX-License-Identifier: GPL-3.0-or-later
"""Air, hold, pinned points, rotating roots and resets act on strands, and invalid values are refused."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from hair_addon.core.dynamics.rod import material, rod_solver
from hair_addon.core.dynamics.rod.rod_solver import Surroundings
from hair_addon.core.dynamics.rod.rods import Rods, combed_shape
from hair_addon.core.dynamics.rod.settings import DynamicsSettings
from hair_addon.core.errors import HairError
from tests.support.devices import DEVICE
from tests.support.dynamics.rods import FIBRE, GRAVITY, Simulation, curl, in_lanes, line

WEIGHTLESS = (0.0, 0.0, 0.0)


def everywhere(simulation, vector):
    """Return an array of `Surroundings` with the same numbers at each point."""
    shape = simulation.rods.strand_count, simulation.rods.segment_count + 1, len(vector)
    return in_lanes(np.broadcast_to(vector, shape))


def drag_of_cylinder(speed, radius, length):
    """Return the drag [N s/m²] of cylinders across a flow by White's fit, and by slender-body theory where it is
    slower.
    """
    reynolds = 2.0 * radius * speed * 1.2 / 1.81e-5
    fit = 0.5 * 1.2 * 2.0 * radius * speed * (1.0 + 10.0 * reynolds ** (-2.0 / 3.0))
    return max(fit, 4.0 * np.pi * 1.81e-5 / (np.log(2.0 * length / radius) + 0.5))


@pytest.mark.gate(id="V21")
@pytest.mark.parametrize("substeps", [2, 8])
@pytest.mark.parametrize("speed", [0.05, 0.5, 3.0])
def test_a_limp_strand_hangs_straight_in_the_wind(speed, substeps):
    """A limp strand hangs straight in wind at the angle θ with c_n u cos θ = ρA g sin θ, for any number of substeps."""
    length, radius = 0.1, FIBRE.fibre_radius
    line_mass = FIBRE.density * np.pi * radius**2

    def surplus(angle):
        across = speed * np.cos(angle)
        return drag_of_cylinder(across, radius, length) * across - line_mass * 9.81 * np.sin(angle)

    angle = brentq(surplus, 0.0, 1.57)
    groom = line(length, 13, (np.sin(angle), 0.0, -np.cos(angle)))  # its hinge is free, and it ends where it is
    limp = Simulation(line(length, 13, (0.0, 0.0, -1.0))).material.bend_compliances * 1e6
    simulation = Simulation(line(length, 13, (0.0, 0.0, -1.0)), FIBRE, substeps, bend_compliances=limp)
    wind = Surroundings(airs=everywhere(simulation, (speed, 0.0, 0.0)))
    simulation.advance(24 * 10, surroundings=wind)
    assert simulation.speed.max() < 1e-3
    assert np.linalg.norm(simulation.points - groom, axis=2).max() < np.radians(0.5) * length


def test_an_acceleration_of_all_points_is_as_gravity():
    groom = np.concatenate([line(0.1, 25), curl(0.1, 25)])
    falling = Simulation(groom).advance(12)
    driven = Simulation(groom, gravity=WEIGHTLESS)
    driven.advance(12, surroundings=Surroundings(accelerations=everywhere(driven, GRAVITY)))
    assert abs(falling.points - driven.points).max() < 1e-6


def test_the_factor_of_drag_multiplies_it():
    groom = line(0.1, 25)
    without = Simulation(groom, replace(FIBRE, air_drag=0.0)).advance(6)
    shielded = Simulation(groom)
    shielded.advance(6, surroundings=Surroundings(drags=everywhere(shielded, (0.0,))))
    assert abs(without.points - shielded.points).max() < 1e-7
    assert abs(without.points - Simulation(groom).advance(6).points).max() > 1e-3


def test_hold_is_a_spring_to_the_groom_whatever_the_substeps_are():
    """Hold is a spring to the groom for any number of substeps: a limp strand falls by g / k where its root does not
    hold it.
    """
    settings = replace(FIBRE, hold=500.0, bend_stiffness=1e-3, stretch_stiffness=1e-5, air_drag=5.0)
    ends = []
    for substeps in (2, 16):
        simulation = Simulation(line(0.2, 25), settings, substeps).advance(96)
        assert simulation.speed.max() < 1e-3
        ends.append(simulation.points[0])
    assert ends[0][12, 2] == pytest.approx(-9.81 / 500.0, rel=0.02)
    assert abs(ends[0] - ends[1]).max() < 1e-5


def test_hold_may_end_at_the_tip():
    drops = []
    for tip in (1.0, 0.0):
        simulation = Simulation(line(0.15, 25), replace(FIBRE, hold=1000.0, hold_tip=tip)).advance(72)
        drops.append(-simulation.points[0, -1, 2])
    assert drops[1] > 2.0 * drops[0]


@pytest.mark.parametrize("part", [0.5, 1.0])
def test_pinned_points_follow_the_surface(part):
    groom = np.concatenate([line(0.1, 21), curl(0.1, 21)])
    turn = Rotation.from_rotvec([0.4, 0.3, -0.9])
    simulation = Simulation(groom, replace(FIBRE, pinned=part)).advance(2)
    simulation.roots, simulation.turns = groom[:, 0] + 0.03, np.tile(turn.as_quat(), (2, 1))
    simulation.advance(24)
    carried = turn.apply((groom - groom[:, :1]).reshape(-1, 3)).reshape(groom.shape) + simulation.roots[:, None]
    apart = np.linalg.norm(simulation.points - carried, axis=2)
    last = int(part * 20)
    assert apart[:, : last + 1].max() < 1e-7
    assert part == 1.0 or apart[:, -1].min() > 1e-3
    assert not simulation.rods.reset_counts().any()


def test_a_groom_turns_with_its_surface():
    """A groom turns with its surface: a weightless strand comes to rest in its turned combed shape."""
    groom = np.concatenate([line(0.1, 25), curl(0.1, 25)])
    turn = Rotation.from_rotvec([0.9, -0.4, 0.5])
    simulation = Simulation(groom, DynamicsSettings(damping=0.02, air_drag=3.0), gravity=WEIGHTLESS)
    simulation.turns = np.tile(turn.as_quat(), (2, 1))
    simulation.advance(24 * 8)
    carried = turn.apply(groom.reshape(-1, 3)).reshape(groom.shape)
    assert abs(simulation.points - carried).max() < 1e-5


def test_a_tip_may_be_softer_than_the_root():
    drops = []
    for tip in (1.0, 0.1):
        simulation = Simulation(line(0.1, 25), replace(FIBRE, tip_stiffness=tip, air_drag=10.0)).advance(96)
        drops.append(-simulation.points[0, -1, 2])
    assert drops[1] > 1.05 * drops[0]


def test_wet_hair_is_heavier_and_softer():
    lengths = np.full((1, 4), 0.01)
    dry, wet = (material.material_of(replace(FIBRE, wetness=wetness), lengths) for wetness in (0.0, 1.0))
    assert wet.masses.sum() == pytest.approx(1.3 * dry.masses.sum())
    np.testing.assert_allclose(wet.bend_compliances, 2.0 * dry.bend_compliances)
    np.testing.assert_allclose(wet.slow_drags * 1.3, 0.3 * dry.slow_drags)
    assert dry.masses.sum() == pytest.approx(1300.0 * np.pi * 4e-5**2 * 0.04)


def test_another_step_size_goes_on_smoothly():
    """Substeps of another size continue smoothly, so a strand at rest stays at rest."""
    simulation = Simulation(line(0.1, 25), replace(FIBRE, air_drag=10.0, damping=0.05)).advance(144)
    resting = simulation.points
    for count in (8, 1, 16, 4):
        simulation.step = replace(
            simulation.step, size=simulation.step.size * simulation.step.count / count, count=count
        )
        simulation.advance(2)
        assert abs(simulation.points - resting).max() < 2e-6


def test_a_broken_strand_is_put_back_and_counted():
    groom = np.tile(line(0.1, 25), (12, 1, 1))
    simulation, other = Simulation(groom).advance(4), Simulation(groom).advance(4)
    state = simulation.rods.save()
    state["velocities"][3, 30], state["frames"][7, 12] = np.nan, np.inf
    simulation.rods.load(state)
    simulation.roots = other.roots = groom[:, 0] + 0.01
    simulation.advance(), other.advance()
    assert list(np.flatnonzero(simulation.rods.reset_counts())) == [3, 7]
    assert np.isfinite(simulation.points).all()
    assert abs(simulation.points[[3, 7]] - groom[[3, 7]] - 0.01).max() < 0.02
    sound = np.delete(np.arange(12), [3, 7])
    np.testing.assert_array_equal(simulation.points[sound], other.points[sound])


def made(groom, **changes):
    rest = combed_shape(groom)
    return Rods(groom, replace(material.material_of(FIBRE, rest.lengths), **changes), rest, DEVICE)


def test_what_cannot_be_simulated_is_refused():
    groom = np.tile(line(0.1, 25), (3, 1, 1))
    simulation = Simulation(groom)
    with pytest.raises(HairError):
        made(np.zeros((3, 25, 3)))
    with pytest.raises(HairError):
        made(np.full((3, 25, 3), np.nan))
    with pytest.raises(HairError):
        made(groom, inertias=np.ones((3, 5)))
    with pytest.raises(HairError):
        made(np.tile(line(0.1, 67), (3, 1, 1))).advance(simulation.step)
    with pytest.raises(HairError):
        simulation.advance(surroundings=Surroundings(planes=in_lanes(np.zeros((3, 25, 7)))))
    with pytest.raises(HairError):
        simulation.rods.move_roots(np.full((3, 3), np.inf))
    with pytest.raises(HairError):
        simulation.rods.advance(simulation.step, 3, 9)
    with pytest.raises(HairError):
        simulation.rods.advance(replace(simulation.step, pinned=26))
    with pytest.raises(HairError):
        simulation.rods.load({**simulation.rods.save(), "frames": np.zeros((3, 8), np.float32)})
    assert np.isfinite(simulation.advance().points).all()


def test_rows_of_planes():
    rows = [rod_solver.plane_row(point, field) for point in range(3) for field in range(8)]
    assert rows == list(range(24))
