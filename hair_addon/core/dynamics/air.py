# SPDX-License-Identifier: GPL-3.0-or-later
"""Force fields: velocity of the air, accelerations and drag at each point.

Falloff, distances and shapes are the same as in Blender's force fields (effect.cc in its source). The quantities
differ: *Wind* is a velocity of the air, *Turbulence* adds noise in space and time to this velocity, *Force* and
*Vortex* are accelerations, and *Drag* multiplies the drag of air.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from ..errors import HairError
from ..kernels import kernel_cache, parallel
from ..kernels.checks import require_count

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

KINDS = ("WIND", "TURBULENCE", "FORCE", "VORTEX", "DRAG")
SHAPES = ("POINT", "LINE", "PLANE")
FALLOFFS = ("SPHERE", "TUBE", "CONE")
DIRECTIONS = ("BOTH", "POSITIVE", "NEGATIVE")
MOST_FIELDS = 1024
LARGEST = 1e6  # largest strength of a field

_WIND, _TURBULENCE, _FORCE, _VORTEX, _DRAG = (wp.constant(index) for index in range(len(KINDS)))
_POINT, _LINE, _PLANE = (wp.constant(index) for index in range(len(SHAPES)))
_SPHERE, _TUBE, _CONE = (wp.constant(index) for index in range(len(FALLOFFS)))
_POSITIVE, _NEGATIVE = wp.constant(1), wp.constant(2)
_LEAST_ROWS = 512  # least number of points for a thread
_OCTAVES = wp.constant(3)
_DEGREES = wp.constant(180.0 / math.pi)


@dataclass(frozen=True)
class ForceField:
    """A force field; values have the names and meanings of `bpy.types.FieldSettings`.

    origin: (3,) [m]; axis: (3,) direction of the field's Z axis; strength: Wind and Turbulence [m/s], Force [m/s²],
    Vortex [1/s] or, with the shape POINT, [1/s²], Drag: a number added to the factor 1; flow: damping of hair in Force
    and Vortex [1/s], unused in Wind and Turbulence, where the drag of air replaces flow; distances [m]: None if unused.
    """

    kind: str
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    strength: float = 1.0
    flow: float = 0.0
    shape: str = "POINT"
    falloff: str = "SPHERE"
    direction: str = "BOTH"  # side of the origin, along the axis, on which the field acts
    power: float = 0.0
    minimum: float | None = None
    maximum: float | None = None
    radial_power: float = 0.0  # radial values are for TUBE and CONE
    radial_minimum: float | None = None  # an angle [rad] for CONE
    radial_maximum: float | None = None
    is_gravitation: bool = False  # Force: the strength is divided by the squared distance
    size: float = 0.0  # of the noise of Turbulence [m]; 0 means 1 m
    is_global: bool = False  # Turbulence: noise in world space, not relative to the object
    seed: int = 1

    def problem(self) -> str | None:
        """Return the reason why this field cannot act; None if it can act."""
        names = ((self.kind, KINDS), (self.shape, SHAPES), (self.falloff, FALLOFFS), (self.direction, DIRECTIONS))
        for name, known in names:
            if name not in known:
                return f"{name} is not supported"
        limits = (self.minimum, self.maximum, self.radial_minimum, self.radial_maximum)
        values = (*self.origin, *self.axis, self.strength, self.flow, self.power, self.radial_power, self.size)
        values += tuple(0.0 if value is None else value for value in limits)
        if not all(math.isfinite(value) and abs(value) <= LARGEST for value in values):
            return "its settings are not finite, or too large"
        return None if np.linalg.norm(self.axis) > 1e-12 else "its object's scale is zero"


@wp.struct
class _Field:
    kind: int
    shape: int
    falloff: int
    direction: int
    origin: wp.vec3
    axis: wp.vec3
    strength: float
    flow: float
    power: float
    minimum: float
    maximum: float
    radial_power: float
    radial_minimum: float
    radial_maximum: float
    is_gravitation: int
    per_size: float
    is_global: int
    seed: wp.uint32


class Air:
    """Effect of force fields on points: arrays (groups, rows, lanes) float32 on one device, in the solver's layout.

    airs: velocity of the air [m/s], 3 rows per point; accelerations: [m/s²], 3 rows; drags: factor of air drag, 1 row.
    """

    def __init__(self, point_shape: tuple[int, int, int], device: wp.DeviceLike = "cpu") -> None:
        """point_shape: (groups, points, lanes)."""
        groups, points, lanes = point_shape
        self._shape = point_shape
        self.device = wp.get_device(device)
        self.airs, self.accelerations = (
            wp.zeros((groups, 3 * points, lanes), dtype=float, device=self.device) for _ in range(2)
        )
        self.drags = wp.full(point_shape, 1.0, dtype=float, device=self.device)

    def blow(self, fields: Sequence[ForceField], positions: Any, velocities: Any, time: float) -> list[HairError]:
        """Evaluate fields at positions [m] of points with velocities [m/s], 3 rows per point, at a time [s].

        Returns one error with the reason for each field that cannot act and is ignored. Raises `HairError` for arrays
        of other shapes.
        """
        groups, points, lanes = self._shape
        for array in (positions, velocities):
            wanted_shape = groups, 3 * points, lanes
            for name, count, wanted in zip(("groups", "rows", "lanes"), array.shape, wanted_shape, strict=True):
                require_count(name, count, wanted)
        problems = [(index, field.problem()) for index, field in enumerate(fields)]
        acting = [field for field, (_, problem) in zip(fields, problems, strict=True) if problem is None]
        notes = [
            HairError("Force field {number} does not act on hair: {cause}.", number=index + 1, cause=problem)
            for index, problem in problems
            if problem
        ]
        rows = wp.array([_row_of(field) for field in acting[:MOST_FIELDS]], dtype=_Field, device=self.device)
        kernel_cache.load(self.device, _blow.module)
        count = groups * points * lanes
        shares = parallel.share_count(count, self.device, _LEAST_ROWS)
        outputs = [self.airs, self.accelerations, self.drags]
        inputs = [rows, positions, velocities, float(time), points]
        parallel.launch_shares(_blow, count, inputs, [outputs] * shares, self.device)
        return notes


def _row_of(field):
    row = _Field()
    row.kind, row.shape = KINDS.index(field.kind), SHAPES.index(field.shape)
    row.falloff, row.direction = FALLOFFS.index(field.falloff), DIRECTIONS.index(field.direction)
    row.origin = wp.vec3(*field.origin)
    row.axis = wp.normalize(wp.vec3(*(np.asarray(field.axis) / np.abs(field.axis).max())))
    row.strength, row.flow, row.power, row.radial_power = field.strength, field.flow, field.power, field.radial_power
    # Blender's formula uses a cone's angles in degrees.
    unit = 180.0 / math.pi if field.falloff == "CONE" else 1.0
    row.minimum, row.maximum = _limit(field.minimum, -1.0), _limit(field.maximum, math.inf)
    row.radial_minimum, row.radial_maximum = (
        _limit(value, unused, unit)
        for value, unused in ((field.radial_minimum, -1.0), (field.radial_maximum, math.inf))
    )
    row.is_gravitation, row.is_global = int(field.is_gravitation), int(field.is_global)
    row.per_size, row.seed = 1.0 / field.size if abs(field.size) > 1e-6 else 1.0, field.seed & 0xFFFFFFFF
    return row


def _limit(value, unused, unit=1.0):
    return unused if value is None else unit * value


@wp.func
def _falloff_of(distance: float, minimum: float, maximum: float, power: float):
    """Return the fraction of a field's strength at a distance; minimum -1: none."""
    if distance > maximum:
        return 0.0
    if distance < minimum:
        return 1.0
    return wp.pow(1.0 + distance - wp.max(minimum, 0.0), -power)


