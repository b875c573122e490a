# SPDX-License-Identifier: GPL-3.0-or-later
"""The size of new hair is fitted to its surface: similar shapes of different sizes get similar hair."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.geometry.faces.uv_maps import Texture
from hair_addon.core.geometry.mesh import TriMesh
from hair_addon.core.grooming import groom, groom_defaults
from hair_addon.core.grooming.groom import GuideSettings, HairSettings
from hair_addon.core.params import from_surface, given
from tests.support.strands.hair import generate_hair

BOTH = (GuideSettings, HairSettings)


def cube(size=1.0, stretch=(1.0, 1.0, 1.0)):
    """Return a closed cube of this edge length, centered at the origin."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32)
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [(a, b, c) for a, b, c, _ in faces] + [(a, c, d) for a, _, c, d in faces]
    return TriMesh(0.5 * size * corners * np.float32(stretch), np.array(triangles, np.int32))


def grid(count, height, size=1.0):
    """Return a square of (count - 1)² quads with UVs over all of it, raised by height(x, y) of x and y in [-1, 1]."""
    x, y = (axis.ravel() for axis in np.meshgrid(*[np.linspace(-1.0, 1.0, count)] * 2, indexing="xy"))
    vertices = 0.5 * size * np.stack([x, y, height(x, y)], axis=1)
    lower = np.arange(count * count).reshape(count, count)[:-1, :-1].ravel()
    triangles = np.concatenate(
        [np.stack([lower, lower + 1, lower + count + 1], 1), np.stack([lower, lower + count + 1, lower + count], 1)]
    ).astype(np.int32)
    uvs = 0.5 * np.stack([x, y], axis=1)[triangles] + 0.5
    return TriMesh(vertices.astype(np.float32), triangles), uvs.astype(np.float32)


def plane(size=1.0, count=2):
    return grid(count, lambda x, y: 0.0 * x, size)


@pytest.mark.parametrize("scale", [0.01, 0.5, 2.0, 50.0])
def test_twice_the_size_grows_twice_the_hair(head, scalp, scale):
    for mesh, density in ((cube(), None), (head, scalp), (plane()[0], None)):
        size = groom_defaults.hair_size(mesh, density)
        scaled = groom_defaults.hair_size(TriMesh(mesh.vertices * np.float32(scale), mesh.triangles), density)
        for name in ("length", "radius", "influence_distance"):
            assert getattr(scaled, name) == pytest.approx(scale * getattr(size, name), rel=0.006), name
        assert scaled.gravity == pytest.approx(size.gravity, rel=0.006)


def test_a_human_scalp_grows_human_hair(head, scalp):
    size = groom_defaults.hair_size(head, scalp)
    assert 0.07e-3 <= 2.0 * size.radius <= 0.09e-3
    assert 0.08 <= size.length <= 0.2
    assert 0.01 <= size.influence_distance <= 0.05


def test_fewer_strands_are_thicker(head, scalp):
    """Thickness is proportional to the distance of roots: realistic at realistic counts, visible with few strands."""
    thickness = {
        count: 2.0 * groom_defaults.hair_size(head, scalp, strand_count=count).radius
        for count in (1, 600, 30_000, 60_000, 100_000, 1_000_000)
    }
    assert thickness[30_000] == pytest.approx(np.sqrt(2.0) * thickness[60_000], rel=0.01)
    assert thickness[1] == thickness[600] == pytest.approx(10.0 * thickness[60_000], rel=0.01)
    for count in (30_000, 60_000, 100_000, 1_000_000):
        assert 17e-6 <= thickness[count] <= 180e-6
    settings = groom_defaults.complete(HairSettings(strand_count=30_000), head, scalp)
    assert settings.radius == 0.5 * thickness[30_000]


def test_few_strands_of_short_hair_stay_slender(head, scalp):
    """600 strands of short hair stay slender in a patch as large as two brows on curved skin."""
    brows = ((np.abs(head.vertices[:, 0]) < 0.05) & (scalp > 0.5) & (head.vertices[:, 1] < -0.1)).astype(np.float32)
    few, many = (groom_defaults.hair_size(head, brows, strand_count=count) for count in (600, 60_000))
    assert 4.0 * many.radius < few.radius <= few.length / 50.0 * 1.01
    assert 17e-6 <= 2.0 * many.radius and 2.0 * few.radius <= 1e-3


def test_a_mask_and_a_mesh_of_the_same_part_grow_the_same(head, scalp):
    """A scalp that is cut out of the head and a painted one grow the same hair."""
    inside = (scalp[head.triangles] > 0.5).all(axis=1)
    density = np.zeros(len(head.vertices), np.float32)
    density[head.triangles[inside]] = 1.0
    alone = TriMesh(head.vertices, head.triangles[inside])
    painted, cut_out = groom_defaults.hair_size(head, density), groom_defaults.hair_size(alone)
    for name in ("length", "radius"):  # the mask fades over the faces around it
        assert getattr(painted, name) == pytest.approx(getattr(cut_out, name), rel=0.1), name


