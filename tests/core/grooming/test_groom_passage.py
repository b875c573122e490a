# SPDX-License-Identifier: GPL-3.0-or-later
"""A saved groom is placed exactly on a copy, by matching UV maps, or by the nearest surface."""

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.files import library_settings
from hair_addon.core.files.settings_file import GroomSettings
from hair_addon.core.geometry.mesh import SurfacePoints, TriMesh, positions
from hair_addon.core.grooming.groom import GuideSettings, HairSettings
from hair_addon.core.grooming.groom_passage import aside_count, carried_weights, passage
from hair_addon.core.grooming.groom_transfer import TransferSurface
from hair_addon.core.maps.map_settings import MapSettings
from hair_addon.core.styling import clump, trim
from tests.support.meshes import octahedron, subdivided_sphere

TURN = np.linalg.qr(np.array([[0.4, -0.8, 0.3], [0.9, 0.2, -0.1], [0.1, 0.5, 0.9]]))[0]
TURN *= np.sign(np.linalg.det(TURN))


@pytest.fixture
def head(rng):
    """Return (the mesh of an uneven egg, 40 roots on it)."""
    sphere = subdivided_sphere(3)
    mesh = TriMesh((sphere.vertices * [1.0, 1.3, 1.6]).astype(np.float32), sphere.triangles)
    barycentric = rng.dirichlet(np.ones(3), 40).astype(np.float32)
    return mesh, SurfacePoints(rng.integers(0, len(mesh.triangles), 40).astype(np.int32), barycentric)


def seen_from_above(mesh):
    """Return UV coordinates of corners from x and y, which are the same in all meshes of this shape."""
    return mesh.vertices[mesh.triangles][..., :2] * 0.2 + 0.5


def test_a_turned_and_scaled_copy_needs_no_uv_map(head):
    mesh, roots = head
    copy = TriMesh((mesh.vertices @ (2.5 * TURN).T + [3.0, 0.0, -1.0]).astype(np.float32), mesh.triangles)
    found = passage(TransferSurface(mesh), TransferSurface(copy), roots)
    assert (found.method, found.places.lost_count) == ("COPY", 0)
    assert found.places.scale == pytest.approx(2.5, abs=1e-5)
    np.testing.assert_allclose(positions(copy, found.places.roots), positions(copy, roots), atol=2e-6)
    np.testing.assert_allclose(found.places.turns, np.broadcast_to(TURN, (40, 3, 3)), atol=1e-4)


def test_uv_maps_count_where_they_agree(head):
    mesh, roots = head
    up = SurfacePoints(*(part[positions(mesh, roots)[:, 2] > 0.3] for part in (roots.triangle, roots.barycentric)))
    upper = np.flatnonzero(mesh.vertices[mesh.triangles][..., 2].min(axis=1) > -0.2)
    there = subdivided_sphere(4)
    there = TriMesh((there.vertices * [1.0, 1.3, 1.6] + [0.0, 0.0, 0.4]).astype(np.float32), there.triangles)
    cap = there.triangles[there.vertices[there.triangles][..., 2].min(axis=1) > 0.2]
    bald = TriMesh(there.vertices, np.ascontiguousarray(cap))
    own = TriMesh(mesh.vertices, np.ascontiguousarray(mesh.triangles[upper]))
    rooted = SurfacePoints(np.searchsorted(upper, up.triangle).astype(np.int32), up.barycentric)
    ground = TransferSurface(own, seen_from_above(own))
    found = passage(ground, TransferSurface(bald, seen_from_above(bald)), rooted)
    assert found.method == "UV"
    moved = positions(bald, found.places.roots)
    np.testing.assert_allclose(moved[:, :2], positions(own, rooted)[found.places.kept][:, :2], atol=1e-3)
    shuffled = seen_from_above(bald)[np.random.default_rng(1).permutation(len(cap))]
    assert passage(ground, TransferSurface(bald, shuffled), rooted).method == "NEAREST"


def test_another_shape_takes_guides_to_its_nearest_surface(head):
    mesh, roots = head
    other = subdivided_sphere(4)
    found = passage(TransferSurface(mesh), TransferSurface(other), roots)
    assert found.method == "NEAREST"
    extent = np.ptp(other.vertices, axis=0) / np.ptp(mesh.vertices, axis=0)
    wanted = positions(mesh, roots)[found.places.kept] * extent
    assert np.linalg.norm(positions(other, found.places.roots) - wanted, axis=1).max() < 0.03