@wp.func
def _strength_at(field: _Field, offset: wp.vec3, distance: float):
    """Return the fraction of a field's strength; offset: from its origin; distance: from its point, line or plane."""
    along = wp.dot(offset, field.axis)
    if (field.direction == _POSITIVE and along < 0.0) or (field.direction == _NEGATIVE and along > 0.0):
        return 0.0
    if field.falloff == _SPHERE:
        return _falloff_of(distance, field.minimum, field.maximum, field.power)
    part = _falloff_of(wp.abs(along), field.minimum, field.maximum, field.power)
    beside = wp.length(offset - along * field.axis)
    if field.falloff == _CONE:
        beside = _DEGREES * wp.atan2(beside, along)
    return part * _falloff_of(beside, field.radial_minimum, field.radial_maximum, field.radial_power)


@wp.func
def _hash(x: wp.uint32):
    # As in random_numbers.py.
    x = (x ^ (x >> wp.uint32(16))) * wp.uint32(0x7FEB352D)
    x = (x ^ (x >> wp.uint32(15))) * wp.uint32(0x846CA68B)
    return x ^ (x >> wp.uint32(16))


@wp.func
def _signed(bits: wp.uint32):
    """Convert bits to a number in [-1, 1)."""
    return float(bits >> wp.uint32(8)) * wp.static(2.0**-23) - 1.0


