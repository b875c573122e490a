# SPDX-License-Identifier: GPL-3.0-or-later
"""A simulation over frames has an initial state, ignores certain motion, stores its state, and checks its input."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon.core.dynamics.air import ForceField
from hair_addon.core.dynamics.rod import rotations
from hair_addon.core.dynamics.rod.settings import DynamicsSettings
from hair_addon.core.dynamics.root_motion import RigidMotion, RootPose
from hair_addon.core.dynamics.simulation import Obstacle, Simulation, World
from hair_addon.core.errors import HairError
from tests.support.devices import DEVICE
from tests.support.meshes import subdivided_sphere

RADIUS, LENGTH, FRAME = 0.1, 0.12, 1.0 / 24.0
BALL = subdivided_sphere(3, 0.99 * RADIUS)
NONE = World(gravity=(0.0, 0.0, 0.0))


def fur(rng, count=24, point_count=41):
    """Return (groom, pose): wavy guides that stand on a ball."""
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    t = np.linspace(0.0, 1.0, point_count)
    across = np.cross(normals, [0.3, 0.5, 0.8])
    points = (RADIUS + LENGTH * t)[:, None] * normals[:, None] + 0.004 * np.sin(9.0 * t)[:, None] * across[:, None]
    return points, RootPose(points[:, 0], np.tile(rotations.IDENTITY, (count, 1)))


def ball(motion=None):
    vertices = BALL.vertices.astype(np.float64)
    return Obstacle("Ball", vertices if motion is None else motion.moved(vertices), BALL.triangles)


def shake(frame, size=0.05):
    """Return the motion of the ball at a frame: 3 Hz to the side, and a turn."""
    angle = 0.2 * np.sin(frame)
    rotation = np.array([0.0, 0.0, np.sin(angle / 2.0), np.cos(angle / 2.0)])
    return RigidMotion(rotation, np.zeros(3), np.array([size * np.sin(2.0 * np.pi * 3.0 * frame * FRAME), 0.0, 0.0]))


def play(simulation, pose, frames, gravity=(0.0, 0.0, -9.81), is_colliding=True):
    for frame in frames:
        motion = shake(frame)
        world = World(gravity, (ball(motion),) if is_colliding else ())
        simulation.advance(pose.moved(motion), world, FRAME)
    return simulation.points()


@pytest.mark.parametrize("sag_free", [False, True])
def test_it_begins_with_the_groom(rng, sag_free):
    groom, pose = fur(rng)
    simulation = Simulation(groom, DynamicsSettings(sag_free=sag_free), pose, World(), DEVICE)
    np.testing.assert_allclose(simulation.points(), groom, atol=1e-7)


def test_a_sag_free_groom_stays_also_on_a_surface_that_is_turned(rng):
    groom, pose = fur(rng)
    turn = RigidMotion(rotations.unit(np.array([0.4, 0.2, -0.5, 0.7])), np.zeros(3), np.array([1.0, 2.0, 3.0]))
    pose = pose.moved(turn)
    simulation = Simulation(groom, DynamicsSettings(bend_stiffness=100.0), pose, World(), DEVICE)
    for _ in range(12):
        simulation.advance(pose, World(), FRAME)
    np.testing.assert_allclose(simulation.points(), turn.moved(groom), atol=1e-5)


def test_without_inertia_hair_moves_with_its_surface(rng):
    groom, pose = fur(rng)
    settings = DynamicsSettings(inertia=0.0, air_drag=0.0)
    simulation = Simulation(groom, settings, pose, replace(NONE, obstacles=(ball(),)), DEVICE)
    points = play(simulation, pose, range(1, 13), NONE.gravity)
    np.testing.assert_allclose(points, shake(12).moved(groom), atol=1e-6)


def test_hair_that_is_pinned_to_the_tip_moves_with_its_surface(rng):
    """Hair that is pinned to its tip moves with its surface, also with a collider."""
    groom, pose = fur(rng)
    simulation = Simulation(groom, DynamicsSettings(pinned=1.0), pose, World(obstacles=(ball(),)), DEVICE)
    np.testing.assert_allclose(play(simulation, pose, range(1, 5)), shake(4).moved(groom), atol=1e-6)


def test_a_jump_takes_hair_along_as_it_is(rng):
    """A jump of any distance takes hair along with its shape and speed relative to the surface."""
    groom, pose = fur(rng)
    settings = DynamicsSettings(hair_friction=0.0, hair_pressure=0.0)  # their grid does not turn with the hair
    jump = RigidMotion(rotations.unit(np.array([0.0, 0.0, 0.9, 0.1])), np.zeros(3), np.array([30.0, -4.0, 7.0]))
    staying, jumping = (Simulation(groom, settings, pose, NONE, DEVICE) for _ in range(2))
    before = [play(simulation, pose, range(1, 5), NONE.gravity, False) for simulation in (staying, jumping)]
    assert np.array_equal(*before)
    moved = pose.moved(shake(4))
    staying.advance(moved, NONE, FRAME)
    jumping.advance(moved.moved(jump), NONE, FRAME)
    np.testing.assert_allclose(jumping.points(), jump.moved(staying.points()), atol=2e-5)


def test_a_place_far_away_is_as_good(rng):
    """A simulation a kilometer away is as exact, as positions are relative to the hair."""
    groom, pose = fur(rng)
    ends = []
    for far in (np.zeros(3), np.array([1000.0, -512.0, 250.125])):
        simulation = Simulation(
            groom + far, DynamicsSettings(), replace(pose, positions=pose.positions + far), World(), DEVICE
        )
        for frame in range(1, 9):
            moved = replace(pose, positions=pose.positions + shake(frame).way + far)
            simulation.advance(moved, World(), FRAME)
        ends.append(simulation.points() - far)
    np.testing.assert_allclose(*ends, atol=1e-5)


def test_hair_stays_outside_a_shaken_ball(rng):
    groom, pose = fur(rng, 60)
    simulation = Simulation(groom, DynamicsSettings(substeps=8), pose, World(obstacles=(ball(),)), DEVICE)
    least = []
    for frame in range(1, 25):
        play(simulation, pose, [frame])
        vertices = simulation.vertices()[:, 1:] - shake(frame).way
        least.append(np.linalg.norm(vertices, axis=2).min())
    flat = np.linalg.norm(BALL.corners.mean(axis=1), axis=1).min()  # the ball's triangles lie inside its sphere
    assert min(least) > flat
    assert abs(simulation.stretch()).max() < 0.03 and not len(simulation.broken)


def test_short_fur_needs_few_substeps(rng):
    """Fur of 1 cm on a ball that turns at 660°/s moves with a quarter of the most substeps as with all of them."""
    groom, pose = fur(rng)
    groom = groom[:, :1] + (groom - groom[:, :1]) / 12.0
    ends = []
    for settings in (DynamicsSettings(), DynamicsSettings(automatic_substeps=False, substeps=64)):
        simulation = Simulation(groom, settings, pose, World(obstacles=(ball(),)), DEVICE)
        for frame in range(1, 5):
            angle = np.radians(27.5) * frame
            turn = RigidMotion(np.array([0.0, 0.0, np.sin(angle / 2.0), np.cos(angle / 2.0)]), np.zeros(3), np.zeros(3))
            simulation.advance(pose.moved(turn), World(obstacles=(ball(turn),)), FRAME)
            assert simulation.substeps <= 16 or not settings.automatic_substeps
            assert abs(simulation.stretch()).max() < 0.01 and not len(simulation.broken)
        ends.append(simulation.points())
    assert np.linalg.norm(ends[1] - ends[0], axis=2).max() < 2e-4


@pytest.mark.gate(id="V13")
def test_it_goes_on_from_a_state_bit_by_bit(rng):
    groom, pose = fur(rng)

    def made():
        return Simulation(groom, DynamicsSettings(inertia=0.5), pose, World(obstacles=(ball(),)), DEVICE)

    whole, first, second = made(), made(), made()
    play(whole, pose, range(1, 13))
    play(first, pose, range(1, 7))
    second.load(first.save(), pose.moved(shake(6)), World(obstacles=(ball(shake(6)),)))
    assert np.array_equal(play(second, pose, range(7, 13)), whole.points())


def test_guides_grow_with_their_surface(rng):
    groom, pose = fur(rng)
    simulation = Simulation(groom, DynamicsSettings(), pose, World(), DEVICE)
    for frame in range(1, 13):
        scale = 1.0 + frame / 12.0
        simulation.advance(replace(pose, positions=scale * pose.positions, scale=scale), World(), FRAME)
    lengths = np.linalg.norm(np.diff(simulation.points(), axis=1), axis=2).sum(axis=1)
    before = np.linalg.norm(np.diff(groom, axis=1), axis=2).sum(axis=1)
    np.testing.assert_allclose(lengths, 2.0 * before, rtol=1e-3)


def test_other_settings_take_effect_with_the_next_frame(rng):
    groom, pose = fur(rng)
    simulation = Simulation(groom, DynamicsSettings(sag_free=False), pose, World(), DEVICE)
    for _ in range(6):
        simulation.advance(pose, World(), FRAME)
    before = simulation.points()
    simulation.change(DynamicsSettings(sag_free=False, gravity=0.0, bend_stiffness=1000.0, damping=0.1))
    assert np.array_equal(simulation.points(), before)
    for _ in range(48):
        simulation.advance(pose, World(), FRAME)
    np.testing.assert_allclose(simulation.points(), groom, atol=1e-3)
    with pytest.raises(HairError, match="change of the number of points"):
        simulation.change(DynamicsSettings(vertex_count=9))


def test_guides_without_length_follow_rigidly(rng):
    groom, pose = fur(rng)
    groom[3] = groom[3, 0]
    simulation = Simulation(groom, DynamicsSettings(), pose, World(), DEVICE)
    points = play(simulation, pose, range(1, 9), is_colliding=False)
    np.testing.assert_allclose(points[3], np.tile(shake(8).moved(groom[3, 0]), (41, 1)), atol=1e-6)


def test_a_strand_that_breaks_in_ten_frames_running_stays_in_its_groom(rng):
    """A strand that breaks in ten successive frames stays in its groom to the end, and others move as without it."""
    groom, pose = fur(rng)
    simulation, sound = (Simulation(groom, DynamicsSettings(), pose, World(), DEVICE) for _ in range(2))
    for frame in range(1, 12):
        state = simulation.save()
        if frame <= 10:
            state["rods_velocities"][5, 20] = np.nan
        motion = shake(frame)
        simulation.load(state, simulation.pose, simulation.world)
        for one in (simulation, sound):
            one.advance(pose.moved(motion), World(), FRAME)
        assert list(simulation.broken) == [5]
    points = simulation.points()
    np.testing.assert_allclose(points[5], motion.moved(groom[5]), atol=1e-6)
    assert np.isfinite(points).all() and abs(sound.points()[5] - motion.moved(groom[5])).max() > 1e-3


@pytest.mark.parametrize("strength", [1e9, -1e9])
def test_absurd_gravity_leaves_hair_finite(rng, strength):
    groom, pose = fur(rng)
    simulation = Simulation(groom, DynamicsSettings(sag_free=False), pose, World(), DEVICE)
    points = play(simulation, pose, range(1, 6), (0.0, strength, strength))
    assert np.isfinite(points).all() and np.linalg.norm(points - points[:, :1], axis=2).max() < 2.0 * LENGTH


@pytest.mark.parametrize("seconds", [np.nan, np.inf, -1.0])
def test_time_that_does_not_go_on_changes_nothing(rng, seconds):
    groom, pose = fur(rng)
    simulation = Simulation(groom, DynamicsSettings(), pose, World(), DEVICE)
    before = simulation.points()
    with pytest.raises(HairError, match="Time"):
        simulation.advance(pose.moved(shake(1)), World(), seconds)
    assert np.array_equal(simulation.points(), before) and simulation.pose is pose


def test_wind_blows_hair_over_as_far_as_it_is_strong(rng):
    groom, pose = fur(rng)
    tips = []
    for strength in (0.0, 0.4, 1.0):
        simulation = Simulation(groom, DynamicsSettings(bend_stiffness=1.0), pose, World(), DEVICE)
        for frame in range(24):
            fields = (ForceField("WIND", axis=(1.0, 0.0, 0.0), strength=strength),)
            simulation.advance(pose, World(fields=fields, time=frame * FRAME), FRAME)
        tips.append(simulation.points()[:, -1, 0].mean())
    assert np.diff(tips).min() > 0.01


def test_friction_between_hairs_makes_them_move_together(rng):
    """Friction brings guides that swing apart in a thick coat to rest sooner, and moves no groom at rest."""
    groom, pose = fur(rng, 200)
    kicks = rng.normal(0.0, 0.01, pose.positions.shape)
    speeds = []
    for friction in (0.0, 20.0):
        settings = DynamicsSettings(hair_friction=friction, hair_pressure=0.0, air_drag=0.0, damping=0.0)
        simulation = Simulation(groom, settings, pose, NONE, DEVICE)
        kicked = replace(pose, positions=pose.positions + kicks)
        for _ in range(12):
            before = simulation.points()
            simulation.advance(kicked, NONE, FRAME)
        speeds.append(np.linalg.norm(simulation.points() - before, axis=2).mean())
    assert speeds[1] < 0.9 * speeds[0]
    simulation = Simulation(groom, DynamicsSettings(hair_pressure=100.0), pose, World(), DEVICE)
    simulation.advance(pose, World(), FRAME)
    np.testing.assert_allclose(simulation.points(), groom, atol=1e-5)


@pytest.mark.gate(id="V20")
def test_hair_of_another_region_is_not_felt(rng):
    """Two coats in one place with different regions move as each would alone."""
    groom, pose = fur(rng, 200)
    is_kicked = np.arange(200) % 2 == 0
    kicks = np.where(is_kicked[:, None], rng.normal(0.0, 0.01, (200, 3)), 0.0)
    settings = DynamicsSettings(hair_friction=20.0, hair_pressure=0.0, cell_size=0.02, automatic_substeps=False)

    def ends(chosen, regions=None):
        own = replace(pose, positions=pose.positions[chosen], turns=pose.turns[chosen])
        kicked = replace(own, positions=own.positions + kicks[chosen])
        simulation = Simulation(groom[chosen], settings, own, NONE, DEVICE, regions=regions)
        for _ in range(6):
            simulation.advance(kicked, NONE, FRAME)
        return simulation.points()

    alone, everyone = ends(~is_kicked), np.ones(200, bool)
    np.testing.assert_allclose(ends(everyone, is_kicked)[~is_kicked], alone, atol=1e-6)
    assert abs(ends(everyone)[~is_kicked] - alone).max() > 1e-4
    with pytest.raises(HairError):
        ends(everyone, np.zeros(3, int))


@pytest.mark.parametrize("pinned", [0.5, 1.0])
def test_pinned_points_only_follow_the_surface(rng, pinned):
    groom, pose = fur(rng)
    settings = DynamicsSettings(pinned=pinned, bend_stiffness=1.0)
    simulation = Simulation(groom, settings, pose, World(), DEVICE)
    play(simulation, pose, range(1, 9), is_colliding=False)
    rigid = shake(8).moved(groom)
    away = np.linalg.norm(simulation.points() - rigid, axis=2).max(axis=0)
    count = int(pinned * 38)  # the shape between points is that of the segments beside them
    assert away[:count].max() < 1e-4
    assert pinned == 1.0 or away[-1] > 0.01


def test_a_number_of_substeps_that_is_set_is_taken_and_more_are_asked_for(rng):
    """A set number of substeps is used, and automatic substeps add to it in fast frames."""
    groom, pose = fur(rng)
    fixed, automatic = (
        Simulation(groom, DynamicsSettings(automatic_substeps=is_automatic), pose, World(), DEVICE)
        for is_automatic in (False, True)
    )
    for distance in (0.0, 0.1):
        moved = pose.moved(RigidMotion(rotations.IDENTITY, np.zeros(3), np.array([distance, 0.0, 0.0])))
        for simulation in (fixed, automatic):
            simulation.advance(moved, World(), FRAME)
        assert fixed.substeps == 4 and fixed.required_substeps == automatic.required_substeps == automatic.substeps
    assert automatic.substeps > 8


def test_each_guide_is_as_wet_as_it_is_said(rng):
    """Half of the guides are wet: each moves bit by bit as if all guides were as wet as it is."""
    groom, pose = fur(rng)
    alone = DynamicsSettings(hair_friction=0.0, hair_pressure=0.0, sag_free=False)
    is_wet = rng.random(len(groom)) < 0.5

    def end_of(settings, wetness=None):
        simulation = Simulation(groom, settings, pose, World(), DEVICE, wetness=wetness)
        return play(simulation, pose, range(1, 9), is_colliding=False)

    dry, wet, some = end_of(alone), end_of(replace(alone, wetness=1.0)), end_of(alone, is_wet.astype(np.float32))
    np.testing.assert_array_equal(some[is_wet], wet[is_wet])
    np.testing.assert_array_equal(some[~is_wet], dry[~is_wet])
    assert np.abs(wet - dry).max() > 1e-3
    for wrong in (np.zeros(3), np.full(len(groom), np.nan), np.full(len(groom), 1.5)):
        with pytest.raises(HairError):
            Simulation(groom, alone, pose, World(), DEVICE, wetness=wrong)
