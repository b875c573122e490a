# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands of cards, tubes and solid locks run from root to tip inside them."""

import itertools

import numpy as np
import pytest

from hair_addon.core.cards import outlines, tubes
from hair_addon.core.cards.card_settings import TubeSettings
from hair_addon.core.errors import HairError
from hair_addon.core.geometry.closest_point import SurfaceQuery
from hair_addon.core.geometry.curves import curve_frames
from hair_addon.core.geometry.mesh import TriMesh, positions
from hair_addon.core.mesh_hair import piece_strands, ribbon_charts, surface_roots, texture_alpha
from hair_addon.core.mesh_hair.mesh_strand_settings import MeshStrandSettings
from tests.core.cards.conftest import carded, sphere  # noqa: F401
from tests.support.meshes import flat_grid

FLOOR = TriMesh(
    np.array([(-5, -5, 0), (5, -5, 0), (5, 5, 0), (-5, 5, 0)], np.float32), np.array([(0, 1, 2), (0, 2, 3)], np.int32)
)
WIDTH = 0.02


def curve(count=9, base=(0.0, 0.0, 0.0)):
    """Return points (count + 1, 3) of a curve that rises from the floor."""
    s = np.linspace(0.0, 1.0, count + 1) ** 1.3  # uneven segments
    return np.stack([0.1 * np.sin(3.0 * s), 0.05 * s**2, 0.3 * s], axis=1) + base


def shifted(x=0.0, y=0.0, z=0.0):
    return curve(9, (x, y, z))


def card(columns=1, points=None, widths=WIDTH):
    """Return a `TriMesh` and its corners' UV coordinates (F, 3, 2); V is 0 at the root."""
    points = curve() if points is None else points
    across = np.linspace(-0.5, 0.5, columns + 1)[None, :, None]
    side = np.array([np.cos(0.3), np.sin(0.3), 0.0])
    widths = np.broadcast_to(widths, len(points))[:, None, None]
    vertices = (points[:, None] + across * widths * side).reshape(-1, 3)
    rows, places = np.meshgrid(np.arange(len(points) - 1), np.arange(columns), indexing="ij")
    first = (rows * (columns + 1) + places).ravel()
    quads = np.stack([first, first + 1, first + columns + 2, first + columns + 1], axis=1)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    uv = np.stack(np.meshgrid(np.linspace(0, 0.2, columns + 1), np.linspace(0, 1, len(points))), axis=-1).reshape(-1, 2)
    return TriMesh(vertices.astype(np.float32), triangles.astype(np.int32)), uv[triangles]


def joined(*meshes):
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    return TriMesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.triangles + start for mesh, start in zip(meshes, starts, strict=False)]).astype(np.int32),
    )


def made(mesh, surface=FLOOR, uvs=None, **settings):
    return piece_strands.mesh_strands(mesh, surface, MeshStrandSettings(**settings), uvs)


def strands_of(found):
    return np.split(found.points, found.starts[1:-1])


def triangulated(mesh):
    faces = np.split(mesh.faces.corner_vertices, mesh.faces.starts[1:-1])
    found = [(face[0], *pair) for face in faces for pair in itertools.pairwise(face[1:])]
    return TriMesh(mesh.vertices, np.array(found, np.int32))


@pytest.mark.parametrize("columns", [1, 2, 4])
def test_the_middle_of_a_card_is_the_curve_that_it_was_made_of(rng, columns):
    """The strand in the middle of a card is the card's curve, in any order of its vertices and faces."""
    mesh, _ = card(columns)
    order = rng.permutation(len(mesh.vertices))
    mesh = TriMesh(mesh.vertices[order], np.argsort(order)[mesh.triangles][:, ::-1].astype(np.int32))
    mesh = TriMesh(mesh.vertices, rng.permutation(mesh.triangles))
    found = made(mesh, strand_count=1)
    np.testing.assert_allclose(found.points, curve(), atol=1e-6)
    np.testing.assert_allclose(found.radii, WIDTH / 2.0, rtol=1e-4)


