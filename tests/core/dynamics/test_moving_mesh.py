# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides of plain arrays follow a moving mesh."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon import api
from hair_addon.core.dynamics import moving_mesh
from hair_addon.core.dynamics.rod.settings import DynamicsSettings
from hair_addon.core.dynamics.root_motion import RigidMotion
from hair_addon.core.errors import HairError
from tests.support.devices import DEVICE
from tests.support.meshes import subdivided_sphere

BALL = subdivided_sphere(2, 0.1)
NO_GRAVITY = (0.0, 0.0, 0.0)


@pytest.fixture
def guides():
    return api.distribute_guides(BALL, guide_count=20, length=0.06, seed=3)


def simulated(guides, poses, settings, gravity=(0.0, 0.0, -9.81)):
    quick = replace(settings, vertex_count=9)
    return [*moving_mesh.simulated(BALL, guides, poses, quick, 1.0 / 24.0, gravity, DEVICE)]


def turned(angle, way=(0.0, 0.0, 0.0)):
    rotation = np.array([0.0, 0.0, np.sin(angle / 2.0), np.cos(angle / 2.0)])
    return RigidMotion(rotation, np.zeros(3), np.array(way))


def test_the_first_frame_is_the_groom_and_roots_stay_on_the_mesh(guides):
    poses = [np.float32(BALL.vertices * (1.0 + 0.05 * frame) + (0.02 * frame, 0.0, 0.0)) for frame in range(1, 5)]
    frames = simulated(guides, poses, DynamicsSettings())
    assert np.array_equal(frames[0], guides.numpy())
    corners, weights = BALL.triangles[guides.roots.triangle], guides.roots.barycentric
    for vertices, points in zip(poses, frames[1:], strict=True):
        assert points.dtype == np.float32 and points.shape == (20, 41, 3)
        np.testing.assert_allclose(points[:, 0], np.einsum("nc,ncx->nx", weights, vertices[corners]), atol=1e-6)
    assert abs(frames[-1] - frames[-2]).max() > 0.005


def test_without_inertia_guides_move_with_the_mesh(guides):
    settings = DynamicsSettings(inertia=0.0, air_drag=0.0, hair_pressure=0.0)
    motions = [turned(0.1 * frame, (0.01 * frame, 0.0, 0.0)) for frame in range(1, 7)]
    poses = (np.float32(motion.moved(BALL.vertices.astype(np.float64))) for motion in motions)
    frames = simulated(guides, poses, settings, NO_GRAVITY)
    np.testing.assert_allclose(frames[-1], motions[-1].moved(guides.numpy().astype(np.float64)), atol=2e-6)


def test_a_model_of_another_size_moves_as_its_original_does(guides):
    """A model of another size moves as its original does; `size` is the number of its units in a meter."""
    poses = [np.float32(turned(0.0, (0.01 * frame, 0.0, 0.0)).moved(BALL.vertices)) for frame in range(1, 6)]
    settings = DynamicsSettings(cell_size=0.02)
    large = replace(settings, size=0.125, collision_distance=8.0 * settings.collision_distance, cell_size=0.16)
    mesh = replace(BALL, vertices=8.0 * BALL.vertices)
    found = moving_mesh.simulated(
        mesh,
        guides.moved(8.0 * guides.numpy()),
        [8.0 * pose for pose in poses],
        replace(large, vertex_count=9),
        1.0 / 24.0,
        (0.0, 0.0, -9.81),
        DEVICE,
    )
    np.testing.assert_allclose([*found][-1] / 8.0, simulated(guides, poses, settings)[-1], atol=1e-6)


def test_guides_do_not_feel_those_of_another_region(guides):
    """The combing of another region's guides has no effect, except for rounding in sums of mean masses."""
    is_left = guides.numpy()[:, 0, 0] < 0.0
    bent = guides.numpy().copy()
    bent[~is_left] += np.float32([0.0, 0.0, -0.02]) * np.linspace(0.0, 1.0, 41, dtype=np.float32)[:, None]
    motions = [turned(0.2 * frame) for frame in range(1, 5)]
    poses = [np.float32(motion.moved(BALL.vertices.astype(np.float64))) for motion in motions]

    def ends(regions):
        """Return how far guides of the left end differ when the other guides are combed differently."""
        changes = {"regions": regions, "hair_friction": 50.0, "cell_size": 0.2, "vertex_count": 9}
        one, other = (
            [*api.simulate([BALL.vertices, *poses], BALL.triangles, combed, **changes)][-1]
            for combed in (guides, guides.moved(bent))
        )
        return abs(one - other)[is_left].max()

    assert ends(7 * is_left) < 1e-5 < 1e-4 < ends(None)


def test_guides_follow_the_mesh_up_to_their_ties(guides):
    """The part of a guide up to its tie moves with a quick mesh as one piece with it, the rest lags behind."""
    held, along = np.full(20, 0.5), np.linspace(0.0, 1.0, 41)
    motions = [turned(0.15 * frame) for frame in range(1, 5)]
    poses = [BALL.vertices, *(np.float32(motion.moved(BALL.vertices.astype(np.float64))) for motion in motions)]
    rigid = motions[-1].moved(guides.numpy().astype(np.float64))

    def apart(**changes):
        """Return the largest distances (2,) [m] to rigid guides, before and behind the ties."""
        found = [*api.simulate(poses, BALL.triangles, guides, vertex_count=9, bend_stiffness=1e-2, **changes)][-1]
        distances = np.linalg.norm(found - rigid, axis=2)
        return distances[:, along < 0.45].max(), distances[:, along > 0.6].max()

    tied, free, loose = apart(held=held), apart(), apart(held=held, holds_ties=False)
    assert tied[0] < 2e-4 < 1e-3 < tied[1]
    assert free[0] > 1e-3 and free == loose


def test_poses_are_read_as_they_are_asked_for(guides):
    def poses():
        yield BALL.vertices
        yield BALL.vertices[:-1]

    frames = api.simulate(poses(), BALL.triangles, guides)
    next(frames)
    with pytest.raises(HairError, match="Pose 1 must be finite numbers"):
        next(frames)
