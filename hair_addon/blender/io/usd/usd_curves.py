# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves of USD files: the drawn shape of BasisCurves, NurbsCurves and HermiteCurves, after [UsdCurves24].

Polylines keep their points, as do Catmull-Rom splines with doubled end points, which Blender draws alike. All others
become polylines (`core.geometry.curves.bezier_segments`).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ....core.errors import HairError
from ....core.files import curve_file
from ....core.files.curve_file import Convention, CurveFile, CurveSet, Motion
from ....core.files.groom_curves import GUIDE_SLOTS
from . import usd_shapes, usd_stage

_USUAL = Convention(0.01, "Y")  # USD's defaults


@dataclass(frozen=True)
class _Timing:
    """within: first and last time of a file, None if it states none; rate: time codes per second."""

    within: tuple[float, float] | None
    rate: float


def read(path: Path) -> CurveFile:
    """Read the curves of a USD file. Raises `HairError`.

    Points of moving curves are those at the file's start time, or at their first sample.
    """
    stage = usd_stage.opened(path)
    with usd_stage.errors_named(path):
        from pxr import UsdGeom

        is_timed = stage.HasAuthoredTimeCodeRange()
        timing = _Timing(
            (stage.GetStartTimeCode(), stage.GetEndTimeCode()) if is_timed else None, stage.GetTimeCodesPerSecond()
        )
        found = usd_stage.curves_of(stage, usd_stage.time_code(timing.within[0] if is_timed else None))
        notes = [*found.notes(path)]
        sets = []
        for prim, name in zip(found.prims, _names(found.prims), strict=True):
            sets += _sets_of(path, prim, name, timing, notes)
        meters = UsdGeom.GetStageMetersPerUnit(stage) if UsdGeom.StageHasAuthoredMetersPerUnit(stage) else None
        up = UsdGeom.GetStageUpAxis(stage) if stage.HasAuthoredMetadata(UsdGeom.Tokens.upAxis) else None
    if meters is not None and not 0.0 < meters < np.inf:
        raise HairError(f"{path}: its metersPerUnit is {meters:g}, but must be positive.")
    return CurveFile(sets, Convention(meters, up), _USUAL, notes)


def _names(prims):
    """Names of prims for users to choose from: prim names, or paths where names are not unique."""
    own = [prim.GetName() for prim in prims]
    return [name if own.count(name) == 1 else str(prim.GetPath()) for prim, name in zip(prims, own, strict=True)]


def _sets_of(path, prim, name, timing, notes) -> Iterator[CurveSet]:
    """Yield the `CurveSet` of a prim unless it has no curves; appends messages for the user to notes."""
    times = usd_stage.times_of(prim, usd_shapes.moving_attributes(prim), timing.within)
    time = usd_stage.time_code(times[0] if times else None)
    drawn = usd_shapes.drawn(prim, time, keeps_splines=len(times) < 2)  # Blender plays polylines
    left_out = len(drawn.is_kept) - int(drawn.is_kept.sum())
    if left_out:
        sentence = "curves have too few points, or some that belong to no segment, and are left out."
        notes.append(HairError(f'"{name}" in {path}: {left_out} {sentence}'))
    if drawn.was_smooth:
        notes.append(HairError(curve_file.SPLINES_MOVE, path=f'"{name}" in {path}'))
    if drawn.has_odd_widths:
        sentence = "has widths that are neither per point nor per curve: they are left out."
        notes.append(HairError(f'"{name}" in {path} {sentence}'))
    if usd_stage.is_skinned(prim):
        sentence = "is bound to a skeleton: it is read in its bind pose."
        notes.append(HairError(f'"{name}" in {path} {sentence}'))
    if not len(drawn.counts):
        return
    matrix = usd_stage.matrix_of(prim, time)
    radii = drawn.widths
    if radii is not None:
        scale = abs(np.linalg.det(matrix[:3, :3])) ** (1.0 / 3.0)
        radii = (0.5 * scale * radii).astype(np.float32)

    stage = prim.GetStage()  # kept alive while its points are needed

    def points_at(index):
        assert stage
        return _moved(path, prim, name, usd_stage.time_code(times[index]), drawn)

    seconds = np.array(times) / timing.rate
    yield CurveSet(
        name,
        _placed(drawn.points, matrix),
        drawn.counts,
        np.full(len(drawn.counts), drawn.is_smooth),
        radii,
        motion=Motion(seconds, points_at) if len(times) > 1 else None,
        **_of_grooms(prim, time, drawn.is_kept),
    )


def _placed(points, matrix):
    placed = np.broadcast_to(matrix[:3, 3], points.shape).copy()
    for axis in range(3):  # a matrix product is several times slower
        placed += points[:, axis, None] * matrix[:3, axis]
    return placed


def _moved(path, prim, name, time, first):
    """Return the points at another time, divided like the first `Drawn`. Raises `HairError`."""
    with usd_stage.errors_named(path):
        drawn = usd_shapes.drawn(prim, time, first.lines, keeps_splines=False)
        if not np.array_equal(drawn.counts, first.counts):
            sentence = (
                f"has another number of points at the time {time.GetValue():g}: export the same number at all times."
            )
            raise HairError(f'"{name}" in {path} {sentence}')
        return _placed(drawn.points, usd_stage.matrix_of(prim, time))


def _of_grooms(prim, time, is_kept):
    """Return {field: value} of a `CurveSet` from the primvars of grooms [UnrealGroom26]; others are omitted."""
    from pxr import UsdGeom

    def one(name, kind):
        value = usd_stage.primvar(prim, name, time)
        values = usd_stage.array_of(value)
        value = values.ravel()[0].item() if values is not None and values.size else value
        return value if isinstance(value, kind) else None

    def of_curves(name, kind, width=1):
        value = usd_stage.array_of(usd_stage.primvar(prim, name, time))
        shape = (len(is_kept),) if width == 1 else (len(is_kept), width)
        if value is None or value.shape != shape or value.dtype.kind not in "iuf":
            return None
        return value.astype(kind)[is_kept]

    is_guide = one("groom_guide", int)
    if is_guide is None and UsdGeom.Imageable(prim).ComputePurpose() == UsdGeom.Tokens.guide:
        is_guide = True
    ids, uvs = of_curves("groom_id", np.int32), of_curves("groom_root_uv", np.float32, 2)
    fields = {
        "is_guide": None if is_guide is None else bool(is_guide),
        "group_id": one("groom_group_id", int),
        "group_name": one("groom_group_name", str),
        "ids": of_curves("id", np.int32) if ids is None else ids,
        "root_uvs": of_curves("st", np.float32, 2) if uvs is None else uvs,
        "guide_ids": of_curves("groom_closest_guides", np.int32, GUIDE_SLOTS),
        "guide_weights": of_curves("groom_guide_weights", np.float32, GUIDE_SLOTS),
    }
    return {name: value for name, value in fields.items() if value is not None}
