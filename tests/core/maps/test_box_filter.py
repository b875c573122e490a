# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of images at roots are means over the strands' shares of the surface."""

import numpy as np
import pytest

from hair_addon.core.geometry.mesh import SurfacePoints, TriMesh
from hair_addon.core.maps import box_filter, combination, pixels
from hair_addon.core.maps.combination import Combination
from hair_addon.core.params import Param


def plane(count=4, size=1.0):
    """Return a square of count² quads with vertices from 0 to size, and its UVs (F, 3, 2) from 0 to 1."""
    y, x = np.mgrid[0 : count + 1, 0 : count + 1] / count
    vertices = np.stack([x, y, 0.0 * x], axis=-1).reshape(-1, 3)
    first = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).ravel()
    triangles = np.concatenate(
        [np.stack([first, first + 1, first + count + 2], 1), np.stack([first, first + count + 2, first + count + 1], 1)]
    ).astype(np.int32)
    return TriMesh((size * vertices).astype(np.float32), triangles), vertices[triangles][..., :2].astype(np.float32)


def roots_on(mesh, count, rng):
    return SurfacePoints(
        rng.integers(0, len(mesh.triangles), count).astype(np.int32),
        rng.dirichlet([1.0, 1.0, 1.0], count).astype(np.float32),
    )


def sampled(mesh, uvs, roots, image):
    return box_filter.root_texels(mesh, uvs, roots, {None: image.shape[1::-1]}).sample({None: image})


@pytest.mark.parametrize("shape", [(16, 32, 4), (37, 53, 1), (1, 5, 4), (9, 1, 1)])
def test_levels_follow_changes(rng, shape):
    """The levels of an image whose texels change are, bit for bit, those of the changed image."""
    image = rng.random(shape).astype(np.float32)
    levels = box_filter.Levels(image)
    for _ in range(6):
        low, left = (rng.integers(0, side) for side in shape[:2])
        before, image = image, image.copy()
        image[low : low + rng.integers(0, 4), left : left + 3] = rng.random()
        levels.follow(image, pixels.changed_box(before, image))
        np.testing.assert_array_equal(levels.texels, box_filter.Levels(image).texels)


@pytest.mark.parametrize("shape", [(64, 128, 4), (37, 53, 1), (1, 1, 1), (300, 7, 4)])
def test_means_follow_changes(rng, shape):
    """After a change, means are bit for bit those of a new reading; only strands at changed texels are sampled."""
    mesh, uvs = plane()
    uvs = 1.5 * uvs - np.float32(0.25)  # repeats
    uvs[2] = uvs[2, :1]  # without an area
    image = rng.random(shape).astype(np.float32)
    texels = box_filter.root_texels(mesh, uvs, roots_on(mesh, 300, rng), {None: shape[1::-1]})
    levels = box_filter.Levels(image)
    means = texels.sample({None: levels})
    for _ in range(12):
        low, left = (rng.integers(0, side) for side in shape[:2])
        before, image = image, image.copy()
        image[low : low + rng.integers(0, 9), left : left + rng.integers(1, 9)] = rng.random()
        changed = pixels.changed_box(before, image)
        levels.follow(image, changed)
        means = texels.follow(means, levels, changed)
        np.testing.assert_array_equal(means, texels.sample({None: image}))
    for channel in range(shape[2]):  # colors have a kernel of their own
        alone = texels.sample({None: np.ascontiguousarray(image[..., channel : channel + 1])})
        np.testing.assert_array_equal(alone[:, 0], means[:, channel])


def test_the_changed_box_holds_all_changes(rng):
    """The box of changed texels is the smallest that holds them; images of the same bits have none."""
    image = rng.random((20, 30, 4)).astype(np.float32)
    other = image.copy()
    assert pixels.changed_box(image, other) is None
    other[3, 7, 1], other[11, 5, 3] = 2.0, np.nan
    assert pixels.changed_box(image, other) == (slice(3, 12), slice(5, 8))


