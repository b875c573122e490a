# SPDX-License-Identifier: GPL-3.0-or-later
"""Transforms of [Alembic26] files at a time: stacks of operations, each of which may move."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from .alembic_reader import Archive, Damaged, Property

# Operation → numbers that it takes.
_SCALE, _TRANSLATE, _ROTATE, _MATRIX, _ROTATE_X, _ROTATE_Y, _ROTATE_Z = range(7)
_CHANNELS = {_SCALE: 3, _TRANSLATE: 3, _ROTATE: 4, _MATRIX: 16, _ROTATE_X: 1, _ROTATE_Y: 1, _ROTATE_Z: 1}
_AXES = {_ROTATE_X: (1.0, 0.0, 0.0), _ROTATE_Y: (0.0, 1.0, 0.0), _ROTATE_Z: (0.0, 0.0, 1.0)}


def times_of(properties: Iterable[Property]) -> np.ndarray:
    """(T,) [s], rising: when any of some properties has another value than before, and the first time of all."""
    properties = [one for one in properties if len(one.times)]
    moving = [one.times for one in properties if len(one.times) > 1]
    return np.unique(np.concatenate(moving or [one.times[:1] for one in properties[:1]] or [np.zeros(0)]))


def values_at(archive: Archive, target: Property, time: float) -> np.ndarray:
    """The numbers of a property at a time, linear between samples that have as many."""
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
    """(4, 4) float64: from an object to the world; stack: properties of the transforms that it is in, from the top."""
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
    """The matrix of operations: the last one meets points first."""
    matrix, place = np.eye(4), 0
    for code in codes:
        size = _CHANNELS.get(code, 0)
        if not size or place + size > len(values):
            raise Damaged
        matrix = matrix @ _operation(code, values[place : place + size].astype(np.float64))
        place += size
    return matrix


def _operation(code, values):
    """(4, 4), for columns of coordinates; files have them for rows."""
    if code == _MATRIX:
        return values.reshape(4, 4).T
    made = np.eye(4)
    if code == _TRANSLATE:
        made[:3, 3] = values
    elif code == _SCALE:
        made[:3, :3] = np.diag(values)
    elif code == _ROTATE:
        made[:3, :3] = _rotation(values[:3], values[3])
    else:
        made[:3, :3] = _rotation(np.array(_AXES[code]), values[0])
    return made


def _rotation(axis, degrees):
    """(3, 3), by Rodrigues' formula; files have angles in degrees."""
    length = np.linalg.norm(axis)
    if not length > 0.0:
        return np.eye(3)
    x, y, z = axis / length
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle = np.radians(degrees)
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)
