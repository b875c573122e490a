# SPDX-License-Identifier: GPL-3.0-or-later
"""Flow painted by a brush: guides near a stroke on the surface turn toward the direction of the stroke.

Each guide turns as a whole about its root: its lean turns about the surface normal to the direction of the stroke, and
guides that are steeper than the lift are laid down to it. The influence of a piece of the stroke accumulates with its
length, so that a slow mouse and a fast one have the same effect.
"""

import numpy as np
import warp as wp

from ..kernels import parallel
from ..kernels.parallel import Rows
from .guide_shapes import unit
from .guide_tool_settings import FlowSettings

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

_PACE = 0.5  # length of a stroke with its full effect, relative to the radius
_PIECE = 0.125  # length of the longest pieces, relative to the radius
_LEANING = wp.constant(wp.float64(0.2))  # sine of the angle to the normal above which guides have their own direction
_LEAST_SINE = wp.constant(wp.float64(1e-9))  # of an angle: smaller than the rounding of single precision
_FACING = 0.5  # cosine between the normals of root and stroke from which the effect is full


class PaintedFlow:
    """Accumulated effect of a stroke on roots (G, 3) [m] with unit normals (G, 3)."""

    def __init__(self, roots: np.ndarray, normals: np.ndarray, radius: float, strength: float) -> None:
        self._roots, self._normals = np.asarray(roots, np.float64), np.asarray(normals, np.float64)
        self._radius, self._strength = radius, strength
        self._mean = np.zeros((len(roots), 3))
        self.shares = np.zeros(len(roots))  # fraction of the turn, in [0, 1]

    @property
    def directions(self) -> np.ndarray:
        """(G, 3) unit directions along the surface at the roots; zero where the stroke has no effect."""
        height = np.sum(self._mean * self._normals, axis=1, keepdims=True)
        return unit(self._mean - height * self._normals)

    def extend(self, start: np.ndarray, end: np.ndarray, normal: np.ndarray) -> None:
        """Add a segment of a stroke from a point (3,) to another [m], on the surface with a unit normal (3,)."""
        start, along = np.asarray(start, np.float64), np.subtract(end, start, dtype=np.float64)
        length = float(np.linalg.norm(along))
        if not length > 0.0:
            return
        places = (self._roots - start) @ along / length
        beside = np.linalg.norm(self._roots - start - places[:, None] * along / length, axis=1)
        away = np.maximum(np.abs(places - 0.5 * length) - 0.5 * length, 0.0)
        rows = np.flatnonzero(np.maximum(beside, away) < self._radius)
        count = max(np.ceil(length / (_PIECE * self._radius)), 1.0)
        facing = _smoothstep(self._normals[rows] @ normal / _FACING)
        for number in _pieces_near(places[rows] / length * count, self._radius / length * count, count):
            middle = start + (number + 0.5) / count * along
            distances = np.linalg.norm(self._roots[rows] - middle, axis=1)
            effect = self._strength * facing * _smoothstep(1.0 - distances / self._radius)
            effect = 1.0 - (1.0 - effect) ** (length / count / (_PACE * self._radius))
            self._mean[rows] += effect[:, None] * (along / length - self._mean[rows])
            self.shares[rows] += effect * (1.0 - self.shares[rows])


def joined_flow(first: PaintedFlow, second: PaintedFlow) -> tuple[np.ndarray, np.ndarray]:
    """Return (directions (G, 3), shares (G,)) of two strokes that act at once, such as a stroke and its mirror image.

    The order of the strokes does not matter.
    """
    total = first.shares + second.shares
    mean = first.shares[:, None] * first.directions + second.shares[:, None] * second.directions
    agreement = np.linalg.norm(mean, axis=1) / np.where(total > 0.0, total, 1.0)
    return unit(mean), agreement * (total - first.shares * second.shares)


def turned_along(
    points: np.ndarray, normals: np.ndarray, flow: np.ndarray, shares: np.ndarray, settings: FlowSettings
) -> np.ndarray:
    """Return guides (S, P, 3) float32 [m] turned about their roots toward directions (S, 3) by shares (S,) in [0, 1].

    points (S, P, 3) [m]; normals (S, 3) and flow (S, 3): unit, at the roots. Segments keep their lengths; guides
    without share or length, and those without a direction, keep their bits.
    """
    if not points.size:
        return points

    def there(values, kind, scalar):
        return wp.array(np.ascontiguousarray(values, scalar), dtype=kind, device="cpu", copy=False)

    source, turned = there(points, wp.vec3, np.float32), parallel.empty_vectors(points.shape[:2], "cpu")
    inputs = [
        Rows(source),
        *(Rows(there(vectors, wp.vec3d, np.float64)) for vectors in (normals, flow)),
        Rows(there(shares, wp.float64, np.float64)),
        wp.float64(settings.lift),
    ]
    parallel.launch(_turn, len(points), inputs, [turned], "cpu", least_rows=1024)
    return turned.numpy()


