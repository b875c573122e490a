# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands deformed on the GPU equal those deformed by Warp, and a pose uploads only vertices."""

import gpu
import numpy as np
import pytest

from hair_addon.blender.gpu import strand_textures
from hair_addon.blender.gpu.strands import strand_carrier
from hair_addon.core.errors import HairError
from hair_addon.core.geometry import surface_deform, vertex_turns
from hair_addon.core.geometry.mesh import Faces
from tests.support.pictures import drawn_strands

SIDE, STRANDS, POINTS = 9, 700, 7
CLOSE = 4e-6  # [m] beside places of 1 m


def sheet():
    """Return (V, 3) vertices and `Faces` of a sheet of quads, 1 m wide."""
    along = np.linspace(0.0, 1.0, SIDE, dtype=np.float32)
    x, y = np.meshgrid(along, along)
    first = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).ravel()
    corners = np.stack([first, first + 1, first + SIDE + 1, first + SIDE], axis=1)
    faces = Faces(corners.ravel().astype(np.int32), np.arange(0, corners.size + 1, 4, dtype=np.int32))
    return np.stack([x, y, 0.0 * x], axis=-1).reshape(-1, 3), faces


@pytest.fixture
def rooted(rng):
    """Return (vertices, faces, places, points) of strands all over a sheet."""
    vertices, faces = sheet()
    quads = faces.corner_vertices.reshape(-1, 4)[rng.integers(0, (SIDE - 1) ** 2, STRANDS)]
    barycentric = rng.dirichlet(np.ones(3), STRANDS).astype(np.float32)
    roots = (barycentric[:, :, None] * vertices[quads[:, :3]]).sum(axis=1)
    steps = 0.02 * rng.normal(size=(STRANDS, POINTS - 1, 3)) + [0.0, 0.0, 0.05]
    points = roots[:, None] + np.pad(np.cumsum(steps, axis=1), ((0, 0), (1, 0), (0, 0)))
    return vertices, faces, (np.ascontiguousarray(quads[:, :3]), barycentric), np.float32(points)


def bent(vertices, amount):
    """Return vertices that are rolled up where x is above a half, and unchanged elsewhere."""
    angle = amount * np.maximum(vertices[:, 0] - 0.5, 0.0)
    moved = vertices.copy()
    far = angle > 0.0
    moved[far, 0] = 0.5 + np.sin(angle[far]) / amount
    moved[far, 2] = (1.0 - np.cos(angle[far])) / amount
    return moved


def uploaded(points):
    radii = np.broadcast_to(np.linspace(2e-4, 1e-5, points.shape[1], dtype=np.float32), points.shape[:2])
    return strand_textures.upload_strands(points, radii)


def carrier_of(rooted):
    vertices, faces, places, points = rooted
    turning = vertex_turns.turning(vertices, faces, places[0])
    return strand_carrier.new_carrier(uploaded(points).texture, POINTS, places, vertices, turning)


def test_strands_are_where_warp_carries_them(blender, rooted):
    vertices, faces, places, points = rooted
    carrier, strands = carrier_of(rooted), uploaded(np.zeros_like(points))
    for amount in (2.0, 5.0):
        motion = surface_deform.motion(vertices, bent(vertices, amount), faces)
        strands = carrier.carry(strands, motion.after)
        wanted = surface_deform.carry(points, motion, *places)
        found = drawn_strands.places(strands)
        np.testing.assert_allclose(found, wanted, rtol=0.0, atol=CLOSE)
        still = (motion.after == vertices).all(axis=1) & (motion.axes == np.eye(3)[:2]).all(axis=(1, 2))
        is_still = still[places[0]].all(axis=1)
        assert 0.1 < is_still.mean() < 0.9
        np.testing.assert_array_equal(found[is_still], drawn_strands.places(uploaded(points))[is_still])
        corners = found.reshape(-1, 3)
        np.testing.assert_allclose(strands.box.exact, [corners.min(axis=0), corners.max(axis=0)], rtol=0.0, atol=CLOSE)


def test_strands_that_begin_apart_from_their_places_are_carried_to_these(blender, rooted):
    """Strands whose first points are apart from their places, as on a cage, are carried with these places."""
    vertices, faces, places, points = rooted
    slides = np.random.default_rng(3).normal(scale=0.02, size=(len(points), 3)).astype(np.float32)
    slides[::3] = 0.0
    turning = vertex_turns.turning(vertices, faces, places[0])
    given = uploaded(points).texture, POINTS, places, vertices, turning
    carrier, motion = (
        strand_carrier.new_carrier(*given, slides),
        surface_deform.motion(vertices, bent(vertices, 3.0), faces),
    )
    strands = carrier.carry(uploaded(points), motion.after)
    wanted = surface_deform.carry(points + slides[:, None], motion, *places)
    np.testing.assert_allclose(drawn_strands.places(strands), wanted, rtol=0.0, atol=CLOSE)
    strands = carrier.carry(strands, None)
    np.testing.assert_array_equal(drawn_strands.places(strands), drawn_strands.places(uploaded(points)))


def test_at_rest_strands_are_the_same_bits(blender, rooted):
    vertices, _faces, _places, points = rooted
    carrier = carrier_of(rooted)
    strands = carrier.carry(uploaded(points), bent(vertices, 3.0))
    before = drawn_strands.places(strands)
    strands = carrier.carry(strands, None)
    np.testing.assert_array_equal(drawn_strands.places(strands), drawn_strands.places(uploaded(points)))
    np.testing.assert_array_equal(drawn_strands.places_before(strands, STRANDS), before)
    assert strands.moved.turn == 2


def test_a_pose_uploads_places_around_roots_and_nothing_else(blender, rooted, monkeypatch):
    vertices, faces, places, points = rooted
    near = points[:, 0, 0] < 0.4
    some, moved = tuple(part[near] for part in places), bent(vertices, 3.0)
    turning = vertex_turns.turning(vertices, faces, some[0])
    carrier = strand_carrier.new_carrier(uploaded(points[near]).texture, POINTS, some, vertices, turning)
    strands, sent = carrier.carry(uploaded(points[near]), moved), []
    buffer = gpu.types.Buffer
    monkeypatch.setattr(gpu.types, "Buffer", lambda kind, size, values: sent.append(size) or buffer(kind, size, values))
    for turn in range(3):
        strands = carrier.carry(strands, bent(vertices, 3.5 + 0.5 * turn))
    assert vertices[turning.needed, 0].max() <= 0.4 + 2.0 / (SIDE - 1)  # those of the faces around corners of roots
    assert sent == [3 * len(turning.needed)] * 3


def test_another_surface_is_refused(blender, rooted):
    vertices, faces, places, points = rooted
    carrier, turning = carrier_of(rooted), vertex_turns.turning(vertices, faces)
    with pytest.raises(HairError, match="vertices"):
        carrier.carry(uploaded(points), vertices[1:])
    with pytest.raises(HairError, match="vertices"):
        strand_carrier.new_carrier(uploaded(points).texture, POINTS, places, vertices[:-1], turning)
    few = vertex_turns.turning(vertices, faces, places[0][:5])
    with pytest.raises(HairError, match="vertices"):
        strand_carrier.new_carrier(uploaded(points).texture, POINTS, places, vertices, few)
