# SPDX-License-Identifier: GPL-3.0-or-later
"""Degenerate meshes get the requested number of guides, distributed by area, or one message."""

import warnings

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hair_addon.core.errors import HairError
from hair_addon.core.geometry.faces.connected_components import connected_components
from hair_addon.core.geometry.mesh import TriMesh, check_mesh, positions
from hair_addon.core.geometry.sampling import sample_surface
from hair_addon.core.grooming import groom
from hair_addon.core.grooming.groom import GuideSettings, HairSettings
from hair_addon.core.placement import cvt
from hair_addon.core.placement.domain import Domain, Parts, cut
from tests.support.devices import DEVICE
from tests.support.meshes import flat_grid
from tests.support.strands.evenness import measure
from tests.support.strands.hair import generate_hair

SCALES = (1e-6, 2.0**-7, 1.0, 3.7, 1e6)


def turned(vertices, turn):
    """Return (V, 3) rotated about the axis (1, 1, 1), which preserves no coordinate plane."""
    axis = np.full(3, 3.0**-0.5)
    across = np.cross(axis, vertices)
    return vertices + np.sin(turn) * across + (1.0 - np.cos(turn)) * np.cross(axis, across)


@st.composite
def hard_meshes(draw):
    """Return separate patches of different sizes with duplicate, flipped and degenerate faces, edges of three faces,
    and vertices without faces.
    """
    vertices, triangles, start = [], [], 0
    for patch in range(draw(st.integers(1, 4))):
        grid = flat_grid(draw(st.integers(1, 5)), draw(st.floats(0.2, 3.0)))
        vertices.append(turned(grid.vertices.astype(float), draw(st.floats(0.0, 6.0))) + np.array([10.0 * patch, 0, 0]))
        triangles.append(grid.triangles + start)
        start += len(grid.vertices)
    vertices, triangles = np.concatenate(vertices), np.concatenate(triangles)
    faces = st.integers(0, len(triangles) - 1)
    for kind in draw(st.lists(st.sampled_from(["twice", "round", "point", "line", "fin", "loose"]), max_size=6)):
        face = draw(faces)
        a, b, c = triangles[face]
        if kind == "twice":
            triangles = np.append(triangles, [[b, c, a]], axis=0)
        elif kind == "round":
            triangles[face] = (a, c, b)
        elif kind == "point":
            triangles = np.append(triangles, [[a, a, a]], axis=0)
        elif kind == "line":
            vertices = np.append(vertices, [0.5 * (vertices[a] + vertices[b])], axis=0)
            triangles = np.append(triangles, [[a, b, len(vertices) - 1]], axis=0)
        else:
            vertices = np.append(vertices, [vertices[a] + (0.3, -0.2, 0.1)], axis=0)
            if kind == "fin":
                triangles = np.append(triangles, [[a, b, len(vertices) - 1]], axis=0)
    scale = draw(st.sampled_from(SCALES))
    return TriMesh((scale * vertices).astype(np.float32), triangles.astype(np.int32))


@given(mesh=hard_meshes(), count=st.sampled_from([1, 2, 7, 40, 300]), seed=st.integers(0, 100))
@settings(max_examples=40)
def test_guides_are_shared_out_by_area(mesh, count, seed):
    check_mesh(mesh)
    sites = cvt.place(mesh, count, seed, 4, device=DEVICE)
    assert len(sites) == count
    assert (mesh.areas[sites.triangle] > 0.0).all()
    assert sites.barycentric.min() >= -1e-6 and np.allclose(sites.barycentric.sum(axis=1), 1.0, atol=1e-5)
    number = connected_components(mesh)
    areas = np.bincount(number, weights=mesh.areas)
    found = np.bincount(number[sites.triangle], minlength=len(areas))
    # One random place in each of as many equal shares of the area, islands in a row: two of them may be torn apart.
    np.testing.assert_allclose(found, count * areas / areas.sum(), atol=2.0 + 0.01 * count)