def test_strands_keep_their_place_across_a_card():
    """Strands of a card do not cross, fill its width, and are inside of it."""
    mesh, _ = card(3)
    found = made(mesh, strand_count=20)
    near = positions(mesh, SurfaceQuery(mesh).nearest(found.points))
    np.testing.assert_allclose(found.points, near, atol=1e-7)
    side = np.array([np.cos(0.3), np.sin(0.3), 0.0])
    across = np.stack([(points - curve()) @ side for points in strands_of(found)])
    assert (np.diff(across, axis=0) > 0.0).all() or (np.diff(across, axis=0) < 0.0).all()
    assert np.ptp(across, axis=0).min() > 0.85 * WIDTH
    np.testing.assert_allclose(positions(mesh, found.places), found.points, atol=1e-6)


def test_cards_of_strands_become_strands_within_the_width_of_their_cards(carded):  # noqa: F811
    """Cards of clumps of hair give strands that are as near to the strands of their clump as the card is wide, and that
    begin where the clump begins.
    """
    axes, found = carded.axes, carded.outlines
    count, places = axes.centres.shape[:2]
    mesh = triangulated(outlines.ribbon_mesh(axes, found, np.zeros((count, places, 2, 2)), np.zeros((count, places))))
    back = made(mesh, sphere(), strand_count=5 * count)
    assert (back.piece_count, back.skipped_count) == (count, 0)
    width = (found.high - found.low).max(axis=1)
    for points, piece in zip(strands_of(back), back.pieces, strict=True):
        # Pieces are in the order of their first vertex, as the cards are.
        own = carded.points[carded.labels == piece].reshape(-1, 3)
        apart = np.linalg.norm(points[:, None] - own[None], axis=-1).min(axis=1)
        assert apart.max() < 1.5 * width[piece] + 0.002
        assert np.linalg.norm(points[0]) < np.linalg.norm(points[-1])


@pytest.mark.parametrize("sides", [3, 6])
def test_tubes_of_strands_become_the_strands(sides):
    """Closed tubes of strands give the strands and their radii, if there are as many strands as tubes."""
    lines = np.stack([curve(19, (0.05 * place, 0.0, 0.0)) for place in range(4)])
    radii = np.linspace(4e-3, 2e-3, 20)
    settings = TubeSettings(tube_count=0, side_count=sides, point_count=20)
    mesh = tubes.tubes(lines.astype(np.float32), np.tile(radii, (4, 1)), settings)
    found = made(triangulated(mesh), strand_count=4)
    expected = curve_frames.resample_by_curvature(lines, 20)
    np.testing.assert_allclose(found.points.reshape(4, 20, 3), expected, atol=1e-6)
    rings = np.linalg.norm(mesh.vertices.reshape(4, 20, sides, 3) - expected[:, :, None], axis=-1).mean(axis=2)
    if sides == 6:
        np.testing.assert_allclose(found.radii.reshape(4, 20), rings, rtol=0.1)
    several = made(triangulated(mesh), strand_count=40)
    apart = np.linalg.norm(several.points.reshape(4, 10, 20, 3) - expected[:, None], axis=-1)
    assert (apart <= 1.001 * rings[:, None]).all() and apart.max() > 0.6 * rings.max()


@pytest.mark.parametrize("sides", [3, 6])
def test_strands_of_a_tube_stay_between_its_flat_sides(sides):
    """Sections are polygons with the sides of the tube: strands fill them, and none is outside."""
    straight = np.stack([np.zeros(9), np.zeros(9), np.linspace(0.0, 0.3, 9)], axis=1)[None].astype(np.float32)
    settings = TubeSettings(tube_count=0, side_count=sides, point_count=9)
    mesh = tubes.tubes(straight, np.full((1, 9), 0.01), settings)
    ring = mesh.vertices.reshape(9, sides, 3)[4, :, :2].astype(np.float64)
    found = made(triangulated(mesh), strand_count=60)
    middle = 0.5 * (ring + np.roll(ring, -1, axis=0))
    heights = np.linalg.norm(middle, axis=1)
    reach = found.points[:, :2] @ (middle / heights[:, None]).T / heights
    assert (reach.max(axis=0) > 0.75).all() and reach.max() < 1.02


