# SPDX-License-Identifier: GPL-3.0-or-later
"""Light of lamps with nodes that Vellus does not read: Cycles renders a panorama once, which is cast as a pattern."""

import hashlib
import zipfile
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...host.caches import Cache
from . import kept_files, picture_jobs, unread_nodes, world_digest, world_panoramas
from .shader_sockets import nodes_of

SIZE = 1024, 512  # pixels of patterns, and of panoramas of spot lights
WIDE_SIZE = 512, 256  # pixels of panoramas of other lights
AREA_SIZE = 256, 128  # pixels of panoramas of area lights, which need more samples as each is at another place
COARSE_SIZE = 64, 32  # pixels of the first panorama in viewports
_TINY = 1e-4  # least light without nodes that divides, relative to the brightest direction
_LEAST = 1e-3  # least factor of a lamp's power, relative to its brightest direction
_BRIGHTEST = 6e4  # greatest value of a pattern, within the range of half floats

picture_cache = Cache(capacity=64)  # (path, whether scaled) → `Panorama`

# Settings of lights that the panorama depends on, beside the nodes.
_SETTINGS = ("type", "shadow_soft_size", "spot_size", "spot_blend", "shape", "size", "size_y", "spread", "angle")
_WORLD_NODES = {"NEW_GEOMETRY", "OBJECT_INFO", "VECT_TRANSFORM"}  # which depend on the light's place


@dataclass(frozen=True, eq=False)
class Panorama:
    """Light in the directions of a lamp's axes, by latitude from below and by longitude.

    lit: (H, W, 3), with nodes; plain: (H, W), without them; in the same unit; is_scaled: whether the lamp's scale
    distorts the directions, as in Cycles the normals that nodes of points and spots read.
    """

    lit: np.ndarray
    plain: np.ndarray
    is_scaled: bool = False

    @cached_property
    def pattern(self):
        """(height, width, 3) float32 of `SIZE`: light with nodes divided by light without nodes, in each direction."""
        ratio = self.lit / np.maximum(self.plain, _TINY * self.plain.max() + 1e-30)[..., None]
        ratio = np.clip(ratio, 0.0, _BRIGHTEST).astype(np.float32)
        rows, columns = (np.arange(side) * count // side for side, count in zip(SIZE[::-1], ratio.shape, strict=False))
        return ratio[rows[:, None], columns]

    @cached_property
    def coarse_pattern(self):
        """`pattern` with half as many pixels along each side."""
        width, height = SIZE
        return self.pattern.reshape(height // 2, 2, width // 2, 2, 3).mean(axis=(1, 3))

    def axes(self, matrix):
        """Axes (3, 3) of a lamp with a matrix (4, 4), one in each column, of length one unless its scale distorts
        directions: then the longest has this length.
        """
        lengths = np.linalg.norm(matrix[:3, :3], axis=0)
        return matrix[:3, :3] / np.maximum(lengths.max() if self.is_scaled else lengths, 1e-12)

    def factor(self, matrix, places):
        """Return the mean RGB light that arrives at places (P, 3), divided by the light without nodes.

        matrix: (4, 4) of the lamp. Without places, or without light at places, it is the mean of all directions. It is
        positive unless a channel is dark in all directions, because other places may have light.
        """
        return np.maximum(self._mean(matrix, places), _LEAST * self.pattern.max(axis=(0, 1)))

    def _mean(self, matrix, places):
        lit, plain = self._arriving(matrix, places)
        if not plain > 0.0:
            rows = len(self.plain)
            widths = np.cos(np.pi * ((np.arange(rows) + 0.5) / rows - 0.5))  # of texels
            lit, plain = np.einsum("h,hwc->c", widths, self.lit), np.einsum("h,hw->", widths, self.plain)
        return lit / plain if plain > 0.0 else np.zeros(3)

    def _arriving(self, matrix, places):
        offsets = np.reshape(places, (-1, 3)) - matrix[:3, 3]
        distances = np.maximum(np.linalg.norm(offsets, axis=1), 1e-6)
        along = offsets @ self.axes(matrix)
        x, y, z = (along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)).T
        height, width = self.plain.shape
        column = width * (0.5 - np.arctan2(y, x) / (2.0 * np.pi)) - 0.5
        row = np.clip(height * (0.5 + np.arcsin(np.clip(z, -1.0, 1.0)) / np.pi) - 0.5, 0.0, height - 1.0)
        left, below = np.floor(column).astype(int), np.minimum(np.floor(row).astype(int), height - 2)
        across, up = column - left, row - below
        lit, plain = np.zeros(3), 0.0
        for step_up, step_across in ((0, 0), (0, 1), (1, 0), (1, 1)):
            part = (up if step_up else 1.0 - up) * (across if step_across else 1.0 - across) / distances**2
            texel = below + step_up, (left + step_across) % width
            lit, plain = lit + part @ self.lit[texel], plain + part @ self.plain[texel]
        return lit, plain


def find(light, matrix, frame, waits):
    """Return the `Panorama` of an evaluated light at a frame; None if Vellus reads its nodes.

    waits: for the panorama; else the last one of the light, or None, until it is rendered. Raises `HairError`.
    """
    if light.node_tree is None or not unread_nodes.labels_of_light(light):
        return None
    rows = (matrix if _is_placed(light) else np.eye(4)).tolist()
    found = hashlib.blake2b(world_digest.digest_of(light).encode(), digest_size=16)
    found.update(repr((SIZE, WIDE_SIZE, AREA_SIZE, rows, [getattr(light, name, None) for name in _SETTINGS])).encode())
    path = kept_files.folder("lights") / f"{found.hexdigest()}.npz"

    def read():
        """Return the `Panorama`, None if there is none or its file was damaged."""
        made = world_panoramas.kept_or_rendered("light", light, path, waits, frame=float(frame), matrix=rows)
        shown, is_scaled = made or picture_jobs.last_of(light), _is_scaled(light)
        return None if shown is None else picture_cache.get((shown, is_scaled), lambda: _read(shown, is_scaled))

    return picture_jobs.read(read, waits)


def _is_placed(light):
    """Whether the panorama of a light depends on its place."""
    return any(node.type in _WORLD_NODES for node in nodes_of(light.node_tree))


def _is_scaled(light):
    """Whether the scale of a light distorts its panorama."""
    return light.type in {"POINT", "SPOT"} and not _is_placed(light)


def _read(path, is_scaled):
    """Return the `Panorama` of a file; None if it is damaged, and it is rendered again."""
    try:
        with path.open("rb") as file, np.load(file) as found:
            lit, plain = found["lit"].astype(float), found["plain"].astype(float)
    except (OSError, ValueError, KeyError, zipfile.BadZipFile):
        path.unlink(missing_ok=True)
        return None
    return Panorama(lit, plain, is_scaled)
