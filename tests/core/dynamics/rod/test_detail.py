# SPDX-License-Identifier: GPL-3.0-or-later
"""Combed guides are converted to simulated vertices and back."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hair_addon.core.dynamics.rod import detail, rotations
from hair_addon.core.dynamics.rod.material import material_of
from hair_addon.core.dynamics.rod.rods import Rods, combed_shape
from hair_addon.core.dynamics.rod.settings import DynamicsSettings
from hair_addon.core.errors import HairError
from tests.support.devices import DEVICE

LENGTH = 0.15
TURN = Rotation.from_rotvec([0.3, -0.8, 0.4])


def combed(turns):
    """Return (41, 3): an arc with coils about it."""
    s = np.linspace(0.0, 1.0, 41)
    angle = 2.0 * np.pi * turns * s
    coil = [LENGTH * s, 0.006 * np.sin(angle) + 0.03 * s**2, 0.006 * (1.0 - np.cos(angle)) - 0.05 * s**2]
    return np.stack(coil, axis=-1)


@pytest.fixture(params=[13, 25, 33])
def guides(request):
    points = np.array([combed(turns) for turns in (0, 3, 6)], np.float32)
    vertices = detail.vertices_of(points, request.param)
    rest = combed_shape(vertices)
    rods = Rods(vertices, material_of(DynamicsSettings(), rest.lengths), rest, DEVICE)
    return points, vertices, rods, detail.detail_of(points, rods)


def put(rods, vertices, frames):
    """Place rods without simulation."""
    state = rods.save()
    state["positions"] = vertices.reshape(len(vertices), -1).astype(np.float32)
    state["frames"] = frames.reshape(len(vertices), -1).astype(np.float32)
    rods.load(state)


def turned(rotation, vectors):
    return rotation.apply(vectors.reshape(-1, 3)).reshape(vectors.shape)


def test_vertices_are_even(guides):
    points, vertices, _rods, _left = guides
    sizes = np.linalg.norm(np.diff(vertices, axis=1), axis=2)
    assert np.ptp(sizes[0]) < 0.02 * sizes[0].mean()
    np.testing.assert_allclose(vertices[:, [0, -1]], points[:, [0, -1]], atol=1e-7)


@pytest.mark.gate(id="V18")
def test_a_guide_at_rest_is_the_combed_one(guides):
    points, _vertices, rods, left = guides
    assert abs(detail.detailed_points(left, rods).numpy() - points).max() < 1e-6 * LENGTH


@pytest.mark.gate(id="V18")
def test_rigid_motion_is_exact(guides):
    points, vertices, rods, left = guides
    frames = rotations.product(TURN.as_quat(), combed_shape(vertices).frames)
    put(rods, turned(TURN, vertices) + 0.2, frames)
    expected = turned(TURN, points.astype(float)) + 0.2
    assert abs(detail.detailed_points(left, rods).numpy() - expected).max() < 1e-5 * LENGTH


@pytest.mark.gate(id="V18")
def test_bent_curls_keep_their_length(guides):
    """Curls keep their length on a rod that bends by a right angle."""
    points, vertices, rods, left = guides
    if vertices.shape[1] < 25:
        return  # six coils need more
    angles = np.linspace(0.0, np.pi / 2.0, vertices.shape[1] - 1)
    bend = Rotation.from_rotvec(angles[:, None] * [0.0, 1.0, 0.0])
    segments = np.array([bend.apply(strand) for strand in np.diff(vertices, axis=1)])
    bent = np.concatenate([vertices[:, :1], vertices[:, :1] + np.cumsum(segments, axis=1)], axis=1)
    put(rods, bent, rotations.product(bend.as_quat(), combed_shape(vertices).frames))

    def lengths(strands):
        return np.linalg.norm(np.diff(strands.astype(float), axis=1), axis=2).sum(axis=1)

    found = lengths(detail.detailed_points(left, rods).numpy())
    np.testing.assert_allclose(found, lengths(points), rtol=1e-3)


def test_guides_without_length_and_those_that_turn_back_are_simulated():
    there_and_back = combed(0)
    there_and_back[21:] = there_and_back[20::-1][:20]
    points = np.array([np.zeros((41, 3)), there_and_back, combed(3)], np.float32)
    vertices = detail.vertices_of(points, 25)
    assert np.linalg.norm(np.diff(vertices, axis=1), axis=2).min() > 1e-5
    rest = combed_shape(vertices)
    rods = Rods(vertices, material_of(DynamicsSettings(), rest.lengths), rest, DEVICE)
    left = detail.detail_of(points, rods)
    assert abs(detail.detailed_points(left, rods).numpy() - points).max() < 1e-6 * LENGTH


def test_guides_of_other_rods_are_refused(guides):
    points, _vertices, rods, _left = guides
    with pytest.raises(HairError):
        detail.detail_of(points[:2], rods)
