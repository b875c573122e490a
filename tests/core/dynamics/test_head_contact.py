# SPDX-License-Identifier: GPL-3.0-or-later
"""V12 on the sample head, with its ears: hair that is shaken stays outside, and as long as it is."""

import numpy as np
import pytest

from hair_addon.core.dynamics import rotations
from hair_addon.core.dynamics.root_motion import RigidMotion, RootPose
from hair_addon.core.dynamics.settings import DynamicsSettings
from hair_addon.core.dynamics.simulation import Obstacle, Simulation, World
from hair_addon.core.geometry.closest_point import SurfaceQuery
from hair_addon.core.geometry.mesh import TriMesh
from tests.support.devices import DEVICE
from tests.support.meshes import HEAD, read_obj, split_in_four

FRAME = 1.0 / 24.0  # [s]
KEEP = 1e-3  # [m]
NECK = np.array([0.0, -0.04, 0.72])


@pytest.fixture(scope="module")
def head():
    """34,080 triangles."""
    return split_in_four(read_obj(HEAD))


def grown(mesh, count=96, length=0.2):
    """(count, 41, 3): straight guides from the upper part of the head, outwards and a little down."""
    rng = np.random.default_rng(0)
    corners = mesh.corners.astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sizes = np.linalg.norm(normals, axis=1)
    back = np.clip((corners[..., 1].mean(axis=1) + 0.08) / 0.08, 0.0, 1.0)  # of the head: there hair grows lower
    is_scalp = corners[..., 2].min(axis=1) > 0.80 - 0.10 * back
    faces = rng.choice(np.flatnonzero(is_scalp), count, p=(sizes / sizes[is_scalp].sum())[is_scalp])
    roots = np.einsum("gk,gki->gi", rng.dirichlet(np.ones(3), count), corners[faces])
    ways = normals[faces] / sizes[faces, None] - [0.0, 0.0, 0.3]
    return roots[:, None] + length * np.linspace(0.0, 1.0, 41)[:, None] * rotations.unit(ways)[:, None]


def shake(frame):
    """70° to either side at 1.5 Hz, 660°/s, and 5 cm at 3 Hz."""
    half = 0.5 * np.radians(70.0) * np.sin(3.0 * np.pi * frame * FRAME)
    way = np.array([0.05 * np.sin(6.0 * np.pi * frame * FRAME), 0.0, 0.0])
    return RigidMotion(np.array([0.0, 0.0, np.sin(half), np.cos(half)]), NECK, way)


@pytest.mark.gate(id="V12")
def test_hair_on_a_shaken_head_stays_outside_and_whole(head):
    """No vertex nearer than its distance by a micrometre, no segment 3 % longer, and none put back."""
    guides, vertices = grown(head), head.vertices.astype(np.float64)
    at_rest = RootPose(guides[:, 0], np.tile(rotations.IDENTITY, (len(guides), 1)))
    settings = DynamicsSettings(
        substeps=8, automatic_substeps=False, bend_stiffness=1.0, hair_friction=0.0, hair_pressure=0.0
    )

    def world(motion=None):
        return World(
            obstacles=(Obstacle("Head", vertices if motion is None else motion.moved(vertices), head.triangles),)
        )

    def distances(points, motion=None):
        mesh = head if motion is None else TriMesh(motion.moved(vertices).astype(np.float32), head.triangles)
        places = points[:, 1:].reshape(-1, 3)
        found = SurfaceQuery(mesh).nearest(places)
        nearest = np.einsum("nk,nki->ni", found.barycentric, mesh.corners[found.triangle])
        return np.linalg.norm(places - nearest, axis=1).reshape(len(points), -1)

    simulation = Simulation(guides, settings, at_rest, world(), DEVICE)
    kept = np.minimum(distances(simulation.vertices()), KEEP)
    touching = 0
    for frame in range(1, 25):
        motion = shake(frame)
        simulation.advance(at_rest.moved(motion), world(motion), FRAME)
        apart = distances(simulation.vertices(), motion) - kept
        assert apart.min() > -1e-6
        assert abs(simulation.stretch()).max() < 0.03 and not len(simulation.broken)
        touching += np.count_nonzero(apart < 1e-5)
    assert touching > 24 * 100