@pytest.mark.parametrize("has_fans", [False, True])
def test_strands_that_fill_a_tube_have_its_outline(has_fans):
    """Seen from aside, strands that fill a closed tube cover it from rim to rim and end to end, and little beside it.

    With fans of triangles as caps, whose middles are on no ring, as with ends of many sides.
    """
    straight = np.stack([np.zeros(9), np.zeros(9), np.linspace(0.1, 0.4, 9)], axis=1)[None].astype(np.float32)
    mesh = triangulated(
        tubes.tubes(straight, np.full((1, 9), 0.01), TubeSettings(tube_count=0, side_count=12, point_count=9))
    )
    plain = made(mesh, strand_count=40, fills=True)
    if has_fans:
        is_cap = np.ptp(mesh.vertices[mesh.triangles][:, :, 2], axis=1) < 1e-6
        middles = np.float32([straight[0, 0], straight[0, -1]])
        sides = [np.arange(12) + first for first in (0, 96)]
        fans = [
            np.stack([np.full(12, 108 + end), *((rim, np.roll(rim, -1)) if end else (np.roll(rim, -1), rim))], axis=1)
            for end, rim in enumerate(sides)
        ]
        mesh = TriMesh(
            np.concatenate([mesh.vertices, middles]), np.concatenate([mesh.triangles[~is_cap], *fans]).astype(np.int32)
        )
    found = made(mesh, strand_count=40, fills=True)
    np.testing.assert_allclose(found.points, plain.points, atol=1e-6)  # of the same rings
    for row in (found.starts[:-1], found.starts[1:] - 1):
        assert np.ptp(found.points[row, 2]) < 1e-6
    at_ends = found.points[[0, found.starts[1] - 1], 2]
    np.testing.assert_allclose(at_ends, [0.1, 0.4], atol=1e-4)
    for direction in np.arange(12) * (np.pi / 6.0):
        aside = found.points[found.starts[:-1] + 4, :2] @ [np.cos(direction), np.sin(direction)]
        low, high = np.sort(aside - found.radii[4]), np.sort(aside + found.radii[4])
        assert np.all(low[1:] < np.maximum.accumulate(high)[:-1])  # without a gap
        assert 0.0092 < high.max() < 0.0108


def test_the_axis_of_a_solid_lock_runs_from_the_surface_to_its_tip():
    """A long ellipsoid without rings gives strands inside of it, from its end at the surface to its other end."""
    ball = sphere(1.0)
    turned = ball.vertices @ np.array([(0.0, 0.0, 1.0), (0.6, 0.8, 0.0), (-0.8, 0.6, 0.0)], np.float32)
    mesh = TriMesh((turned * (0.02, 0.01, 0.15) + (0.0, 0.0, 0.15)).astype(np.float32), ball.triangles)
    middle, several = made(mesh, strand_count=1), made(mesh, strand_count=30)
    assert np.linalg.norm(middle.points[[0, -1]] - [(0, 0, 0), (0, 0, 0.3)], axis=1).max() < 0.02
    assert (np.diff(middle.points[:, 2]) > 0.0).all() and np.abs(middle.points[:, :2]).max() < 0.006
    inside = (((several.points - (0.0, 0.0, 0.15)) / (0.02, 0.01, 0.15)) ** 2).sum(axis=1)
    assert inside.max() < 1.02 and len(several.counts) == 30


@pytest.mark.parametrize("widths", [0.0, np.linspace(WIDTH, 0.0, 10), WIDTH * np.sin(np.linspace(0.0, np.pi, 10))])
def test_pointed_cards_have_strands_that_meet_at_their_ends(widths):
    if not np.any(widths):
        with pytest.raises(HairError, match="no faces with an area"):
            made(card(1, widths=widths)[0])
        return
    found = made(card(1, widths=widths)[0], strand_count=5)
    lines = np.stack(strands_of(found))
    assert (found.piece_count, len(found.counts)) == (1, 5)
    np.testing.assert_allclose(lines[:, -1], np.tile(curve()[-1], (5, 1)), atol=1e-6)
    assert (lines[:, 0, 2] < 1e-6).all()


def test_roots_are_at_the_surface_or_as_the_uv_map_says():
    """The end near the surface is the root, whatever the UV map says; or the end with the low or the high V."""
    mesh, uvs = card()
    for upside_down in (False, True):
        uv = 1.0 - uvs if upside_down else uvs
        assert made(mesh, uvs=uv, strand_count=1).points[0, 2] < 1e-6
        low = made(mesh, uvs=uv, strand_count=1, root_end="LOW_V").points[0, 2]
        high = made(mesh, uvs=uv, strand_count=1, root_end="HIGH_V").points[0, 2]
        assert (low > 0.2, high > 0.2) == (upside_down, not upside_down)
    with pytest.raises(HairError, match="no UV map"):
        made(mesh, root_end="LOW_V")