@wp.func
def _corner(x: int, y: int, z: int, t: int, seed: wp.uint32):
    """Return the random vector of a lattice point, each component in [-1, 1)."""
    bits = seed * wp.uint32(0x9E3779B9)
    bits = _hash(bits ^ wp.uint32(x))
    bits = _hash(bits ^ wp.uint32(y))
    bits = _hash(bits ^ wp.uint32(z))
    bits = _hash(bits ^ wp.uint32(t))
    second = _hash(bits + wp.uint32(0x85EBCA6B))
    return wp.vec3(_signed(bits), _signed(second), _signed(_hash(second + wp.uint32(0x85EBCA6B))))


@wp.func
def _faded(x: float):
    return x * x * x * (x * (6.0 * x - 15.0) + 10.0)  # [Perlin02]


@wp.func
def _noise(place: wp.vec3, time: float, seed: wp.uint32):
    """Return smooth noise in space and time, each component in [-1, 1): interpolated random vectors on a lattice."""
    x = wp.floor(place[0])
    y = wp.floor(place[1])
    z = wp.floor(place[2])
    t = wp.floor(time)
    fx = _faded(place[0] - x)
    fy = _faded(place[1] - y)
    fz = _faded(place[2] - z)
    ft = _faded(time - t)
    total = wp.vec3()
    for corner in range(16):
        dx = corner & 1
        dy = (corner >> 1) & 1
        dz = (corner >> 2) & 1
        dt = corner >> 3
        weight = wp.abs(1.0 - float(dx) - fx) * wp.abs(1.0 - float(dy) - fy)
        weight *= wp.abs(1.0 - float(dz) - fz) * wp.abs(1.0 - float(dt) - ft)
        total += weight * _corner(int(x) + dx, int(y) + dy, int(z) + dz, int(t) + dt, seed)
    return total


@wp.func
def _turbulence(place: wp.vec3, time: float, seed: wp.uint32):
    """Return noise in octaves, each with half the size, half the duration and half the strength."""
    total = wp.vec3()
    scale = float(1.0)
    for octave in range(_OCTAVES):
        # Beyond this limit, cells are smaller than the resolution of a float.
        if wp.max(wp.abs(place * scale)) < 4.0e6:
            total += _noise(place * scale, time * scale, seed + wp.uint32(octave)) / scale
        scale *= 2.0
    return total


@wp.kernel
def _blow(
    fields: wp.array[_Field],
    positions: wp.array3d[float],
    velocities: wp.array3d[float],
    time: float,
    point_count: int,
    first: int,
    # outputs
    out_airs: wp.array3d[float],
    out_accelerations: wp.array3d[float],
    out_drags: wp.array3d[float],
):
    thread = first + wp.tid()
    lane_count = positions.shape[2]
    lane = thread % lane_count
    point = (thread // lane_count) % point_count
    group = thread // (lane_count * point_count)
    place = wp.vec3()
    velocity = wp.vec3()
    for component in range(3):
        place[component] = positions[group, 3 * point + component, lane]
        velocity[component] = velocities[group, 3 * point + component, lane]
    air = wp.vec3()
    acceleration = wp.vec3()
    drag = float(1.0)
    for index in range(fields.shape[0]):
        field = fields[index]
        offset = place - field.origin
        along = wp.dot(offset, field.axis)
        away = offset  # from the nearest point of the shape
        if field.shape == _LINE or (field.shape == _PLANE and field.kind == _VORTEX):
            away = offset - along * field.axis
        elif field.shape == _PLANE:
            away = along * field.axis
        distance = wp.length(away)
        part = _strength_at(field, offset, distance)
        strength = field.strength * part
        pull = wp.vec3()
        if not part > 0.0:
            continue
        if field.kind == _WIND:
            air += strength * field.axis
        elif field.kind == _TURBULENCE:
            where = offset
            if field.is_global == 1:
                where = place
            air += strength * _turbulence(where * field.per_size, time, field.seed)
        elif field.kind == _DRAG:
            drag += strength
        elif field.kind == _FORCE:
            if field.is_gravitation == 1:
                strength /= wp.max(distance * distance, 1.0e-6)
            pull = strength * wp.normalize(away)
        else:
            swirl = wp.cross(field.axis, offset)
            if field.shape == _POINT:
                pull = strength * distance * wp.normalize(swirl)
            else:
                # Toward the velocity of the vortex, plus the centripetal acceleration.
                pull = strength * (swirl + strength * wp.cross(field.axis, swirl)) - velocity
        if field.kind == _FORCE or field.kind == _VORTEX:
            acceleration += pull - field.flow * part * velocity
    drag = wp.max(drag, 0.0)
    if not (wp.isfinite(wp.length(air)) and wp.isfinite(wp.length(acceleration)) and wp.isfinite(drag)):
        air = wp.vec3()
        acceleration = wp.vec3()
        drag = 1.0
    out_drags[group, point, lane] = drag
    for component in range(3):
        out_airs[group, 3 * point + component, lane] = air[component]
        out_accelerations[group, 3 * point + component, lane] = acceleration[component]