@given(mesh=hard_meshes(), count=st.sampled_from([20, 60, 300]))
@settings(max_examples=12)
def test_guides_are_more_even_than_chance(mesh, count):
    areas = np.bincount(connected_components(mesh), weights=mesh.areas)
    assume(count * areas[areas > 0.0].min() >= 3.0 * areas.sum())  # an island without a guide is uneven either way
    sites = cvt.place(mesh, count, 1, 8, device=DEVICE)
    placed, random = (
        measure(mesh, points, device=DEVICE).relative_energy for points in (sites, sample_surface(mesh, count, 1))
    )
    assert placed < 0.85 * random


@given(mesh=hard_meshes(), power=st.integers(-20, 20))
@settings(max_examples=12)
def test_a_power_of_two_moves_no_root(mesh, power):
    """The roots are bitwise equal; other factors round coordinates, and relaxation amplifies that."""
    scaled = TriMesh(np.float32(2.0**power) * mesh.vertices, mesh.triangles)
    expected, found = (cvt.place(m, 50, 1, 4, device=DEVICE) for m in (mesh, scaled))
    np.testing.assert_array_equal(found.triangle, expected.triangle)
    np.testing.assert_array_equal(found.barycentric, expected.barycentric)


@given(mesh=hard_meshes())
@settings(max_examples=12)
def test_hair_grows_to_its_length(mesh):
    size = float(np.ptp(mesh.vertices, axis=0).max())
    wanted = GuideSettings(guide_count=15, relax_iterations=2, length=0.02 * size, length_variation=0.0)
    guides = groom.distribute_guides(mesh, wanted, device=DEVICE)
    hair = generate_hair(mesh, guides, HairSettings(strand_count=50), device=DEVICE)
    assert (guides.points.shape, hair.points.shape) == ((15, 41), (50, 41))
    lengths = np.linalg.norm(np.diff(guides.numpy(), axis=1), axis=-1).sum(axis=1)
    # The curve of six control points cuts bends, by 17 % where a guide turns back.
    assert (lengths > 0.8 * 0.02 * size).all() and (lengths < 1.1 * 0.02 * size).all()
    np.testing.assert_allclose(guides.numpy()[:, 0], positions(mesh, guides.roots), atol=1e-5 * size)
    assert np.isfinite(hair.numpy()).all()


ODD = [0.0, 1.0, -1.0, 0.5, 1.0 + 1e-6, 1e-6, 1e6, 1e15, -1e15, 1e17, 1e-19, 1e-30, 1e-38, 1e-42]
NOT_FINITE = [np.nan, np.inf, -np.inf]


@given(
    vertices=st.one_of(
        hnp.arrays(np.float32, (6, 3), elements=st.sampled_from(np.float32(numbers).tolist()))
        for numbers in (ODD[:5], ODD[:8], ODD, ODD + NOT_FINITE)
    ),
    triangles=st.one_of(
        hnp.arrays(np.int32, st.tuples(st.integers(1, 5), st.just(3)), elements=st.integers(0, 5)),
        hnp.arrays(np.int32, st.tuples(st.integers(0, 5), st.just(3)), elements=st.integers(-1, 6)),
    ),
    count=st.integers(1, 9),
)
@example(np.float32(1e15) * np.eye(6, 3, dtype=np.float32), np.array([(0, 1, 2)], np.int32), 3)
@example(np.float32(1e-38) * np.eye(6, 3, dtype=np.float32), np.array([(0, 1, 2)], np.int32), 3)
@example(np.float32([(0, 0, 0), (1e-38, 0, 0), (0, 1e-38, 0), (1e15, 0, 0)]), np.array([(0, 1, 2)], np.int32), 3)
@settings(max_examples=40)
def test_any_arrays_grow_guides_or_say_why_not(vertices, triangles, count):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            guides = groom.distribute_guides(
                TriMesh(vertices, triangles), GuideSettings(guide_count=count, relax_iterations=2), device=DEVICE
            )
        except HairError as error:
            assert str(error)
            return
    assert len(guides) == count and np.isfinite(guides.numpy()).all()


