# SPDX-License-Identifier: GPL-3.0-or-later
"""Writer of transforms and curves in the AbcGeom schemas of [Alembic26], with geometry parameters."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from . import ogawa
from .writer import TYPES, AlembicWriter, Object, Property, serialized

# Number of values of a parameter: one in all, one for each curve, or one for each point.
SCOPES = {"constant": "con", "uniform": "uni", "vertex": "vtx"}

_CURVES = {"schema": "AbcGeom_Curve_v2", "schemaBaseType": "AbcGeom_GeomBase_v1"}
_TRANSFORM = {"schema": "AbcGeom_Xform_v3"}
_LINEAR = (1, 0, 0, 0)  # type, periodicity, and twice the basis


@dataclass(frozen=True)
class Parameter:
    """A geometry parameter, with its values in parts: arrays of (n,) or (n, extent) numbers, or lists of str.

    meaning: interpretation of vectors, as in metadata: vector, point, rgb.
    """

    name: str
    type: str
    scope: str
    parts: Iterable[ArrayLike]
    extent: int = 1
    meaning: str = ""


@dataclass
class Curves:
    """Polylines that are being written, from `CurvesWriter.add`; `CurvesWriter.write_points` adds points."""

    name: str
    properties: list[Property]
    points: Property
    bounds: Property
    parameters: list[Property]
    children: list[Object] = field(default_factory=list)


class CurvesWriter:
    """Writes curves and transforms to an `AlembicWriter`; sampling: index of the points' time sampling, 0 for static.

    Call `write_points` once for each time, then `close`.
    """

    def __init__(self, archive: AlembicWriter, sampling: int = 0) -> None:
        self._archive, self._sampling = archive, sampling

    def add(self, name: str, counts: np.ndarray, widths: Parameter | None, parameters: Iterable[Parameter]) -> Curves:
        """Write everything but the points of polylines; counts: (S,) numbers of points."""
        archive = self._archive
        properties = [
            archive.array("nVertices", "int32", counts),
            archive.scalar("curveBasisAndType", "uint8", _LINEAR),
        ]
        if widths is not None:
            properties.append(self._parameter(widths))
        place = serialized({"geoScope": SCOPES["vertex"], "interpretation": "point"})
        points = Property("P", "float32", 3, place, is_array=True, sampling=self._sampling)
        bounds = Property(".selfBnds", "float64", 6, serialized({"interpretation": "box"}), sampling=self._sampling)
        return Curves(name, properties, points, bounds, [self._parameter(one) for one in parameters])

    def write_points(self, curves: Curves, parts: Iterable[np.ndarray]) -> None:
        """Write the points at the next time: arrays of (n, 3) numbers, concatenated over all curves."""
        bounds = np.array([np.full(3, np.inf), np.full(3, -np.inf)])
        self._archive.add_sample(curves.points, _measured(parts, bounds))
        self._archive.add_sample(curves.bounds, [bounds])

    def close(self, curves: Curves) -> Object:
        """Write the object of curves whose points are complete."""
        archive = self._archive
        parameters = [archive.compound(".arbGeomParams", curves.parameters)] if curves.parameters else []
        every = [curves.bounds, curves.points, *curves.properties, *parameters]
        schema = archive.compound(".geom", every, _CURVES)
        return archive.object(curves.name, _object_metadata(_CURVES, ".geom"), [schema])

    def transform(self, name: str, children: Sequence[Object], parameters: Iterable[Parameter] = ()) -> Object:
        """Write an identity transform with children."""
        archive = self._archive
        written = [self._parameter(one) for one in parameters]
        properties = [archive.scalar(".inherits", "bool", True)]
        properties += [archive.compound(".arbGeomParams", written)] if written else []
        schema = archive.compound(".xform", properties, _TRANSFORM)
        return archive.object(name, _object_metadata(_TRANSFORM, ".xform"), [schema], children)

    def _parameter(self, parameter):
        """Write a geometry parameter; returns its property."""
        metadata = {
            "isGeomParam": "true",
            "geoScope": SCOPES[parameter.scope],
            "podName": TYPES[parameter.type][1],
            "podExtent": str(parameter.extent),
            "arrayExtent": "1",
            "interpretation": parameter.meaning,
        }
        if parameter.type == "string":
            (texts,) = parameter.parts
            return self._archive.strings(parameter.name, texts, metadata)
        result = Property(parameter.name, parameter.type, parameter.extent, serialized(metadata), is_array=True)
        kind = TYPES[parameter.type][2]
        self._archive.add_sample(result, (np.ascontiguousarray(part, kind) for part in parameter.parts))
        return result


def _measured(parts, bounds) -> Iterator[ogawa.Data]:
    """Yield points in parts as float32; extends bounds, (2, 3) float64, to include the points."""
    for part in parts:
        points = np.ascontiguousarray(part, np.float32)
        if len(points):
            bounds[0] = np.minimum(bounds[0], points.reshape(-1, 3).min(axis=0))
            bounds[1] = np.maximum(bounds[1], points.reshape(-1, 3).max(axis=0))
        yield points


def _object_metadata(schema, place):
    return {**schema, "schemaObjTitle": f"{schema['schema']}:{place}"}
