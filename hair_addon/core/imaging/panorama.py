# SPDX-License-Identifier: GPL-3.0-or-later
"""Panoramic pictures: the direction of each pixel, and its place on the faces of a cube around the camera.

Directions are in the camera's axes, with the view along -Z and Y up. Projections are the same as in Cycles
(kernel/camera/projection.h).
"""

import math
from dataclasses import dataclass

import numpy as np

MARGIN = 2  # texels around the visible part of a face, for interpolation
_FINER = 1.25  # resolution of a face at its center, relative to the picture's pixels
_PER_SIDE = 2  # samples of a pixel along each side
_SOME = 64  # pixels along each side of a picture that are sampled to estimate the size of a pixel
_AT_ONCE = 1 << 18  # pixels in a batch

# (6, 3, 3) rotations from the camera to the faces ahead, right, left, back, up and down. A face looks along its -Z.
FACES = np.array(
    [
        [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        [[0, 0, 1], [0, 1, 0], [-1, 0, 0]],
        [[0, 0, -1], [0, 1, 0], [1, 0, 0]],
        [[-1, 0, 0], [0, 1, 0], [0, 0, -1]],
        [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
        [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
    ],
    float,
)


@dataclass(frozen=True)
class Panorama:
    """A panoramic camera with Blender's settings; angles [rad], lengths of lens and sensor [mm]."""

    kind: str  # Blender's panorama_type
    shift: tuple = (0.0, 0.0)  # in fractions of the picture
    sensor: tuple = (36.0, 36.0)  # width and height of the used part
    fov: float = math.pi
    lens: float = 10.5
    latitudes: tuple = (-0.5 * math.pi, 0.5 * math.pi)
    longitudes: tuple = (-math.pi, math.pi)
    polynomial: tuple = (0.0, 0.0, 0.0, 0.0, 0.0)
    cylinder: tuple = (-math.pi, math.pi, -1.0, 1.0)  # least and greatest angle, then height / radius

    def directions(self, places: np.ndarray) -> np.ndarray:
        """Return unit directions (..., 3) for places (..., 2) in [0, 1] in the picture; zero outside the projection."""
        u, v = np.moveaxis(places + np.array(self.shift), -1, 0)
        found = _PROJECTIONS[self.kind](self, u, v)
        return found / np.maximum(np.linalg.norm(found, axis=-1, keepdims=True), 1e-12)


def _equirectangular(panorama, u, v):
    (west, east), (south, north) = panorama.longitudes, panorama.latitudes
    longitude, latitude = west + (east - west) * u, south + (north - south) * v
    across = np.cos(latitude)
    return np.stack([across * np.sin(longitude), np.sin(latitude), -across * np.cos(longitude)], axis=-1)


def _cube_face(_panorama, u, v):
    x, y = (np.tan(0.5 * math.pi * (along - 0.5)) for along in (u, v))
    return np.stack([x, y, -np.ones_like(x)], axis=-1)


def _mirror_ball(_panorama, u, v):
    x, y = 2.0 * u - 1.0, 2.0 * v - 1.0
    squared = x * x + y * y
    z = -np.sqrt(np.maximum(1.0 - squared, 0.0))  # of the ball, viewed along its +Z
    reflected = np.stack([-2.0 * z * x, -2.0 * z * y, 1.0 - 2.0 * z * z], axis=-1)
    return np.where((squared <= 1.0)[..., None], reflected, 0.0)


def _equidistant(panorama, u, v):
    x, y = 2.0 * u - 1.0, 2.0 * v - 1.0
    radius = np.hypot(x, y)
    return _around(x, y, 0.5 * panorama.fov * radius, radius <= 1.0)


def _equisolid(panorama, u, v):
    x, y = (along * length for along, length in zip((u - 0.5, v - 0.5), panorama.sensor, strict=True))
    radius = np.hypot(x, y)
    theta = 2.0 * np.arcsin(np.minimum(radius / (2.0 * panorama.lens), 1.0))
    return _around(x, y, theta, radius <= 2.0 * panorama.lens * math.sin(0.25 * panorama.fov))


def _polynomial(panorama, u, v):
    x, y = (along * length for along, length in zip((u - 0.5, v - 0.5), panorama.sensor, strict=True))
    theta = -np.polynomial.polynomial.polyval(np.hypot(x, y), panorama.polynomial)
    return _around(x, y, theta, np.abs(theta) <= 0.5 * panorama.fov)


def _cylindrical(panorama, u, v):
    left, right, bottom, top = panorama.cylinder
    angle, height = left + (right - left) * u, bottom + (top - bottom) * v
    return np.stack([np.sin(angle), height, -np.cos(angle)], axis=-1)


def _around(x, y, theta, is_seen):
    """Return directions at an angle theta from the axis, toward (x, y)."""
    radius = np.maximum(np.hypot(x, y), 1e-12)
    across = np.sin(theta) / radius
    found = np.stack([across * x, across * y, -np.cos(theta)], axis=-1)
    return np.where(np.asarray(is_seen)[..., None], found, 0.0)


_PROJECTIONS = {
    "EQUIRECTANGULAR": _equirectangular,
    "EQUIANGULAR_CUBEMAP_FACE": _cube_face,
    "MIRRORBALL": _mirror_ball,
    "FISHEYE_EQUIDISTANT": _equidistant,
    "FISHEYE_EQUISOLID": _equisolid,
    "FISHEYE_LENS_POLYNOMIAL": _polynomial,
    "CENTRAL_CYLINDRICAL": _cylindrical,
}


class FaceLookup:
    """Lookup of a picture's pixels on the faces of a cube.

    size: (width, height) of the whole picture [pixels]; window: (left, bottom, width, height) of the rendered part.
    """

    def __init__(self, panorama: Panorama, size: tuple[int, int], window: tuple[int, int, int, int]) -> None:
        self._panorama, self._size, self._window = panorama, size, window
        self.side = self._face_side()  # texels along a side of a face
        self.half_width = self.side / (self.side - 2.0 * MARGIN)  # tangent of half the field of view of a face
        self.windows = self._face_windows()  # {face: (left, bottom, width, height) of the face's visible part [texels]}

    def _face_side(self):
        """Return the texels along a side of a face, from the median size of pixels: √(width × height)."""
        left, bottom, width, height = self._window
        x = left + np.arange(0, width, -(-width // _SOME))
        y = bottom + np.arange(0, height, -(-height // _SOME))
        corners = np.stack(np.meshgrid(x, y), axis=-1)[:, :, None] + np.array([[0.5, 0.5], [1.5, 0.5], [0.5, 1.5]])
        middle, right, above = np.moveaxis(self._panorama.directions(corners / np.array(self._size, float)), -2, 0)
        is_seen = np.all([np.abs(one).sum(axis=-1) > 0.0 for one in (middle, right, above)], axis=0)
        if not is_seen.any():
            return 4 * MARGIN
        steps = np.linalg.norm(right - middle, axis=-1) * np.linalg.norm(above - middle, axis=-1)
        return math.ceil(2.0 * _FINER / max(math.sqrt(float(np.median(steps[is_seen]))), 1e-5)) + 2 * MARGIN

    def _face_windows(self):
        lowest, highest = {}, {}
        for first, last in self._rows():
            faces, places, _stretch, is_seen = self._places(first, last, 1)
            for face in np.unique(faces[is_seen]):
                here = places[is_seen & (faces == face)]
                lowest[face] = np.minimum(lowest.get(face, np.inf), here.min(axis=0))
                highest[face] = np.maximum(highest.get(face, -np.inf), here.max(axis=0))
        found = {}
        for face in sorted(lowest):
            # Places are centers of pixels; pixels extend beyond these places.
            start = np.maximum(np.floor(lowest[face]).astype(int) - 2 * MARGIN, 0)
            end = np.minimum(np.floor(highest[face]).astype(int) + 2 + 2 * MARGIN, self.side)
            found[int(face)] = (*start.tolist(), *(end - start).tolist())
        return found

    def _rows(self):
        """Return [(first, last)] batches of the window's rows."""
        step = max(_AT_ONCE // self._window[2], 1)
        return [(first, min(first + step, self._window[3])) for first in range(0, self._window[3], step)]

    def _places(self, first, last, per_side=_PER_SIDE):
        """Return (faces, places, distance / depth, visibility) of samples (rows, width, N) of pixels.

        Places (..., 2) on faces are in texels from the center of the first texel.
        """
        left, bottom, width, _height = self._window
        along = (np.arange(per_side) + 0.5) / per_side
        offsets = np.stack(np.meshgrid(along, along), axis=-1).reshape(-1, 2)
        pixels = np.stack(np.meshgrid(left + np.arange(width), bottom + np.arange(first, last)), axis=-1)
        directions = self._panorama.directions((pixels[:, :, None] + offsets) / np.array(self._size, float))
        axis = np.abs(directions).argmax(axis=-1)
        ahead = np.take_along_axis(directions, axis[..., None], axis=-1)[..., 0]
        faces = np.array([[1, 2], [4, 5], [3, 0]])[axis, (ahead < 0.0).astype(int)]
        turned = np.einsum("...ij,...j->...i", FACES[faces], directions)
        depth = np.maximum(-turned[..., 2], 1e-12)
        places = (turned[..., :2] / depth[..., None] / self.half_width + 1.0) * (0.5 * self.side) - 0.5
        return faces, places, 1.0 / depth, np.abs(ahead) > 0.0

    def means(self, pictures: dict[int, np.ndarray], unseen: tuple[float, ...]) -> np.ndarray:
        """Return pixel means (height, width, C) float32 of the window from pictures {face: array of the face's window}.

        unseen: (C,) values outside the projection.
        """
        channels = len(unseen)
        found = np.zeros((self._window[3], self._window[2], channels), np.float32)
        for first, last in self._rows():
            faces, places, _stretch, is_seen = self._places(first, last)
            total = np.full((*faces.shape, channels), unseen, np.float32)
            for face, picture in pictures.items():
                chosen = is_seen & (faces == face)
                total[chosen] = _between_texels(picture, places[chosen] - self.windows[face][:2])
            found[first:last] = total.mean(axis=2)
        return found

    def distances(self, pictures: dict[int, np.ndarray], far: float) -> np.ndarray:
        """Return distances (height, width, 1) float32 at pixel centers from depths {face: array}; `far` if unseen."""
        found = np.full((self._window[3], self._window[2], 1), far, np.float32)
        for rows, chosen, depths, stretch in self._middles(pictures):
            found[rows][chosen] = np.minimum(depths * stretch[:, None], far)
        return found

    def nearest(self, pictures: dict[int, np.ndarray], channels: int) -> np.ndarray:
        """Return values (height, width, channels) float32 at pixel centers from {face: array}; zero if unseen."""
        found = np.zeros((self._window[3], self._window[2], channels), np.float32)
        for rows, chosen, values, _stretch in self._middles(pictures):
            found[rows][chosen] = values
        return found

    def _middles(self, pictures):
        """Yield (rows, pixels of these rows on a face, values at pixel centers, distance / depth) for each face."""
        for first, last in self._rows():
            faces, places, stretch, is_seen = (values[:, :, 0] for values in self._places(first, last, 1))
            for face, picture in pictures.items():
                chosen = is_seen & (faces == face)
                x, y = np.floor(places[chosen] + 0.5).astype(int).T - np.array(self.windows[face][:2])[:, None]
                values = picture[np.clip(y, 0, len(picture) - 1), np.clip(x, 0, picture.shape[1] - 1)]
                yield slice(first, last), chosen, values, stretch[chosen]


def _between_texels(picture, places):
    """Return bilinearly interpolated values (N, C) of an array (H, W, C) at places (N, 2) [texels]."""
    lowest = np.floor(places).astype(int)
    part = (places - lowest).astype(np.float32)
    x, y = (np.clip(lowest[:, axis], 0, picture.shape[1 - axis] - 2) for axis in (0, 1))
    right, up = part[:, :1], part[:, 1:]
    low = picture[y, x] * (1.0 - right) + picture[y, x + 1] * right
    high = picture[y + 1, x] * (1.0 - right) + picture[y + 1, x + 1] * right
    return low * (1.0 - up) + high * up