def on_octahedron(points):
    """Return the nearest points (N, 3) of an octahedron to points outside, by projection on a simplex."""
    sizes = -np.sort(-np.abs(points), axis=1)
    shifts = (np.cumsum(sizes, axis=1) - 1.0) / [1.0, 2.0, 3.0]
    shift = np.take_along_axis(shifts, (sizes > shifts).sum(axis=1)[:, None] - 1, axis=1)
    return np.sign(points) * np.maximum(np.abs(points) - shift, 0.0)


def test_guides_far_from_their_places_are_counted(head):
    """Of guides on a ball those over the middles of the faces of an octahedron in the same box, and none on a copy."""
    _mesh, roots = head
    ball = subdivided_sphere(3)
    own, other = TransferSurface(ball), TransferSurface(octahedron())
    away = np.linalg.norm(positions(ball, roots) - on_octahedron(positions(ball, roots)), axis=1)
    found = passage(own, other, roots)
    assert (found.method, found.places.far_count) == ("NEAREST", (away > 0.2 * 2.0).sum())
    assert aside_count(own, other, roots, found) + found.places.lost_count == (away > 0.1 * 2.0).sum() > 10
    assert aside_count(own, own, roots, passage(own, own, roots)) == 0


def test_masks_come_along(head):
    mesh, roots = head
    weights = np.clip(mesh.vertices[:, 2:], 0.0, 1.0)
    copy = TriMesh((mesh.vertices @ (0.1 * TURN).T).astype(np.float32), mesh.triangles)
    for target in (TransferSurface(mesh, seen_from_above(mesh)), TransferSurface(copy, seen_from_above(mesh))):
        found = passage(TransferSurface(mesh, seen_from_above(mesh)), target, roots)
        carried = carried_weights(TransferSurface(mesh, seen_from_above(mesh)), target, weights, found.warp)
        np.testing.assert_allclose(carried, weights, atol=2e-5)


def test_an_unknown_method_is_refused(head):
    mesh, roots = head
    with pytest.raises(HairError, match="AUTO, UV, NEAREST"):
        passage(TransferSurface(mesh), TransferSurface(mesh), roots, "MAGIC")


def test_settings_follow_the_size_of_the_surface_and_forget_the_scene():
    settings = GroomSettings(
        GuideSettings(length=0.2, flow_lines="Lines"),
        HairSettings(radius=1e-4, influence_distance=0.03, density_group="scalp"),
        styles=(clump.Settings(size=0.02, mask="top"), trim.Settings(cutter="Knife", to_length=0.1)),
    )
    twice = library_settings.scaled(settings, 2.0)
    assert (twice.guides.length, twice.hair.radius, twice.styles[0].size, twice.styles[1].to_length) == (
        *(0.4, 2e-4, 0.04, 0.2),
    )
    assert library_settings.scaled(twice, 0.5) == settings
    alone, left = library_settings.alone(settings)
    assert (left, alone.guides.flow_lines, alone.styles[1].cutter) == (["Lines", "Knife"], "", "")
    assert library_settings.masks_of(settings) == ["scalp", "top"]
    assert library_settings.masks_of(library_settings.renamed(settings, {"top": "top.001"})) == ["scalp", "top.001"]


def test_maps_are_renamed_with_their_masks_and_leave_images_behind():
    """Maps follow the renamed masks, and maps of images and of attributes of strands are left out."""
    kinds = {"look.color": ("IMAGE", "Coat"), "look.tint": ("CURVES", "top"), "strands.thickness": ("GROUP", "top")}
    kinds |= {"guides.length": ("ATTRIBUTE", "long"), "look.melanin": ("CLUMP", "")}
    maps = tuple(MapSettings(setting=name, kind=kind, source=source) for name, (kind, source) in kinds.items())
    alone, left = library_settings.alone(GroomSettings(maps=maps))
    assert left == ["Coat", "top"]
    assert library_settings.masks_of(alone) == ["top", "long"]
    found = library_settings.renamed(alone, {"top": "top.001", "long": ""})
    assert {one.setting: one.source for one in found.maps} == {"strands.thickness": "top.001", "look.melanin": ""}


def test_curves_from_root_to_tip_leave_maps_behind():
    """A curve stays where its setting's map is left out, or where it has no map."""
    course = {"setting": "styles.Curl.radius", "course": "0:1 1:0.2"}
    only = (MapSettings(**course),)
    for source, names in (({}, []), ({"source": "Coat"}, ["Coat"])):
        alone, left = library_settings.alone(GroomSettings(maps=(MapSettings(**course, **source),)))
        assert (alone.maps, left) == (only, names)
        assert library_settings.renamed(alone, {}).maps == only
    masked = GroomSettings(maps=(MapSettings(**course, kind="GROUP", source="top"),))
    assert library_settings.renamed(masked, {"top": ""}).maps == only