def test_vertices_without_faces_have_no_say(square):
    """Vertices without faces have no effect, however far away: used vertices keep their digits."""
    loose = np.append(square.vertices, np.float32([(1e9, -1e9, 5.0), (np.float32(1e14), 0.0, 0.0)]), axis=0)
    expected, found = (cvt.place(mesh, 40, 1, 4, device=DEVICE) for mesh in (square, TriMesh(loose, square.triangles)))
    np.testing.assert_array_equal(found.barycentric, expected.barycentric)


def test_slivers_alone_are_shared_out_soon():
    """Slivers a hundred-thousandth as wide as long soon get guides in rows, without being cut into many pieces."""
    ends = np.array([(0, 0, 0), (1, 0, 0), (1, 1e-5, 0), (0, 1e-5, 0)])
    vertices = np.concatenate([ends + np.array([0.0, 0.1 * strip, 0.0]) for strip in range(4)]).astype(np.float32)
    triangles = np.concatenate([np.array([(0, 1, 2), (0, 2, 3)]) + 4 * strip for strip in range(4)]).astype(np.int32)
    mesh = TriMesh(vertices, triangles)
    assert len(Domain(mesh, 40, device=DEVICE).parts.areas) < 100_000
    places = positions(mesh, cvt.place(mesh, 40, 1, 20, device=DEVICE))
    for strip in range(4):
        row = np.sort(places[np.abs(places[:, 1] - 0.1 * strip) < 0.05, 0])
        assert len(row) == 10 and np.diff(row).min() > 0.09


@pytest.mark.parametrize("width", [1e-6, 1e-3, 4e-3, 0.1])
def test_slivers_are_sliced_and_nothing_of_them_is_lost(width):
    """The number of pieces grows linearly with a sliver's length, not with its power of log 3 / log 2."""
    corners = np.array([[(0, 0, 0), (1, 0, 0), (1, width, 0)], [(0, width, 0), (0, 0, 0), (1, 0.5 * width, 0)]])
    corners = np.concatenate([corners, np.roll(corners, 1, axis=1), np.roll(corners, 2, axis=1)])
    areas = np.full(len(corners), 0.5 * width)
    barycentric = np.broadcast_to(np.eye(3), corners.shape)
    pieces = cut(Parts(np.arange(len(corners)), barycentric, corners, areas), 0.01, lambda parts: 1.0)
    edges = pieces.corners - np.roll(pieces.corners, -1, axis=1)
    assert np.linalg.norm(edges, axis=2).max() <= 0.01 * (1.0 + 1e-9)
    assert len(pieces.areas) < len(corners) * 6 * (100 + width * 1e4)
    exact = 0.5 * np.cross(edges[:, 0], edges[:, 1])[:, 2]
    whole = 0.5 * np.cross(*np.moveaxis(np.diff(corners, axis=1), 1, 0))[:, 2]
    np.testing.assert_allclose(exact, pieces.areas * np.sign(whole)[pieces.triangle], rtol=1e-6, atol=1e-15)
    np.testing.assert_allclose(np.bincount(pieces.triangle, pieces.areas), areas, rtol=1e-9)
    places = np.einsum("qck,qkx->qcx", pieces.barycentric, corners[pieces.triangle])
    np.testing.assert_allclose(places, pieces.corners, atol=1e-12)


@pytest.mark.parametrize("corners", [3, 4, 7, 50])
def test_an_n_gon_is_shared_out_whatever_its_triangles_are(corners):
    """An n-gon gets the same guides whatever its triangles are: a fan from one corner or a wheel around its middle."""
    angles = np.linspace(0.0, 2.0 * np.pi, corners, endpoint=False)
    rim = np.stack([np.cos(angles), np.sin(angles), np.zeros(corners)], axis=1).astype(np.float32)
    fan = TriMesh(rim, np.array([(0, i, i + 1) for i in range(1, corners - 1)], np.int32))
    hub = np.append(rim, np.zeros((1, 3), np.float32), axis=0)
    wheel = TriMesh(hub, np.array([(corners, i, (i + 1) % corners) for i in range(corners)], np.int32))
    qualities = [measure(m, cvt.place(m, 100, 1, 20, device=DEVICE), device=DEVICE) for m in (fan, wheel)]
    energies = [quality.relative_energy for quality in qualities]
    assert max(energies) < 1.12 and abs(energies[0] - energies[1]) < 0.03
