# SPDX-License-Identifier: GPL-3.0-or-later
"""Contact with planes, spheres and cylinders lets strands go, obeys Coulomb friction, and keeps points outside."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hair_addon.core.dynamics.rod.rod_solver import EMPTY, FINISH, PREDICT, SOLVE, Surroundings
from tests.support.dynamics.rod_contact import Ball, Plane, advance_touching, planes_of
from tests.support.dynamics.rods import FIBRE, GRAVITY, Simulation, curl, in_lanes, line
from tests.support.pairs import pairs, share_of_rows

KEEP = 5e-4  # [m]


def released(substeps, surface):
    """Return heights (frames,) of the tip of a strand that was pressed flat, while its rest shape rises by 30°."""
    groom = line(0.05, 11, (np.cos(np.pi / 6.0), 0.0, np.sin(np.pi / 6.0))) + np.array([0.0, 0.0, KEEP])
    flat = line(0.05, 11) + np.array([0.0, 0.0, KEEP])
    simulation = Simulation(groom, FIBRE, substeps).place(flat)
    heights = []
    for _ in range(24):
        if surface is None:
            simulation.advance()
        else:
            advance_touching(simulation, surface)
        heights.append(simulation.points[0, -1, 2])
    return np.array(heights)


@pytest.mark.gate(id="V15")
@pytest.mark.parametrize("substeps", [4, 8])
def test_a_pressed_strand_is_let_go(substeps):
    """A strand that was pressed flat leaves the plane within two frames, and reaches its free shape within a second
    to 0.1 %.
    """
    with_plane, without = released(substeps, Plane()), released(substeps, None)
    assert with_plane[1] > 2.0 * KEEP
    assert abs(with_plane[-1] - without[-1]) < 1e-3 * 0.05


SLOPES = [(0.3, 10.0), (0.3, 16.0), (0.3, 17.5), (0.3, 30.0), (0.0, 30.0)]  # μ, degrees


@pytest.mark.gate(id="V11")
@pytest.mark.parametrize("friction,degrees", SLOPES)
def test_a_free_strand_slides_or_sticks_on_an_incline(friction, degrees):
    """A sliding strand accelerates by a = g (sin θ - μ cos θ); a sticking strand creeps by at most 0.1 mm/s."""
    angle = np.radians(degrees)
    normal = np.array([np.sin(angle), 0.0, np.cos(angle)])
    down = np.array([np.cos(angle), 0.0, -np.sin(angle)])
    groom = line(0.05, 12, (0.0, 1.0, 0.0)) + KEEP * normal
    material = Simulation(groom).material
    bending, stretching = material.bend_compliances.copy(), material.stretch_compliances.copy()
    bending[:, :2] = stretching[:, :1] = 1e20  # the first segment holds nothing
    no_drag = np.zeros(1)
    simulation = Simulation(
        groom,
        replace(FIBRE, air_drag=0.0),
        8,
        bend_compliances=bending,
        stretch_compliances=stretching,
        slow_drags=no_drag,
    )
    simulation.step = replace(simulation.step, most_stretch=1e9)
    advance_touching(simulation, Plane(tuple(normal)), 24, friction)
    moved = (simulation.points - groom)[0, 1:].mean(axis=0) @ down
    expected = 9.81 * (np.sin(angle) - friction * np.cos(angle))
    if expected > 0.0:
        assert 2.0 * moved == pytest.approx(expected, rel=0.025)
    else:
        assert 0.0 <= moved < 1e-4


FRICTIONS = np.array([0.0, 0.1, 0.3, 0.6])


def tension_ratios(substeps):
    """Return tension ratios of strands pulled over a quarter of a cylinder by weights, relative to the frictionless
    one.
    """
    radius, length, weight = 0.02, 0.2, 1e-4
    along = np.linspace(0.0, length, 61)
    level, arc = 0.08, (radius + KEEP) * np.pi / 2.0
    angle = np.clip((along - level) / (radius + KEEP), 0.0, np.pi / 2.0)
    over = np.stack([np.sin(angle), 0.0 * angle, np.cos(angle)], axis=-1) * (radius + KEEP)
    over[:, 0] += np.minimum(along - level, 0.0)
    over[:, 2] -= np.maximum(along - level - arc, 0.0)
    straight = np.repeat(line(length, 61), len(FRICTIONS), axis=0) + over[0]
    masses = np.full((len(FRICTIONS), 61), weight / 2000.0)
    masses[:, -1] = weight
    soft = Simulation(straight).material.bend_compliances * 1e3
    simulation = Simulation(
        straight,
        replace(FIBRE, air_drag=0.0),
        substeps,
        masses=masses,
        bend_compliances=soft,
        slow_drags=np.full(len(FRICTIONS), 3.0),
    ).place(np.repeat(over[None], len(FRICTIONS), axis=0))
    tensions = []

    def measure():
        pull = np.linalg.norm(simulation.rods.read("multipliers")[:, 3:6], axis=1)
        tensions.append(pull)

    surface = Ball(radius, (1.0, 0.0, 1.0))
    pull = {"friction": FRICTIONS, "root_speed": (-0.01, 0.0, 0.0)}
    advance_touching(simulation, surface, 24, **pull)
    advance_touching(simulation, surface, 18, **pull, each=measure)
    mean = np.mean(tensions, axis=0)
    assert abs(simulation.rods.stretch()).max() < 0.03
    return mean[1:] / mean[0]


@pytest.mark.gate(id="V11")
@pytest.mark.parametrize("substeps,gate", share_of_rows([(8, 0.04), (32, 0.015)], 2))
def test_a_strand_around_a_cylinder_holds_as_a_capstan(substeps, gate):
    np.testing.assert_allclose(tension_ratios(substeps), np.exp(FRICTIONS[1:] * np.pi / 2.0), rtol=gate)


INCLINE = Plane((0.5, 0.0, np.cos(np.pi / 6.0)))


@pytest.mark.gate(id="V16")
@pytest.mark.parametrize(("vertex_count", "substeps"), pairs([11, 41], [2, 4, 8], 4))
def test_strands_that_fall_on_something_stay_outside_and_whole(vertex_count, substeps):
    """648 strands of any shape, stiffness and friction that fall on a plane, an incline or a ball stay outside and
    whole.
    """
    angle = np.linspace(0.0, 1.5, vertex_count)
    rising = 0.1 * np.stack([np.sin(angle), 0.0 * angle, 0.5 - 0.5 * np.cos(angle)], axis=-1)[None]
    shapes = np.concatenate(
        [line(0.15, vertex_count, (1.0, 0.0, 0.3)), rising, curl(0.15, vertex_count, 3, 0.004, fall=-0.1)]
    )
    frictions, stiffness = (grid.ravel() for grid in np.meshgrid((0.0, 0.3, 1.0, 2.0), (1e-3, 1.0, 1e3)))
    for surface, lift in (
        (Plane(), (0.0, 0.0, 0.02)),
        (INCLINE, 0.02 * np.array(INCLINE.normal)),
        (Ball(0.05), (0.0, 0.0, 0.0507)),
    ):
        groom = np.tile(shapes, (len(frictions), 1, 1)) + np.array(lift)
        plain = Simulation(groom).material
        factor = np.repeat(stiffness, 3)[:, None]
        simulation = Simulation(
            groom,
            FIBRE,
            substeps,
            GRAVITY,
            bend_compliances=plain.bend_compliances / factor,
            stretch_compliances=plain.stretch_compliances / factor,
        )
        most_stretch = 0.0
        for _ in range(12):
            advance_touching(simulation, surface, 4, np.repeat(frictions, 3), KEEP)
            most_stretch = max(most_stretch, abs(simulation.rods.stretch()).max())
        assert np.isfinite(simulation.points).all()
        heights, _normals = surface.heights_and_normals(simulation.points[:, 1:])
        assert heights.min() > KEEP - 1e-6
        if substeps >= 4:
            assert most_stretch < 0.05
        assert not simulation.rods.reset_counts().any()


def hair_on_a_ball(count, vertex_count=25):
    """Return strands of 20 cm from the upper half of a ball of 9 cm, (S, N, 3), and its `Ball`."""
    rng = np.random.default_rng(3)
    out = rng.normal(size=(count, 3))
    out[:, 2] = abs(out[:, 2]) + 0.3
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    lean = out - np.array([0.0, 0.0, 0.3])
    lean /= np.linalg.norm(lean, axis=1, keepdims=True)
    return 0.0911 * out[:, None] + 0.2 * np.linspace(0.0, 1.0, vertex_count)[:, None] * lean[:, None]


@pytest.mark.gate(id="V12")
@pytest.mark.parametrize("substeps", [4, 8])
def test_a_shaken_and_turned_head_keeps_its_hair_outside(substeps):
    """A head shaken by 5 cm at 3 Hz and turned by 70° at 1.5 Hz keeps hair 1 mm away, to a micrometer."""
    groom = hair_on_a_ball(48)
    simulation = Simulation(groom, FIBRE, substeps)
    rods, step = simulation.rods, replace(simulation.step, count=1)

    def pose(time):
        turn = Rotation.from_rotvec([0.0, 0.0, np.radians(70.0) * np.sin(3.0 * np.pi * time)])
        return turn, np.array([0.05 * np.sin(6.0 * np.pi * time), 0.0, 0.0])

    most_stretch, least_height = 0.0, 1.0
    for substep in range(36 * substeps):
        (before, place_before), (turn, place) = pose(substep * step.size), pose((substep + 1) * step.size)
        rods.move_roots(turn.apply(groom[:, 0]) + place, np.tile(turn.as_quat(), (len(groom), 1)))
        ball = Ball(0.09, center=tuple(place))
        for stage in (PREDICT, SOLVE, FINISH):
            points = rods.positions().astype(float)
            local = turn.inv().apply((points - place).reshape(-1, 3))
            slide = (points.reshape(-1, 3) - before.apply(local) - place_before).reshape(points.shape)
            around = Surroundings(in_lanes(planes_of(ball, points, 1e-3, 0.3, slide)))
            rods.advance(step, 0, 1, stage, EMPTY if stage == PREDICT else around)
        heights, _normals = ball.heights_and_normals(simulation.points[:, 1:])
        most_stretch = max(most_stretch, abs(rods.stretch()).max())
        least_height = min(least_height, heights.min())
    assert least_height > 1e-3 - 1e-6
    assert most_stretch < (0.03 if substeps == 8 else 0.1)
    assert not rods.reset_counts().any()


@pytest.mark.gate(id="V12")
def test_a_ball_goes_through_hanging_hair_which_closes_behind_it():
    """Hanging hair that a ball of 4 cm is pushed through at 20 cm/s hangs a second later as before."""
    groom = np.concatenate(
        [line(0.2, 25, (0.0, 0.0, -1.0)) + np.array([x, 0.0, 0.0]) for x in np.linspace(-0.05, 0.05, 21)]
    )
    simulation = Simulation(groom, replace(FIBRE, air_drag=3.0), 4)
    least_height = 1.0
    for frame in range(48):
        ball = Ball(0.02, center=(0.0, -0.1 + 0.2 * frame / 24.0, -0.12))
        advance_touching(simulation, ball, keep=1e-3)
        heights, _normals = ball.heights_and_normals(simulation.points[:, 1:])
        least_height = min(least_height, heights.min())
        if frame == 12:
            pushed = np.linalg.norm(simulation.points - groom, axis=2).max()
    assert least_height > 1e-3 - 1e-6
    assert pushed > 0.01
    simulation.advance(72)
    assert np.linalg.norm(simulation.points - groom, axis=2).max() < 1e-3
    assert abs(simulation.rods.stretch()).max() < 1e-3


@pytest.mark.gate(id="V12")
def test_a_tip_in_a_notch_comes_in_front_of_both_of_its_sides(rng):
    """A tip that is inside both sides of a notch is moved in front of both, also of the side found after the solve."""
    count = 32
    simulation = Simulation(np.repeat(line(0.05, 6), count, axis=0), substeps=8)
    step = replace(simulation.step, gravity=(0.0, 0.0, 0.0))
    simulation.rods.advance(step, 0, 1, PREDICT)
    sides = []
    for sign in (-1.0, 1.0):
        angles = rng.uniform(np.radians(10.0), np.radians(70.0), count)  # of a side, from level
        normals = np.stack([0.0 * angles, sign * np.sin(angles), np.cos(angles)], axis=1)
        depths = rng.uniform(5e-4, 2e-3, count)
        planes = np.zeros((count, 6, 8))
        planes[:, -1, :3] = normals
        planes[:, -1, 3] = np.einsum("si,si->s", normals, simulation.points[:, -1]) + depths
        sides.append(planes)
    simulation.rods.advance(step, 0, 1, FINISH, Surroundings(*map(in_lanes, sides)))
    for planes in sides:
        gaps = np.einsum("si,si->s", planes[:, -1, :3], simulation.points[:, -1]) - planes[:, -1, 3]
        assert gaps.min() > -1e-6
    assert abs(simulation.rods.stretch()).max() < 0.006
