# SPDX-License-Identifier: GPL-3.0-or-later
"""A USD file of moving hair, written sample by sample to the disk, without keeping samples in memory."""

import re
from pathlib import Path

import bpy
import numpy as np

from ....core.errors import HairError
from ...data.strands.delivered_hair import ROOT
from ...host import paths

_CREATOR = "creator"  # entry that identifies the writer of the file
_PROGRAM = "Vellus delivered hair"


def require_ours(path):
    """Raise `HairError` if another file than delivered hair is at `path`, or if this build of Blender lacks USD."""
    require_usd()
    if not path.exists():
        return
    from pxr import Sdf, Tf

    try:
        layer = Sdf.Layer.OpenAsAnonymous(str(path), metadataOnly=True)
    except Tf.ErrorException:
        layer = None
    if layer is None or layer.customLayerData.get(_CREATOR) != _PROGRAM:
        raise HairError(
            "{path} was not made by Deliver Hair: move it, or save the .blend under another name.", path=path
        )


def require_usd():
    """Raise `HairError` if this build of Blender lacks USD."""
    if not paths.has_operator("wm.usd_export"):
        raise HairError("Hair cannot be written: this build of Blender lacks USD.")
    bpy.utils.expose_bundled_modules()


def failed(path, error):
    """`HairError` with the cause extracted from USD's message."""
    cause = re.search(r"Error occurred writing file: ([^']*)", str(error))
    return HairError(
        "{path} cannot be written: {cause}.", path=path, cause=cause[1] if cause else "the disk may be full"
    )


def define_curves(stage, path, counts):
    """Define polylines with counts (S,) of points; returns a `UsdGeom.BasisCurves` with widths per point."""
    from pxr import UsdGeom, Vt

    curves = UsdGeom.BasisCurves.Define(stage, path)
    curves.CreateTypeAttr(UsdGeom.Tokens.linear)
    curves.CreateWrapAttr(UsdGeom.Tokens.nonperiodic)
    curves.CreateCurveVertexCountsAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(counts, np.int32)))
    curves.SetWidthsInterpolation(UsdGeom.Tokens.vertex)
    return curves


def extent(points, reach):
    """Return the bounding box of points (N, 3), enlarged by a radius, as a USD extent."""
    from pxr import Vt

    return Vt.Vec3fArray.FromNumpy(np.float32([points.min(axis=0) - reach, points.max(axis=0) + reach]))


class HairFile:
    """Strands of several hair objects at several times, in Blender's axes and a scene's units.

    A context manager: the file is complete after it. final_path: for errors. Methods raise `HairError` if the disk is
    full.
    """

    def __init__(self, path: Path, final_path: Path, frame_rate: float, meters_per_unit: float) -> None:
        require_usd()
        from pxr import Tf, Usd, UsdGeom

        self._path = final_path
        try:
            self._stage = Usd.Stage.CreateNew(str(path))
        except Tf.ErrorException as error:
            raise failed(final_path, error) from error
        self._stage.GetRootLayer().customLayerData = {_CREATOR: _PROGRAM, "version": paths.addon_version()}
        UsdGeom.SetStageUpAxis(self._stage, UsdGeom.Tokens.z)
        UsdGeom.SetStageMetersPerUnit(self._stage, meters_per_unit)
        self._stage.SetTimeCodesPerSecond(frame_rate)
        self._stage.SetFramesPerSecond(frame_rate)
        self._stage.SetDefaultPrim(UsdGeom.Xform.Define(self._stage, f"/{ROOT}").GetPrim())
        self._times = []
        self._hair = {}  # path in the file → _Hair

    def __enter__(self):
        return self

    def __exit__(self, *_error):
        self._hair.clear()
        self._stage = None  # closes the file

    def add(self, name, counts):
        """Add hair by name; returns its path in the file. counts: (S,) points of its strands, the same at all times."""
        from pxr import Tf

        path = f"/{ROOT}/{Tf.MakeValidIdentifier(name)}"
        while path in self._hair:
            path += "_"
        self._hair[path] = _Hair(self._stage, path, counts)
        return path

    def write(self, time, path, points, radii, matrix):
        """Write a sample: points (N, 3) and radii (N,) float32 in local coordinates, matrix (4, 4) local → world."""
        self._hair[path].write(time, points, radii, matrix)

    def save(self, time):
        """Write the added samples to the disk; time: of the samples, in frames."""
        from pxr import Tf

        self._times.append(time)
        try:
            self._stage.SetStartTimeCode(min(self._times))
            self._stage.SetEndTimeCode(max(self._times))
            self._stage.GetRootLayer().Save()
        except Tf.ErrorException as error:
            raise failed(self._path, error) from error


class _Hair:
    """The prim of one hair object."""

    def __init__(self, stage, path, counts):
        curves = define_curves(stage, path, counts)
        self._points, self._extent, self._widths = (
            curves.CreatePointsAttr(),
            curves.CreateExtentAttr(),
            curves.CreateWidthsAttr(),
        )
        self._transform = curves.AddTransformOp()
        self._last = None  # (time, widths) of the previous sample

    def write(self, time, points, radii, matrix):
        from pxr import Gf, Vt

        points = np.ascontiguousarray(points, np.float32)
        self._points.Set(Vt.Vec3fArray.FromNumpy(points), time)
        self._extent.Set(extent(points, radii.max(initial=0.0)), time)
        self._transform.Set(Gf.Matrix4d(np.asarray(matrix, np.float64).T.tolist()), time)  # rows of vectors
        self._write_widths(time, 2.0 * radii)

    def _write_widths(self, time, widths):
        """Write widths only if they change: readers interpolate between samples."""
        from pxr import Vt

        before, self._last = self._last, (time, widths)
        if before is not None and np.array_equal(before[1], widths):
            return
        for at, values in [before, self._last] if before is not None else [self._last]:
            self._widths.Set(Vt.FloatArray.FromNumpy(np.ascontiguousarray(values, np.float32)), at)