@pytest.mark.parametrize("shape", [(40, 64, 4), (37, 53, 1), (300, 7, 4), (1, 5, 2), (9, 130, 3)])
def test_boxes_of_changed_parts_hold_all_changes(rng, shape):
    """Digests find a change of any texel, also swaps, sign bits and constant colors."""
    image = rng.random(shape).astype(np.float32)
    before = pixels.digests(image)
    assert pixels.box_of_changed_parts(before, pixels.digests(image.copy()), shape) is None
    for _ in range(20):
        other, row, column = image.copy(), *(rng.integers(0, side) for side in shape[:2])
        some = other[row : row + rng.integers(1, 5), column : column + rng.integers(1, 5)]
        some[:] = [some[::-1, ::-1].copy(), -some, some[:1, :1].copy(), rng.random()][rng.integers(0, 4)]
        exact = pixels.changed_box(image, other)
        found = pixels.box_of_changed_parts(before, pixels.digests(other), shape)
        if exact is None:
            assert found is None
            continue
        for mine, its in zip(found, exact, strict=True):
            assert mine.start <= its.start and its.stop <= mine.stop
        if shape[1] * shape[2] == 256:  # a part is a row
            assert found[0] == exact[0]


def test_digests_see_all_strokes_of_eight_bits():
    """A part of one of 256 gray levels has another digest at each other level, and a moved texel changes a digest."""
    levels = (np.arange(256, dtype=np.float32) / np.float32(255.0))[:, None, None]
    assert len(np.unique(pixels.digests(np.broadcast_to(levels, (256, 64, 4))), axis=0)) == 256
    moved = np.zeros((64, 64, 4), np.float32)
    moved[np.arange(64), np.arange(64)] = 1.0
    assert len(np.unique(pixels.digests(moved), axis=0)) == 64


def test_a_constant_image_is_the_constant(rng):
    """An image of one value gives each root this value, bit for bit."""
    mesh, uvs = plane()
    image = np.full((37, 53, 4), 0.3, np.float32)
    np.testing.assert_array_equal(sampled(mesh, uvs, roots_on(mesh, 200, rng), image), np.float32(0.3))


def test_fine_patterns_are_gray(rng):
    """A checkerboard that is finer than the strands is gray at each root, and does not alias."""
    mesh, uvs = plane()
    image = (np.indices((512, 512)).sum(axis=0) % 2)[..., None].astype(np.float32)
    np.testing.assert_allclose(sampled(mesh, uvs, roots_on(mesh, 300, rng), image), 0.5, atol=0.02)


def test_values_change_by_degrees():
    """A root that moves across the edge of a texel changes its value by as little as it moves."""
    mesh, uvs = plane(1)
    along = np.linspace(0.3, 0.7, 400)
    roots = SurfacePoints(
        np.zeros(400, np.int32), np.stack([1.0 - along, along - 0.1, 0.1 + 0.0 * along], 1, dtype="f4")
    )
    image = np.zeros((8, 8, 1), np.float32)
    image[:, 4:] = 1.0
    found = sampled(mesh, uvs, roots, image)[:, 0]
    assert (found[0], found[-1]) == (0.0, 1.0)
    assert np.abs(np.diff(found)).max() < 0.02


def test_no_texel_of_another_island_takes_part(rng):
    """Two islands side by side, one black and one white, do not mix, also where the pattern is fine."""
    mesh, uvs = plane(2)
    is_right = uvs[..., 0].mean(axis=1) > 0.5
    apart = TriMesh(mesh.vertices[mesh.triangles].reshape(-1, 3), np.arange(24, dtype=np.int32).reshape(-1, 3))
    joined = np.where(is_right[:, None], mesh.triangles + 9, mesh.triangles)
    apart = TriMesh(np.concatenate([mesh.vertices, mesh.vertices]), joined.astype(np.int32))
    image = np.zeros((256, 256, 1), np.float32)
    image[:, 128:] = 1.0
    roots = roots_on(apart, 300, rng)
    found = sampled(apart, uvs, roots, image)[:, 0]
    np.testing.assert_array_equal(found, is_right[roots.triangle])
    mixed = sampled(mesh, uvs, roots, image)[:, 0]  # one island
    assert ((mixed > 0.0) & (mixed < 1.0)).any()


def test_stacked_islands_share_their_texels(rng):
    """Islands on the same texels, as of mirrored halves, are filtered as each alone."""
    mesh, uvs = plane(2)
    twice = TriMesh(
        np.concatenate([mesh.vertices, mesh.vertices + np.float32(2.0)]),
        np.concatenate([mesh.triangles, mesh.triangles + len(mesh.vertices)]),
    )
    image = (np.indices((256, 256)).sum(axis=0) % 2)[..., None].astype(np.float32)
    found = sampled(twice, np.concatenate([uvs, uvs]), roots_on(twice, 300, rng), image)
    np.testing.assert_allclose(found, 0.5, atol=0.02)


