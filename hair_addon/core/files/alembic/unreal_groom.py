# SPDX-License-Identifier: GPL-3.0-or-later
"""Grooms for Unreal: an Alembic file as specified in [UnrealGroom26], version 1.5, in centimeters with Z up.

    groom                    transform: version, tool, settings
      <group>_guides         transform
        <group>_guidesShape  curves: groom_guide 1
      <group>                transform
        <group>Shape         curves: groom_guide 0

The axes are Blender's, right-handed: Unreal's importer needs the scale (1, -1, 1).
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ...errors import HairError
from .. import groom_curves
from ..groom_curves import Check, GroomCurves, Rows
from .curves import Curves, CurvesWriter, Parameter
from .writer import AlembicWriter

VERSION = (1, 5)
PER_METRE = 100.0

_ROOT = "groom"


class UnrealGroomWriter:
    """Writes a groom; `writing` creates it. Add guides and strands first, then write their points for each time."""

    def __init__(self, archive: AlembicWriter, sampling: int, tool: str, properties: str) -> None:
        self._archive, self._tool, self._properties = archive, tool, properties
        self._still, self._moving = CurvesWriter(archive), CurvesWriter(archive, sampling)
        self._added: list[tuple[Curves, CurvesWriter, Check]] = []

    def add(self, curves: GroomCurves, moves: bool = False) -> int:
        """Write the attributes of curves; returns their number for `write_points`. moves: whether they are animated."""
        writer = self._moving if moves else self._still
        width = Parameter("width", "float32", "vertex", _of_points(curves, curves.widths))
        self._added.append((writer.add(curves.name, curves.counts, width, _parameters(curves)), writer, Check(curves)))
        return len(self._added) - 1

    def write_points(self, number: int, points: Rows) -> None:
        """Write the points (N, 3) [cm] of curves at the next time. Raises `HairError` for non-finite coordinates."""
        curves, writer, check = self._added[number]
        writer.write_points(curves, check.parts(points))

    def notes(self) -> list[HairError]:
        """Return warnings about the treatment of the written curves by Unreal's importer."""
        return [note for _curves, _writer, check in self._added for note in check.notes()]

    def close(self) -> None:
        """Write the objects of the curves and finish the archive. Called by `writing`."""
        objects = []
        for curves, writer, _check in self._added:
            transform = curves.name
            curves.name = f"{transform}Shape"
            objects.append(writer.transform(transform, [writer.close(curves)]))
        self._archive.close([self._still.transform(_ROOT, objects, self._root_parameters())])

    def _root_parameters(self):
        for name, value in zip(("groom_version_major", "groom_version_minor"), VERSION, strict=True):
            yield Parameter(name, "int16", "constant", [[value]])
        for name, text in (("groom_tool", self._tool), ("groom_properties", self._properties)):
            yield Parameter(name, "string", "constant", [[text.replace("\0", "")]])


@contextmanager
def writing(
    path: Path, tool: str, properties: str, rate: float | None = None, first_frame: int = 0
) -> Iterator[UnrealGroomWriter]:
    """Write a groom to a path; the file is complete after the context.

    tool: the program and its version; properties: its settings, for information; rate: frame rate [1/s] of moving
    points, from `first_frame` on, None for a static groom. Raises OSError if the disk is full.
    """
    with open(path, "wb") as file:
        archive = AlembicWriter(file, tool, rate)
        sampling = 0 if rate is None else archive.add_sampling(1.0 / rate, first_frame / rate)
        writer = UnrealGroomWriter(archive, sampling, tool, properties)
        yield writer
        writer.close()


def _parameters(curves) -> Iterator[Parameter]:
    """Yield the geometry parameters of guides or strands."""
    yield Parameter("groom_guide", "int16", "constant", [[int(curves.is_guide)]])
    yield Parameter("groom_group_id", "int32", "constant", [[curves.group_id]])
    yield Parameter("groom_group_name", "string", "constant", [[curves.group_name]])
    yield Parameter("groom_id", "int32", "uniform", [curves.ids])
    if curves.root_uvs is not None:
        yield Parameter("groom_root_uv", "float32", "uniform", [curves.root_uvs], 2, "vector")
    if curves.guide_ids is not None:
        yield Parameter("groom_closest_guides", "int32", "uniform", [curves.guide_ids], 3, "vector")
        yield Parameter("groom_guide_weights", "float32", "uniform", [curves.guide_weights], 3, "vector")
    yield Parameter("groom_width", "float32", "vertex", _of_points(curves, curves.widths))
    if curves.colors is not None:
        yield Parameter("groom_color", "float32", "vertex", _of_points(curves, curves.colors), 3, "rgb")
    if curves.roughness is not None:
        yield Parameter("groom_roughness", "float32", "vertex", _of_points(curves, curves.roughness))
    if curves.radial_roughness is not None:  # not in the specification
        yield Parameter("groom_radial_roughness", "float32", "uniform", [curves.radial_roughness])


def _of_points(curves, rows):
    return (rows(chosen) for chosen in groom_curves.slices(curves.curve_count))
