# SPDX-License-Identifier: GPL-3.0-or-later
"""The way of gathered hair behind its tie: along a drawn line, as one tail, a rope or a braid.

Hair keeps its place in the disk of the tie, in frames that are carried along the line by least rotations [Bishop75].
Ropes and braids end in a second tie and a tuft. Points of all guides are at the same places along a rope or
braid: a strand is a mean of its guides, and a mean of different places along a lock lies outside of the braid.
"""

from dataclasses import dataclass

import numpy as np

from ..guide_shapes import unit
from .gather_settings import GatherSettings

_SAMPLES = 800  # points of a line
LOCKS = {"BRAID": 3, "CORNROWS": 3, "ROPE": 2}  # number of locks of a tail
_OF_PITCH = 8  # minimum number of segments per pitch, in which a lock crosses the middle four times
_ON_WAY = 0.25  # fraction of a guide's segments before the tie; fewer would cut through the head
_TAPER = 0.35  # radius of the tail's end, relative to its widest place
_NARROWING = 0.65  # radius of a braid near its second tie, relative to its widest place
_SECOND_TIE, _TUFT, _TIP = 0.45, 0.55, 0.12  # radii of the second tie, the tuft and its tip, relative to the braid
_TUFT_LENGTH, _TUFT_PART = 2.5, 0.15  # greatest length of a tuft relative to the tail's radius, and to its length