@pytest.mark.parametrize("height", [-0.05, 0.01])
def test_strands_begin_on_the_surface(height):
    """Strands that begin below the surface are cut there, strands that begin above it are extended; tips stay."""
    mesh, _ = card(1, shifted(z=height))
    before = made(mesh, strand_count=6)
    found = surface_roots.on_surface(before, FLOOR)
    roots, tips = found.points[found.starts[:-1]], found.points[found.starts[1:] - 1]
    np.testing.assert_allclose(roots[:, 2], 0.0, atol=1e-7)
    np.testing.assert_array_equal(tips, before.points[before.starts[1:] - 1])
    assert all((points[1:, 2] > 0.0).all() for points in strands_of(found))
    assert len(found.radii) == len(found.points) == found.counts.sum() == len(found.places)
    far = made(card(1, shifted(z=1.0))[0], strand_count=6)
    np.testing.assert_array_equal(surface_roots.on_surface(far, FLOOR).points, far.points)


def test_strands_begin_on_a_surface_with_normals_inward():
    """The same surface with normals inward cuts and extends strands at the same places."""
    ball = sphere()
    inward = TriMesh(ball.vertices, ball.triangles[:, ::-1].copy())
    top = float(ball.vertices[:, 2].max())
    mesh = card(1, curve(9, (0.0, 0.0, top - 0.1)))[0]
    expected = surface_roots.on_surface(made(mesh, ball, strand_count=5), ball)
    found = surface_roots.on_surface(made(mesh, ball, strand_count=5), inward)
    assert not np.array_equal(expected.counts, made(mesh, ball, strand_count=5).counts)
    np.testing.assert_array_equal(found.counts, expected.counts)
    np.testing.assert_allclose(found.points, expected.points, atol=1e-5)


def test_strands_end_where_the_texture_ends():
    """Strands end where the texture does, also between two points; strands without opaque points are left out."""
    mesh = card(3)[0]
    found = made(mesh, strand_count=10)
    points = np.stack(strands_of(found))
    end = 0.5 * (points[0, 4, 2] + points[0, 5, 2])

    def alpha_at(places):
        heights = np.einsum("nc,nc->n", mesh.vertices[mesh.triangles[places.triangle], 2], places.barycentric)
        return (heights < end).astype(float)

    alpha = alpha_at(found.places).reshape(10, -1)
    alpha[3:5] = 0.0
    ended = texture_alpha.shown(found, alpha.ravel(), alpha_at, mesh)
    assert len(ended.counts) == 8
    step = points[0, 5, 2] - points[0, 4, 2]
    np.testing.assert_allclose(ended.points[ended.starts[1:] - 1, 2], end, atol=0.15 * step)
    with pytest.raises(HairError, match="transparent"):
        texture_alpha.shown(found, np.zeros(len(found.points)), alpha_at, mesh)


def test_cards_share_strands_by_their_area():
    narrow, wide = card()[0], card(1, shifted(1.0), 3.0 * WIDTH)[0]
    counts = np.bincount(made(joined(narrow, wide), strand_count=400).pieces)
    np.testing.assert_allclose(counts, [100, 300], atol=1)
    assert counts.sum() == 400
    assert np.bincount(made(joined(narrow, wide), strand_count=1).pieces).tolist() == [1, 1]


def test_crossed_and_two_sided_cards_are_separate_strips():
    """Cards that cross at a common edge, share vertices, or have a back side, are strips of their own."""
    first = card()[0]
    # Three strips meet at the left edge of the first.
    left = first.vertices[::2]
    beside = [left + np.float32([0.0, y, 0.0]) for y in (-0.02, 0.02)]
    others = [TriMesh(np.stack([left, edge], axis=1).reshape(-1, 3), first.triangles) for edge in beside]
    assert made(joined(first, *others), strand_count=9).piece_count == 3
    two_sided = joined(first, TriMesh(first.vertices, first.triangles[:, ::-1]))
    np.testing.assert_allclose(made(two_sided, strand_count=1).points, curve(), atol=1e-6)