def test_fur_is_shorter_thicker_and_stiffer_than_hair_on_a_dome_of_the_same_area():
    dome, _uvs = grid(33, lambda x, y: 2.0 * np.cos(0.5 * np.pi * x) * np.cos(0.5 * np.pi * y))
    area = dome.areas.sum()
    flat, closed = plane(np.sqrt(area))[0], cube(np.sqrt(area / 6.0))
    sizes = [groom_defaults.hair_size(mesh) for mesh in (dome, flat, closed)]
    assert sizes[0].length > 3.0 * sizes[1].length and sizes[0].radius < 0.5 * sizes[1].radius
    assert sizes[0].gravity > 1.5 * sizes[1].gravity
    assert replace(sizes[1], influence_distance=0.0) == replace(sizes[2], influence_distance=0.0)


def test_an_image_counts_as_the_weights_that_say_the_same():
    mesh, uvs = plane(3.0, count=21)
    half = np.zeros((64, 64), np.float32)
    half[:, :32] = 1.0
    painted = groom_defaults.hair_size(mesh, texture=Texture(half, uvs))
    weighted = groom_defaults.hair_size(mesh, (mesh.vertices[:, 0] < 0.01).astype(np.float32))
    large, large_uvs = plane(3.0)  # its two triangles do not follow the halves
    coarse = groom_defaults.hair_size(large, texture=Texture(half, large_uvs))
    for size in (painted, weighted, coarse):
        assert size.length == pytest.approx(groom_defaults.hair_size(plane(3.0)[0]).length * np.sqrt(0.5), rel=0.05)


@pytest.mark.parametrize("stretch", [(1.0, 1.0, 1e-3), (1e-3, 1e-3, 1.0), (1e-4, 1.0, 30.0), (1e3, 1e3, 1e3)])
def test_thin_and_huge_shapes_grow_hair_of_their_own_size(stretch):
    mesh = cube(stretch=stretch)
    size = groom_defaults.hair_size(mesh)
    assert 0.0 < size.radius < 0.05 * size.length
    assert size.length < np.ptp(mesh.vertices, axis=0).max()


@pytest.mark.parametrize("scale", [1e-12, 1e12])
def test_any_size_is_within_the_range_of_the_settings(scale):
    for settings_class in BOTH:
        made = groom_defaults.complete(settings_class(), cube(scale))
        assert None not in [getattr(made, name) for name in from_surface(settings_class)]
        assert settings_class(**given(made)) == made


def test_single_precision_gives_sizes_back(rng):
    """Sizes that Blender stores in single precision give the same strands."""
    for edge in rng.uniform(0.001, 100.0, 200):
        size = groom_defaults.hair_size(cube(edge))
        for value in (size.length, size.gravity, size.radius, size.influence_distance):
            assert float(str(np.float32(value))) == value


@pytest.mark.parametrize(
    ("mesh", "density", "reported"),
    [
        (TriMesh(np.zeros((3, 3), np.float32), np.array([[0, 1, 2]], np.int32)), None, "zero area"),
        (TriMesh(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32)), None, "no faces"),
        (cube(), np.zeros(8), "density is zero"),
        (cube(), np.full(8, np.nan), "not a number"),
    ],
)
def test_a_surface_without_size_is_reported(mesh, density, reported):
    with pytest.raises(HairError, match=reported):
        groom_defaults.hair_size(mesh, density)


def test_a_black_image_is_reported():
    mesh, uvs = plane()
    with pytest.raises(HairError, match="density is zero"):
        groom_defaults.hair_size(mesh, texture=Texture(np.zeros((4, 4), np.float32), uvs))


@pytest.mark.parametrize("settings", [GuideSettings(length=0.7), HairSettings(radius=0.3)])
def test_what_is_given_stays(settings):
    made = groom_defaults.complete(settings, cube())
    assert given(settings).items() <= given(made).items()
    assert groom_defaults.complete(made, cube(7.0)) == made


def test_plain_arrays_grow_hair_of_their_size():
    small, large = cube(), cube(2.0)
    made = [groom.distribute_guides(mesh, GuideSettings(guide_count=20, gravity=0.0)) for mesh in (small, large)]
    np.testing.assert_allclose(made[1].numpy(), 2.0 * made[0].numpy(), atol=0.02)
    lengths = np.linalg.norm(np.diff(made[0].numpy(), axis=1), axis=-1).sum(axis=1)
    assert lengths.mean() == pytest.approx(groom_defaults.hair_size(small).length, rel=0.1)
    wanted = replace(HairSettings(strand_count=10), automatic_influence=False)
    assert np.isfinite(generate_hair(small, made[0], wanted).numpy()).all()