@dataclass(frozen=True)
class TailLine:
    """A line with frames: along (M,) [m] from the tie, centers (M, 3) [m], sides and ups (M, 3) unit and perpendicular.

    reach: length [m] over which the tail's width changes.
    """

    along: np.ndarray
    centers: np.ndarray
    sides: np.ndarray
    ups: np.ndarray
    reach: float

    def at(self, along: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return centers, sides and ups (..., 3) at lengths (...) [m] from the tie."""
        found = []
        for values in (self.centers, self.sides, self.ups):
            found.append(np.stack([np.interp(along, self.along, values[:, axis]) for axis in range(3)], axis=-1))
        return found[0], found[1], found[2]


def tail_line(line: np.ndarray, normal: np.ndarray, reach: float, settings: GatherSettings) -> TailLine:
    """Return the `TailLine` of a drawn line (K, 3) [m] that begins at its tie.

    normal: (3,) unit, of the surface at the tie; reach: length [m] of the longest hair, by which the line is
    continued straight at its end.
    """
    line = np.asarray(line, np.float64)
    start = unit(line[1] - line[0])
    normal = np.asarray(normal, np.float64)
    across = float(np.linalg.norm(np.cross(start, normal)))
    shifted = line + (settings.clearance + settings.tie_radius * across) * normal
    points = np.concatenate([shifted, shifted[-1:] + (reach + 1e-6) * unit(shifted[-1:] - shifted[-2:-1])])
    return framed(points, normal, reach)


def framed(points: np.ndarray, normal: np.ndarray, reach: float) -> TailLine:
    """Return a `TailLine` through points (K, 3) [m], with rounded corners; normal: (3,) unit, of the surface at the
    tie.
    """
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    lengths = np.concatenate([[0.0], np.cumsum(steps)])
    along = np.linspace(0.0, lengths[-1], _SAMPLES)
    centers = _smooth(np.stack([np.interp(along, lengths, points[:, axis]) for axis in range(3)], axis=1))
    tangents = unit(np.gradient(centers, axis=0))
    up = normal - tangents[0] * (normal @ tangents[0])
    if np.linalg.norm(up) < 0.1:
        up = np.eye(3)[np.abs(tangents[0]).argmin()]
    ups = np.empty_like(centers)
    for place, tangent in enumerate(tangents):
        up = unit(up - tangent * (up @ tangent))
        ups[place] = up
    return TailLine(along, centers, unit(np.cross(tangents, ups)), ups, max(reach, 1e-9))


def evened(angles: np.ndarray) -> np.ndarray:
    """Return angles (S,) spread evenly on the circle, in the same order and with the same mean direction.

    Most hair arrives at a tie from one side, so without this, locks that divide the circle would have tenfold
    different amounts of hair.
    """
    order = np.argsort(np.argsort(angles, kind="stable"))
    even = 2.0 * np.pi * (order + 0.5) / len(angles)
    return even - np.angle(np.exp(1j * (even - angles)).sum())


def locks_at(angles: np.ndarray, settings: GatherSettings) -> np.ndarray:
    """Return (S,) int: the lock of a rope or braid that hair at angles (S,) in the disk of the tie joins; else 0."""
    count = LOCKS.get(settings.shape, 1)
    return np.minimum((angles % (2.0 * np.pi) * count / (2.0 * np.pi)).astype(int), count - 1)


def offsets(
    line: TailLine,
    angles: np.ndarray,
    ranks: np.ndarray,
    along: np.ndarray,
    settings: GatherSettings,
) -> np.ndarray:
    """Return (S, M, 2) [m]: the place of the hair of a tail beside its line, along its sides and ups.

    angles (S,), ranks (S,) in [0, 1]: the place in the disk of the tie by equal area; along: (S, M) [m] from the tie.
    """
    place = np.sqrt(ranks)[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return _radius(line, along, settings)[..., None] * place[:, None]


def braided(
    line: TailLine,
    angles: np.ndarray,
    ranks: np.ndarray,
    along: np.ndarray,
    locks: np.ndarray,
    settings: GatherSettings,
) -> np.ndarray:
    """Return (S, M, 2) [m]: the place of the hair of a rope or braid beside its line, as `offsets` does.

    along (M,) [m]: of evenly spaced points of all guides; locks (S,): that hair belongs to.
    """
    unit_radius = np.sqrt(ranks)
    place = unit_radius[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    count, end = LOCKS[settings.shape], second_tie(along, settings.tail_radius, line.reach)
    turn = angles * count
    own = unit_radius[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    pitch = max(settings.pitch, _OF_PITCH * float(along[1] - along[0]))
    phase = 2.0 * np.pi * (along / pitch + (locks / count)[:, None])
    if settings.shape == "ROPE":
        centers, size = 0.5 * np.stack([np.cos(phase), np.sin(phase)], axis=-1), 0.5
    else:  # three locks that cross in turn over and under the middle
        centers, size = np.stack([0.62 * np.sin(phase), 0.36 * np.sin(2.0 * phase)], axis=-1), 0.4
    in_lock = centers + size * own[:, None]
    share = (ease(along / (0.5 * pitch)) * ease((end - along) / (0.5 * pitch)))[:, None]
    grown = settings.tie_radius + ease(along / (0.25 * line.reach)) * (settings.tail_radius - settings.tie_radius)
    radius = grown * narrowed(along, 0.4 * end, end, settings.tail_radius)
    return radius[:, None] * (place[:, None] + share * (in_lock - place[:, None]))


def segment_counts(count: int) -> tuple[int, int]:
    """Return the number of a guide's segments before the tie, and their number behind it."""
    on_way = max(1, round(_ON_WAY * count))
    return on_way, count - on_way


def second_tie(along: np.ndarray, radius: float, reach: float) -> float:
    """Return the place [m] of the second tie of a braid: one of the points `along` (M,) [m].

    radius: [m] of the braid; reach: length [m] of its free part.
    """
    step = float(along[1] - along[0])
    return float(along[-1]) - step * round(min(_TUFT_LENGTH * radius, _TUFT_PART * reach) / step)


def narrowed(along: np.ndarray, start: float, end: float, radius: float) -> np.ndarray:
    """Return factors (M,) of the radius [m] of a braid at places (M,) [m].

    The braid narrows from `start` to its second tie at `end`, and continues as a tuft.
    """
    before = 1.0 - (1.0 - _NARROWING) * ease((along - start) / max(end - start, 1e-9))
    tied = 1.0 - (1.0 - _SECOND_TIE) * ease(1.0 - (end - along) / radius)
    beyond = (along - end) / max(float(along[-1]) - end, 1e-9)
    tuft = _SECOND_TIE + (_TUFT - _SECOND_TIE) * ease(beyond / 0.35) - (_TUFT - _TIP) * ease((beyond - 0.35) / 0.65)
    return np.where(along <= end, before * tied, _NARROWING * tuft)


def _radius(line, along, settings):
    """Return the radius (...) [m] of a tail: the tie's at the start, then the tail's, smaller at the end."""
    part = along / line.reach
    grown = settings.tie_radius + ease(part / 0.25) * (settings.tail_radius - settings.tie_radius)
    return grown * (1.0 - (1.0 - _TAPER) * ease((part - 0.5) / 0.5))


def _smooth(centers):
    """Round the corners of a line in place and return it; the ends do not move."""
    for _ in range(12):
        centers[1:-1] = 0.5 * centers[1:-1] + 0.25 * (centers[:-2] + centers[2:])
    return centers


def ease(part: np.ndarray) -> np.ndarray:
    """Return the smoothstep of numbers, which are clipped to [0, 1]."""
    part = np.clip(part, 0.0, 1.0)
    return part * part * (3.0 - 2.0 * part)