@pytest.mark.parametrize("scale", [0.01, 100.0])
def test_strands_scale_with_the_mesh(scale):
    mesh, floor = card(2)[0], TriMesh(FLOOR.vertices * np.float32(scale), FLOOR.triangles)
    scaled = made(TriMesh(mesh.vertices * np.float32(scale), mesh.triangles), floor, strand_count=7)
    found = made(mesh, strand_count=7)
    np.testing.assert_allclose(scaled.points, found.points * scale, atol=1e-6 * scale)
    np.testing.assert_allclose(scaled.radii, found.radii * scale, rtol=1e-4)


def test_places_of_a_large_grid_need_no_solution(monkeypatch):
    """Numbers of edges to opposite sides are the places of a grid, so that solving for means of neighbors ends at once.

    Places between curved sides are means of their neighbors too.
    """
    grid = flat_grid(64)
    edges = np.unique(np.sort(grid.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    is_inner = ((grid.vertices[:, :2] > 0.0) & (grid.vertices[:, :2] < 1.0)).all(axis=1)
    places = grid.vertices[:, :2].astype(np.float64)
    start = ribbon_charts._places_between(np.concatenate([edges, edges[:, ::-1]]), is_inner, places)
    np.testing.assert_allclose(start[is_inner], places[is_inner], atol=1e-12)
    sums_made, bincount = [], np.bincount
    with monkeypatch.context() as patch:
        patch.setattr(np, "bincount", lambda *given, **options: sums_made.append(1) or bincount(*given, **options))
        np.testing.assert_allclose(ribbon_charts._relaxed(edges, is_inner, places), places, atol=1e-12)
    assert len(sums_made) < 8
    bent = places**1.3
    found = ribbon_charts._relaxed(edges, is_inner, bent)
    sums, counts = np.zeros_like(found), np.zeros((len(found), 1))
    for first, second in (edges.T, edges.T[::-1]):
        np.add.at(sums, first, found[second])
        np.add.at(counts, first, 1.0)
    np.testing.assert_allclose((sums / counts)[is_inner], found[is_inner], atol=1e-8)
    np.testing.assert_array_equal(found[~is_inner], bent[~is_inner])


def test_a_sculpted_lock_may_have_more_triangles_than_a_body_beside_cards():
    """A lock of 25,000 triangles becomes strands inside of it if it is alone; beside smaller parts it is left out."""
    rings, sides = 201, 63
    heights, angles = np.linspace(0.0, 1.0, rings)[:, None], np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    radii = 0.02 + 0.06 * np.sin(np.pi * heights)
    around = [radii * np.cos(angles), radii * np.sin(angles), heights + 0.0 * angles]
    first = sides * np.arange(rings - 1)[:, None] + np.arange(sides)
    after = sides * np.arange(rings - 1)[:, None] + (np.arange(sides) + 1) % sides
    faces = [(first, after, after + sides), (first, after + sides, first + sides)]
    triangles = np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in faces]).astype(np.int32)
    lock = TriMesh(np.stack(around, axis=-1).reshape(-1, 3).astype(np.float32), triangles)
    found = made(lock, strand_count=9)
    assert len(triangles) > 25_000 and (found.piece_count, found.skipped_count) == (1, 0)
    limits = 0.02 + 0.06 * np.sin(np.pi * found.points[:, 2])
    assert (np.linalg.norm(found.points[:, :2], axis=1) < limits + 0.002).all()
    ends = [(strand[0, 2], strand[-1, 2]) for strand in strands_of(found)]
    assert np.max(ends, axis=0)[0] < 0.1 and np.min(ends, axis=0)[1] > 0.9
    beside = made(joined(card()[0], lock), strand_count=10)
    assert (beside.piece_count, beside.skipped_count) == (1, 1)


def test_meshes_that_are_not_hair_are_refused_with_one_sentence():
    ball = sphere()
    for mesh, sentence in [
        (ball, "no cards, tubes or slender locks"),
        (TriMesh(ball.vertices, np.zeros((0, 3), np.int32)), "no faces"),
        (TriMesh(ball.vertices * np.float32(np.nan), ball.triangles), "finite"),
        (TriMesh(ball.vertices, np.zeros((2_000_001, 3), np.int32)), "2000001 triangles"),
    ]:
        with pytest.raises(HairError, match=sentence) as refused:
            made(mesh)
        assert str(refused.value).count(".") == 1
    found = made(joined(card()[0], ball), strand_count=10)
    assert (found.piece_count, found.skipped_count) == (1, 1)
