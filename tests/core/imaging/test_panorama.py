# SPDX-License-Identifier: GPL-3.0-or-later
"""Panoramas composed of a cube's faces have no seams and no distortion."""

import math

import numpy as np
import pytest

from hair_addon.core.imaging import panorama
from hair_addon.core.imaging.panorama import FaceLookup, Panorama

KINDS = {
    "EQUIRECTANGULAR": {},
    "EQUIANGULAR_CUBEMAP_FACE": {},
    "MIRRORBALL": {},
    "FISHEYE_EQUIDISTANT": {"fov": 5.0, "shift": (0.1, -0.05)},
    "FISHEYE_EQUISOLID": {"fov": 3.0},
    "FISHEYE_LENS_POLYNOMIAL": {"fov": 3.0, "polynomial": (0.0, -0.08, -1e-4, 0.0, 0.0)},
    "CENTRAL_CYLINDRICAL": {"cylinder": (-1.0, 3.0, -2.0, 1.0)},
}


def some(kind):
    return Panorama(kind, **KINDS[kind])


def smooth(directions):
    """Return (..., 2) numbers that change slowly with the direction (..., 3)."""
    x, y, z = np.moveaxis(directions, -1, 0)
    return np.stack([x * y + z, x - 0.5 * z * z], axis=-1)


def drawn(lookup):
    """Return {face: array} of `smooth` as seen on the faces."""
    texels = (2.0 * (np.arange(lookup.side) + 0.5) / lookup.side - 1.0) * lookup.half_width
    x, y = np.meshgrid(texels, texels)
    rays = np.stack([x, y, -np.ones_like(x)], axis=-1)
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    found = {}
    for face, (left, bottom, width, height) in lookup.windows.items():
        picture = smooth(rays @ panorama.FACES[face]).astype(np.float32)
        found[face] = picture[bottom : bottom + height, left : left + width]
    return found


def middles(size, window):
    """Return (height, width, 2) positions of pixels."""
    left, bottom, width, height = window
    x, y = np.meshgrid(left + np.arange(width) + 0.5, bottom + np.arange(height) + 0.5)
    return np.stack([x, y], axis=-1) / np.array(size)


def test_faces_are_turned_views_that_look_everywhere():
    for face in panorama.FACES:
        np.testing.assert_array_equal(face @ face.T, np.eye(3))
        assert np.linalg.det(face) == pytest.approx(1.0)
    ahead = -panorama.FACES[:, 2]
    assert len(np.unique(ahead, axis=0)) == 6


@pytest.mark.parametrize("window", [(0, 0, 96, 64), (17, 30, 40, 21)])
@pytest.mark.parametrize("kind", KINDS)
def test_what_the_faces_show_comes_back(kind, window):
    """A function of the direction, drawn on the faces, is restored in a panorama and in a part of it."""
    size = (96, 64)
    lookup = FaceLookup(some(kind), size, window)
    found = lookup.means(drawn(lookup), (7.0, 7.0))
    directions = some(kind).directions(middles(size, window))
    is_seen = (found != 7.0).all(axis=-1) & (np.abs(directions).sum(axis=-1) > 0.0)
    # At the rim of a circle pixels are seen in part, and a mirror ball shows all that is behind it there.
    expected = smooth(directions)
    assert (is_seen == (np.abs(directions).sum(axis=-1) > 0.0)).mean() > 0.95
    off = np.abs(found - expected).max(axis=-1)[is_seen]
    assert np.median(off) < 2e-3 and np.mean(off > 0.03) < (0.1 if kind == "MIRRORBALL" else 0.03)


@pytest.mark.parametrize("kind", KINDS)
def test_a_sphere_has_one_distance(kind):
    """Depths along the axes of the faces become distances, so a sphere has one distance."""
    lookup = FaceLookup(some(kind), (48, 32), (0, 0, 48, 32))
    texels = (2.0 * (np.arange(lookup.side) + 0.5) / lookup.side - 1.0) * lookup.half_width
    depths = 3.0 / np.sqrt(1.0 + texels[:, None] ** 2 + texels**2)
    pictures = {
        face: depths[bottom : bottom + height, left : left + width, None]
        for face, (left, bottom, width, height) in lookup.windows.items()
    }
    found = lookup.distances(pictures, far=1e10)
    is_seen = np.abs(some(kind).directions(middles((48, 32), (0, 0, 48, 32)))).sum(axis=-1) > 0.0
    np.testing.assert_allclose(found[is_seen], 3.0, rtol=0.03)
    assert (found[~is_seen] == 1e10).all()


def test_a_part_of_a_picture_draws_a_part_of_the_faces():
    whole, part = (FaceLookup(some("EQUIRECTANGULAR"), (96, 64), w) for w in ((0, 0, 96, 64), (40, 28, 16, 8)))
    assert len(whole.windows) == 6 and len(part.windows) == 1
    assert math.prod(part.windows[0][2:]) < 0.4 * part.side**2


def test_the_horizon_is_seen_all_around():
    """In a panorama, longitude grows to the right, latitude upward, and the middle is ahead."""
    wide = Panorama("EQUIRECTANGULAR")
    places = np.array([[0.5, 0.5], [0.75, 0.5], [0.25, 0.5], [0.5, 1.0]])
    expected = [[0, 0, -1], [1, 0, 0], [-1, 0, 0], [0, 1, 0]]
    np.testing.assert_allclose(wide.directions(places), expected, atol=1e-12)


def test_a_fisheye_is_in_proportion():
    """In a fisheye picture, angles from the axis are proportional to the distance from the middle."""
    lens = Panorama("FISHEYE_EQUIDISTANT", fov=math.pi)
    angles = np.arccos(-lens.directions(np.array([[0.5, 0.5], [0.75, 0.5], [0.5, 0.875], [1.0, 0.5]]))[:, 2])
    np.testing.assert_allclose(angles, np.array([0.0, 0.25, 0.375, 0.5]) * math.pi, atol=1e-7)
