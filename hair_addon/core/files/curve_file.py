# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves of a file in any format: readers return a `CurveFile`, which all users of curves accept.

A reader is a function of a path that returns a `CurveFile` or raises `HairError`. Curves other than polylines and
Catmull-Rom splines through all of their points are evaluated to polylines; closed curves repeat their first point.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import HairError
from ..geometry.curves import bezier_segments

# Extensions of files with curves, other than .blend.
ENDINGS = (".abc", ".usd", ".usdc", ".usda", ".usdz", ".npz", ".hair", ".data", ".bin", ".ply", ".obj", ".tfx")

# The warning for animated splines: Blender plays only polylines.
SPLINES_MOVE = "{path} is animated: its Catmull-Rom splines become polylines."

# Meters in a unit, by its name in the interface.
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048, "km": 1000.0}

# Up axis → matrix (3, 3) from coordinates with this axis to Blender's, with Z up.
TO_Z_UP = {
    "X": np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
    "Y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "Z": np.eye(3),
}


def parsed_unit(text: str) -> float:
    """Return the meters in a unit, given by its name or as a number. Raises `HairError`."""
    if text in UNITS:
        return UNITS[text]
    try:
        meters = float(text)
    except ValueError:
        meters = 0.0
    if not 0.0 < meters < 1e9:
        raise HairError(
            "{unit} is not a unit: use {names}, or meters in a unit as a number.",
            unit=" ".join(text.split()),
            names=", ".join(UNITS),
        )
    return meters


@dataclass(frozen=True)
class Convention:
    """Unit and up axis of coordinates; None where unspecified.

    meters: length of a unit; up: X, Y or Z.
    """

    meters: float | None = None
    up: str | None = None

    def over(self, other: "Convention") -> "Convention":
        """Return this convention with unspecified values taken from another."""
        return Convention(other.meters if self.meters is None else self.meters, self.up or other.up)


@dataclass(frozen=True)
class Motion:
    """Points at several times: times (T,) [s], ascending; points_at: index of a time → all points (N, 3)."""

    times: np.ndarray
    points_at: Callable[[int], np.ndarray]


@dataclass(frozen=True)
class CurveSet:
    """The C curves of one object of a file, with N points in all, in the file's world coordinates.

    name: of the object, for the user; points: (N, 3), concatenated over the curves; counts: (C,) numbers of points;
    is_smooth: (C,) bool, Catmull-Rom splines whose end points count twice, as Blender draws them; radii: (N,), None if
    the file has no widths; is_guide: None if the file does not specify it. Attributes of Vellus and Unreal, None if
    missing: ids (C,) int32; root_uvs (C, 2); guide_ids (C, 3) int32, IDs of guides of the same file, and guide_weights
    (C, 3); colors (N, 3), linear RGB. motion: `Motion` of animated points.
    """

    name: str
    points: np.ndarray
    counts: np.ndarray
    is_smooth: np.ndarray
    radii: np.ndarray | None = None
    is_guide: bool | None = None
    group_id: int = 0
    group_name: str = ""
    ids: np.ndarray | None = None
    root_uvs: np.ndarray | None = None
    guide_ids: np.ndarray | None = None
    guide_weights: np.ndarray | None = None
    colors: np.ndarray | None = None
    motion: Motion | None = None

    def __len__(self) -> int:
        return len(self.counts)

    def placed(self, meters: float, up: str) -> "CurveSet":
        """Return the curves in meters with Z up, float32; meters: length of the file's unit; up: its up axis."""
        turn, motion = TO_Z_UP[up] * meters, self.motion

        def turned(points):
            with np.errstate(over="ignore", invalid="ignore"):  # non-finite points are reported and skipped later
                return (np.asarray(points, np.float64) @ turn.T).astype(np.float32)

        if motion is not None:
            points_at = motion.points_at
            motion = Motion(motion.times, lambda index: turned(points_at(index)))
        with np.errstate(over="ignore", invalid="ignore"):
            radii = None if self.radii is None else (self.radii.astype(np.float64) * meters).astype(np.float32)
        return replace(self, points=turned(self.points), radii=radii, motion=motion)

    def some(self, is_chosen: np.ndarray) -> "CurveSet":
        """Return the chosen curves; is_chosen: (C,) bool."""
        if is_chosen.all():
            return self
        rows, motion = np.repeat(is_chosen, self.counts), self.motion
        if motion is not None:
            points_at = motion.points_at
            motion = Motion(motion.times, lambda index: points_at(index)[rows])

        def of_curves(values):
            return None if values is None else values[is_chosen]

        return replace(
            self,
            points=self.points[rows],
            counts=self.counts[is_chosen],
            is_smooth=self.is_smooth[is_chosen],
            radii=None if self.radii is None else self.radii[rows],
            colors=None if self.colors is None else self.colors[rows],
            ids=of_curves(self.ids),
            root_uvs=of_curves(self.root_uvs),
            guide_ids=of_curves(self.guide_ids),
            guide_weights=of_curves(self.guide_weights),
            motion=motion,
        )


