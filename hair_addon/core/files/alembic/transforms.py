# SPDX-License-Identifier: GPL-3.0-or-later
"""Transforms of [Alembic26] files at a time: stacks of operations, each of which may be animated."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from .reader import Archive, Damaged, Property

# Operations, and the number of channels of each.
_SCALE, _TRANSLATE, _ROTATE, _MATRIX, _ROTATE_X, _ROTATE_Y, _ROTATE_Z = range(7)
_CHANNELS = {_SCALE: 3, _TRANSLATE: 3, _ROTATE: 4, _MATRIX: 16, _ROTATE_X: 1, _ROTATE_Y: 1, _ROTATE_Z: 1}
_AXES = {_ROTATE_X: (1.0, 0.0, 0.0), _ROTATE_Y: (0.0, 1.0, 0.0), _ROTATE_Z: (0.0, 0.0, 1.0)}


def times_of(properties: Iterable[Property]) -> np.ndarray:
    """Return the times (T,) [s], ascending, at which any property changes, beginning with the first sample."""
    properties = [one for one in properties if len(one.times)]
    moving = [one.times for one in properties if len(one.times) > 1]
    return np.unique(np.concatenate(moving or [one.times[:1] for one in properties[:1]] or [np.zeros(0)]))


def values_at(archive: Archive, target: Property, time: float) -> np.ndarray:
    """Return the numbers of a property at a time, linear between samples of equal size."""
    after = int(np.searchsorted(target.times, time, side="right"))
    before = max(after - 1, 0)
    values = archive.values(target, before)
    if isinstance(values, list):
        raise Damaged
    if after in (0, len(target.times)) or target.times[before] >= time:
        return values
    part = (time - target.times[before]) / (target.times[after] - target.times[before])
    others = archive.values(target, after)
    return values if len(others) != len(values) else (1.0 - part) * values + part * others


def matrix_at(archive: Archive, stack: Sequence[Mapping[str, Property]], time: float) -> np.ndarray:
    """Return the object-to-world matrix (4, 4) float64; stack: properties of the parent transforms, topmost first."""
    matrix = np.eye(4)
    for properties in stack:
        if ".inherits" in properties and not values_at(archive, properties[".inherits"], time).any():
            matrix = np.eye(4)
        if ".ops" in properties and ".vals" in properties:
            codes = values_at(archive, properties[".ops"], time).ravel().astype(np.int64) >> 4
            matrix = matrix @ _product(codes.tolist(), values_at(archive, properties[".vals"], time).ravel())
    if not np.isfinite(matrix).all():
        raise Damaged
    return matrix


def _product(codes, values):
    """Return the matrix of operations, of which the last one is applied to points first."""
    matrix, place = np.eye(4), 0
    for code in codes:
        size = _CHANNELS.get(code, 0)
        if not size or place + size > len(values):
            raise Damaged
        matrix = matrix @ _operation(code, values[place : place + size].astype(np.float64))
        place += size
    return matrix


def _operation(code, values):
    """Return the matrix (4, 4) for column vectors; files store matrices for row vectors."""
    if code == _MATRIX:
        return values.reshape(4, 4).T
    matrix = np.eye(4)
    if code == _TRANSLATE:
        matrix[:3, 3] = values
    elif code == _SCALE:
        matrix[:3, :3] = np.diag(values)
    elif code == _ROTATE:
        matrix[:3, :3] = _rotation(values[:3], values[3])
    else:
        matrix[:3, :3] = _rotation(np.array(_AXES[code]), values[0])
    return matrix


def _rotation(axis, degrees):
    """Return a rotation (3, 3) by Rodrigues' formula; angles in files are in degrees."""
    length = np.linalg.norm(axis)
    if not length > 0.0:
        return np.eye(3)
    x, y, z = axis / length
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle = np.radians(degrees)
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)