def test_tiles_of_udim(rng):
    """Roots in each tile take its image, also after one tile has changed; roots without a tile have no value."""
    mesh, uvs = plane(4)
    wide = uvs * np.float32([3.0, 2.0])
    sizes = {1001: (4, 4), 1002: (8, 2), 1012: (1, 1)}
    images = {tile: np.full((height, width, 1), tile, np.float32) for tile, (width, height) in sizes.items()}
    roots = roots_on(mesh, 400, rng)
    at = np.einsum("nc,ncu->nu", roots.barycentric, wide[roots.triangle])
    wanted = 1001 + np.floor(at[:, 0]) + 10 * np.floor(at[:, 1])
    texels = box_filter.root_texels(mesh, wide, roots, sizes)
    found = texels.sample(images)
    np.testing.assert_array_equal(found[:, 0], np.where(np.isin(wanted, list(sizes)), wanted, np.nan))
    changed = {1002: 7.0 * images[1002]}
    np.testing.assert_array_equal(texels.resample(found, changed), texels.sample(images | changed))


def test_the_unit_of_the_surface_does_not_matter(rng):
    """The same surface in centimeters has the same values."""
    mesh, uvs = plane()
    tiny, _uvs = plane(size=0.01)
    roots, image = roots_on(mesh, 200, rng), rng.random((64, 64, 1), np.float32)
    found = sampled(mesh, uvs, roots, image)
    np.testing.assert_allclose(sampled(tiny, uvs, roots, image), found, atol=1e-5)


def test_broken_uvs_and_pixels_are_survived(rng):
    """Non-finite UVs, triangles without an area and images of one texel give finite values."""
    mesh, uvs = plane()
    uvs = uvs.copy()
    uvs[0], uvs[1], uvs[2] = np.nan, 0.25, 1e12
    for shape in ((1, 1, 1), (3, 5, 1)):
        assert np.isfinite(sampled(mesh, uvs, roots_on(mesh, 200, rng), rng.random(shape, np.float32))).all()


def test_kinds_of_pixels():
    """Gray, color and alpha; sRGB is decoded; non-finite and negative pixels are 0; colors are un-premultiplied."""
    gray = np.float32([[[0.25]]])
    assert pixels.masks(gray) == np.float32(0.25)
    np.testing.assert_allclose(pixels.masks(np.float32([[[0.2, 0.3, 0.4, 0.5]]])), 0.15, rtol=1e-6)
    np.testing.assert_allclose(pixels.masks(gray, is_srgb=True), ((64 / 255 + 0.055) / 1.055) ** 2.4, rtol=1e-6)
    np.testing.assert_array_equal(pixels.masks(np.float32([[[np.nan, -1.0, np.inf, 1.0]]])), 0.0)
    color = np.float32([0.2, 0.3, 0.4])
    for is_premultiplied in (False, True):
        stored = np.float32([[[*(color * 0.5 if is_premultiplied else color), 0.5]]])
        found, alpha = pixels.unpremultiplied(pixels.colors(stored, is_premultiplied=is_premultiplied)[0])
        np.testing.assert_allclose(found, [color], rtol=1e-6)
        np.testing.assert_array_equal(alpha, [0.5])


def test_large_images_are_averaged(monkeypatch):
    """An image larger than the limit is averaged in blocks of rows, and keeps its mean."""
    monkeypatch.setattr(pixels, "MOST_SIDE", 8)
    image = np.arange(30 * 20, dtype=np.float32).reshape(20, 30, 1) / 600.0
    found = pixels.masks(image)
    assert found.shape[1::-1] == (8, 5)
    np.testing.assert_allclose(found[:, :7].mean(), image[:, :28].mean(), rtol=1e-6)


def test_combination():
    """Numbers are value × lerp(from, to, map) within the range of the setting; colors are mix(value, map, amount)."""
    details = Param("", low=0.0, high=1.0)
    how = Combination(low=0.5, high=4.0)
    np.testing.assert_allclose(
        combination.varied_number(0.5, np.array([0.0, 0.2, 1.0, np.nan, np.inf]), how, details),
        [0.25, 0.6, 1.0, 0.5, 0.25],
    )
    inverted = Combination(is_inverted=True)
    np.testing.assert_allclose(combination.varied_number(0.5, np.array([0.25]), inverted, details), [0.375])
    mixed = combination.varied_color(
        (0.0, 0.5, 1.0), np.array([[1.0, 1.0, 0.0]] * 2), np.array([1.0, 0.5]), Combination(amount=0.5), details
    )
    np.testing.assert_allclose(mixed, [[0.5, 0.75, 0.5], [0.25, 0.625, 0.75]])