def as_polylines(curves: CurveSet) -> CurveSet:
    """Return the curves with splines as polylines, which have the same counts of points at all times."""
    counts, is_smooth, motion = curves.counts, curves.is_smooth, curves.motion
    columns = [values for values in (curves.points, curves.colors, curves.radii) if values is not None]
    values, new_counts, lines = bezier_segments.smooth_lines(np.column_stack(columns), counts, is_smooth)
    if motion is not None:
        points_at = motion.points_at
        motion = Motion(
            motion.times, lambda index: bezier_segments.smooth_lines(points_at(index), counts, is_smooth, lines)[0]
        )
    return replace(
        curves,
        points=values[:, :3],
        counts=new_counts,
        is_smooth=np.zeros(len(counts), bool),
        radii=None if curves.radii is None else values[:, -1],
        colors=None if curves.colors is None else values[:, 3:6],
        motion=motion,
    )


@dataclass(frozen=True)
class CurveFile:
    """The objects of a file that have curves.

    stated: unit and up axis in the file; usual: the default for files of this kind; notes: warnings for the user.
    """

    sets: list[CurveSet]
    stated: Convention = Convention()
    usual: Convention = Convention(1.0, "Z")
    notes: list[HairError] = field(default_factory=list)


def join(sets: Sequence[CurveSet]) -> CurveSet:
    """Return one set with the curves of sets in equal coordinates. Attributes that any of the sets lacks are dropped.

    Radii are an exception: curves without radii get 0, which means none. Motion is kept if all moving sets have the
    same times.
    """
    if len(sets) == 1:
        return sets[0]

    radii = None
    if any(one.radii is not None for one in sets):
        radii = np.concatenate([np.zeros(len(s.points), np.float32) if s.radii is None else s.radii for s in sets])
    return replace(
        sets[0],
        points=np.concatenate([one.points for one in sets]),
        counts=np.concatenate([one.counts for one in sets]),
        is_smooth=np.concatenate([one.is_smooth for one in sets]),
        radii=radii,
        ids=_joined([one.ids for one in sets]),
        root_uvs=_joined([one.root_uvs for one in sets]),
        guide_ids=_joined([one.guide_ids for one in sets]),
        guide_weights=_joined([one.guide_weights for one in sets]),
        colors=_joined([one.colors for one in sets]),
        motion=_joined_motion(sets),
    )


def _joined(values: list[np.ndarray | None]) -> np.ndarray | None:
    present = [value for value in values if value is not None]
    return np.concatenate(present) if len(present) == len(values) else None


def _joined_motion(sets):
    motions = [one.motion for one in sets]
    moving = [motion for motion in motions if motion is not None]
    if not moving or any(not np.array_equal(motion.times, moving[0].times) for motion in moving):
        return None

    def points_at(index):
        return np.concatenate(
            [s.points if m is None else m.points_at(index) for s, m in zip(sets, motions, strict=True)]
        )

    return Motion(moving[0].times, points_at)
