# SPDX-License-Identifier: GPL-3.0-or-later
"""Alembic files as other programs write them."""

import io

import numpy as np

from hair_addon.core.files.alembic.writer import AlembicWriter, Property

CURVES, TRANSFORM = {"schema": "AbcGeom_Curve_v2"}, {"schema": "AbcGeom_Xform_v3"}
LINEAR, CUBIC, ANY_ORDER = 1, 0, 2
BEZIER, BSPLINE, CATMULL_ROM, HERMITE = 1, 2, 3, 4


class File:
    """An archive written object by object."""

    def __init__(self, application="Maya 2026"):
        self.bytes = io.BytesIO()
        self.writer = AlembicWriter(self.bytes, application, 24.0)
        self.times = self.writer.add_sampling(1.0 / 24.0, 1.0 / 24.0)

    def moving(self, name, kind, extent, samples, is_array=False):
        made = Property(name, kind, extent, "", is_array=is_array, sampling=self.times)
        for sample in samples:
            self.writer.add_sample(made, [np.asarray(sample, {"float32": "<f4", "float64": "<f8"}[kind])])
        return made

    def curves(self, name, points, counts, kind=LINEAR, basis=0, wrap=0, extra=(), parameters=()):
        write = self.writer
        place = points if isinstance(points, Property) else write.array("P", "float32", np.float32(points))
        properties = [
            place,
            write.array("nVertices", "int32", counts),
            write.scalar("curveBasisAndType", "uint8", (kind, wrap, basis, basis)),
            *extra,
        ]
        if parameters:
            properties.append(write.compound(".arbGeomParams", parameters))
        return write.object(name, CURVES, [write.compound(".geom", properties)])

    def transform(self, name, children, codes, values, inherits=True):
        write = self.writer
        values = values if isinstance(values, Property) else write.scalar(".vals", "float64", values)
        properties = [
            write.scalar(".inherits", "bool", inherits),
            write.scalar(".ops", "uint8", [code << 4 for code in codes]),
            values,
        ]
        return write.object(name, TRANSFORM, [write.compound(".xform", properties)], children)

    def text(self, name, text):
        made = Property(name, "string", 1, "")
        self.writer.add_sample(made, [text.encode() + b"\0"], 1)
        return made

    def write(self, path, *children):
        self.writer.close(children)
        path.write_bytes(self.bytes.getvalue())


def of_maya(path, lines):
    """Write a file in centimeters with Y up, an object for each curve, and diameters of a tenth of a millimeter."""
    file, children = File("Maya 2026"), []
    for number, line in enumerate(100.0 * lines[..., [0, 2, 1]] * [1.0, 1.0, -1.0]):
        width = file.writer.array("width", "float32", np.float32([0.01]))
        shape = file.curves(f"curveShape{number}", line - [3.0, 0.0, 0.0], [len(line)], extra=[width])
        children.append(file.transform(f"curve{number}", [shape], [1], [3.0, 0.0, 0.0]))
    file.write(path, *children)