def _pieces_near(places, reach, count):
    """Return the numbers of pieces, of which there are `count`, within a reach of places along them [pieces].

    Roots may be near only a few of the many pieces of a long stroke with a small radius.
    """
    steps = int(min(reach, count)) + 2
    nearest = np.unique(np.clip(np.floor(places), 0.0, count - 1.0))
    numbers = np.unique(nearest[:, None] + np.arange(-steps, steps + 1))
    return numbers[(numbers >= 0.0) & (numbers < count)]


def _smoothstep(x):
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


@wp.func
def _unit_of(vector: wp.vec3d):
    size = wp.length(vector)
    if size > wp.float64(0.0):
        return vector / size
    return wp.vec3d()


@wp.func
def _across(direction: wp.vec3d):
    """Return a unit vector perpendicular to a unit vector."""
    axis = wp.vec3d(wp.float64(1.0), wp.float64(0.0), wp.float64(0.0))
    if wp.abs(direction[1]) < wp.abs(direction[0]) and wp.abs(direction[1]) <= wp.abs(direction[2]):
        axis = wp.vec3d(wp.float64(0.0), wp.float64(1.0), wp.float64(0.0))
    elif wp.abs(direction[2]) < wp.abs(direction[0]):
        axis = wp.vec3d(wp.float64(0.0), wp.float64(0.0), wp.float64(1.0))
    return _unit_of(wp.cross(direction, axis))


@wp.func
def _turned(direction: wp.vec3d, target: wp.vec3d, share: wp.float64):
    """As `guide_shapes.turned`, for one direction."""
    cosine = wp.clamp(wp.dot(direction, target), wp.float64(-1.0), wp.float64(1.0))
    aside = target - cosine * direction
    sine = wp.length(aside)
    if sine >= _LEAST_SINE:
        aside = aside / sine
    elif cosine < wp.float64(0.0):
        aside = _across(direction)
    else:
        return direction
    angle = share * wp.atan2(sine, cosine)
    return wp.cos(angle) * direction + wp.sin(angle) * aside


@wp.func
def _rotation(axis: wp.vec3d, angle: wp.float64):
    """Return the rotation about a unit axis; the identity about a zero axis."""
    cross = wp.skew(axis)
    return (
        wp.identity(n=3, dtype=wp.float64) + wp.sin(angle) * cross + (wp.float64(1.0) - wp.cos(angle)) * cross * cross
    )


@wp.kernel
def _turn(
    points: wp.array2d[wp.vec3],
    normals: wp.array[wp.vec3d],
    flow: wp.array[wp.vec3d],
    shares: wp.array[wp.float64],
    lift: wp.float64,
    # outputs
    out_points: wp.array2d[wp.vec3],
):
    guide = wp.tid()
    one = wp.float64(1.0)
    count, share, normal = points.shape[1], shares[guide], normals[guide]
    root = wp.vec3d(points[guide, 0])
    ahead_of = _unit_of(flow[guide] - wp.dot(flow[guide], normal) * normal)
    lean = _unit_of(wp.vec3d(points[guide, count - 1]) - root)
    is_turned = share > wp.float64(0.0) and wp.dot(lean, lean) > wp.float64(0.5)
    is_turned = is_turned and wp.dot(ahead_of, ahead_of) > wp.float64(0.5)
    rotation = wp.identity(n=3, dtype=wp.float64)
    if is_turned:
        # Turn about the normal, if the guide leans to a side.
        height = wp.clamp(wp.dot(lean, normal), -one, one)
        side = lean - height * normal
        leaning = wp.clamp(wp.length(side) / _LEANING, wp.float64(0.0), one)
        leaning = leaning * leaning * (wp.float64(3.0) - wp.float64(2.0) * leaning)
        azimuth = wp.atan2(wp.dot(normal, wp.cross(side, ahead_of)), wp.dot(side, ahead_of))
        around = _rotation(normal, leaning * share * azimuth)
        lean = around * lean
        # Turn toward the surface, if the guide is steeper than the lift.
        side = _unit_of(lean - height * normal)
        ahead = _unit_of(leaning * side + (one - leaning) * ahead_of)
        rise = wp.min(wp.asin(height), lift)
        reached = _turned(lean, wp.cos(rise) * ahead + wp.sin(rise) * normal, share)
        axis = wp.cross(lean, reached)
        rotation = _rotation(_unit_of(axis), wp.atan2(wp.length(axis), wp.dot(lean, reached))) * around
    for point in range(count):
        place = points[guide, point]
        if is_turned:
            place = wp.vec3(root + rotation * (wp.vec3d(place) - root))
        out_points[guide, point] = place
