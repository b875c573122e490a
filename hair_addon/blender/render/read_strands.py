# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands of Curves for drawing: with the same point count, without strands that have invalid coordinates."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core import geometry
from ...core.errors import HairError
from ...core.geometry import strands
from ...core.grooming import groom
from ...core.shading import strand_looks
from ...core.shading.strand_looks import StrandLooks
from ..data.maps import strand_maps
from ..data.strands import attributes, curves
from ..host import notices
from ..host.notices import name_of


@dataclass(frozen=True)
class ReadStrands:
    """Valid strands in local coordinates."""

    points: np.ndarray  # (S, P, 3) float32
    radii: np.ndarray  # (S, P) float32
    randoms: np.ndarray  # (S,) float32
    wetness: np.ndarray | None  # (S,) float32, None if strands do not differ
    looks: StrandLooks | None  # (S,), None without maps
    is_sound: np.ndarray | None  # (N,) bool: whether each curve is valid, None if all are
    note: HairError | None  # about curves that are left out

    @property
    def arrays(self) -> tuple[np.ndarray | StrandLooks | None, ...]:
        """Arguments of `strand_textures.upload_strands`."""
        return self.points, self.radii, self.randoms, self.wetness, self.looks


def are_same(arrays: Sequence[Any], others: Sequence[Any]) -> bool:
    """Whether the `arrays` of strands are equal to others."""
    return _are_equal(arrays[0], others[0]) and have_same_details(arrays, others)


def have_same_details(arrays: Sequence[Any], others: Sequence[Any]) -> bool:
    """Whether the `arrays` of strands are equal to others, except for the positions of points."""
    (points, *numbers, looks), (their_points, *their_numbers, their_looks) = arrays, others
    is_equal = points.shape == their_points.shape and all(map(_are_equal, numbers, their_numbers))
    return is_equal and strand_looks.are_same(looks, their_looks)


def _are_equal(values, others):
    """Whether arrays, or None, are equal; changed values usually differ everywhere, so a few are compared first."""
    if values is None or others is None or values.shape != others.shape:
        return values is others
    if values.ctypes.data == others.ctypes.data and values.strides == others.strides:
        return True  # the same memory
    some = slice(None, None, -(-len(values) // 100) or None)
    return np.array_equal(values[some], others[some]) and np.array_equal(values, others)


def read(datablock: Any, known_radii: np.ndarray | None = None, spare_radii: np.ndarray | None = None) -> ReadStrands:
    """Read the strands of stored or evaluated Curves; those with infinite or excessive coordinates are left out.

    A message about these is printed once per datablock. Curves with fewer points than the longest are resampled, and
    Catmull-Rom splines to at least the point count of strands. known_radii, spare_radii: of `curves.read_radii`. Raises
    `HairError` if nothing can be drawn.
    """
    counts = curves.point_counts(datablock)
    if not len(counts):
        raise HairError('"{name}" has no strands to draw.', name=name_of(datablock))
    points, randoms = curves.read_points(datablock), curves.read_randoms(datablock)
    radii = curves.read_radii(datablock, known_radii, spare_radii)
    wetness, is_smooth, note = curves.read_wetness(datablock), attributes.are_smooth(datablock), None
    looks = strand_maps.read_looks(datablock)
    is_sound = _are_sound(points, counts)
    if is_sound is not None:
        note = _left_out(datablock, is_sound)
        of_point = np.repeat(is_sound, counts)
        points, radii = points[of_point], radii[of_point]
        counts, randoms, is_smooth = counts[is_sound], randoms[is_sound], is_smooth[is_sound]
        wetness = None if wetness is None else wetness[is_sound]
        looks = None if looks is None else looks[is_sound]
    most = int(counts.max())
    if is_smooth.any():
        most = max(most, groom.POINT_COUNT)
    if (counts == most).all():
        points, radii = points.reshape(-1, most, 3), radii.reshape(-1, most)
    else:
        starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
        radii = strands.resample_values(radii, points, starts, most)
        points = geometry.curves.resampling.resample(points, starts, most, is_smooth)
    return ReadStrands(points, radii, randoms, wetness, looks, is_sound, note)


def read_root_uvs(datablock: Any, is_sound: np.ndarray | None) -> np.ndarray | None:
    """Return the UVs (S, 2) float32 of the roots of `ReadStrands`, or None; is_sound: theirs."""
    uvs = attributes.read(datablock, "surface_uv_coordinate", "FLOAT2", "CURVE")
    if uvs is None:
        return None
    return np.nan_to_num(uvs if is_sound is None else uvs[is_sound], posinf=0.0, neginf=0.0)


def _are_sound(points, counts):
    """Return (N,) bool: whether all points of a curve are valid; None if all are. points: (M, 3), curve after curve."""
    flat = points.ravel()
    # A small sum of squares proves that all points are valid, in a tenth of the time.
    with np.errstate(over="ignore", invalid="ignore"):
        is_small = flat @ flat <= notices.LARGEST
    if is_small:
        return None
    with np.errstate(invalid="ignore"):
        is_point_sound = (np.abs(points) <= notices.LARGEST).all(axis=1)
    if is_point_sound.all():
        return None
    broken = np.repeat(np.arange(len(counts)), counts)[~is_point_sound]
    is_sound = np.ones(len(counts), bool)
    is_sound[broken] = False
    return is_sound


def _left_out(datablock, is_sound):
    """Print once that some strands of Curves are left out. Raises `HairError` if all of them are."""
    name = name_of(datablock)
    if not is_sound.any():
        raise HairError('"{name}" is not drawn: all of its strands have non-finite coordinates.', name=name)
    sentence = '"{name}" is drawn without the strands that have non-finite coordinates: undo, or delete those strands.'
    note = HairError(sentence, name=name)
    notices.say(str(note))
    return note
