# SPDX-License-Identifier: GPL-3.0-or-later
"""Grooms as USD: polylines with primvars, in meters with Z up, which Unreal, Houdini and Omniverse read.

    /groom                     Xform with the API schema GroomAPI, which identifies grooms in Unreal
    /groom/<group>             Xform
    /groom/<group>/strands     BasisCurves
    /groom/<group>/guides      BasisCurves with the purpose guide
    /groom/<group>_instance    Xform, an instance of the group: where another object shows the same hair
    /groom/<group>/looks       Scope of the materials of variants (`usd_variants`)
    /groom/materials/<group>   Material: a preview surface, a MaterialX network, and the look's settings as inputs

Primvars with the prefix groom_ are those of [UnrealGroom26], except the width, which is the curves' own; st and
displayColor are for other programs.
"""

from contextlib import contextmanager
from pathlib import Path

import numpy as np

from ....core.files import groom_curves
from ....core.files.alembic.unreal_groom import VERSION
from ....core.files.atomic_file import new_partial_of
from ....core.files.groom_curves import Check
from . import hair_file, usd_materials, usd_variants

PER_METRE = 1.0

MATERIALS = "materials"  # scope of materials: a reserved group name

_ROOT = "/groom"

_NO_VARIANTS = usd_variants.Variants()


class UsdGroomWriter:
    """Writer of a groom to a stage, made by `writing`: first add all guides and strands, then write their points."""

    def __init__(self, stage, path, tool, properties, first_frame, variants):
        self._stage, self._path, self._first_frame, self._variants = stage, path, first_frame, variants
        self._added = []
        root = stage.GetPrimAtPath(_ROOT)
        root.AddAppliedSchema("GroomAPI")
        for name, value in zip(("groom_version_major", "groom_version_minor"), VERSION, strict=True):
            _primvar(root, name, "Int", "constant", value)
        _primvar(root, "groom_tool", "String", "constant", tool)
        _primvar(root, "groom_properties", "String", "constant", properties)

    def add(self, curves, moves=False):
        """Write `GroomCurves` without points; returns their number. moves: whether the points are animated."""
        from pxr import UsdGeom

        group = UsdGeom.Xform.Define(self._stage, f"{_ROOT}/{curves.group_name}").GetPrim()
        path = group.GetPath().AppendChild("guides" if curves.is_guide else "strands")
        made = UsdGeom.BasisCurves.Define(self._stage, path)
        shown_look = None if curves.is_guide or curves.look is None else self._bind_material(group, made, curves)
        levels = usd_variants.define_levels(group, curves.counts, 1 if curves.is_guide else self._variants.level_count)
        widths = np.float32(_all(curves.widths, curves))
        for level in levels:
            with usd_variants.editing(self._stage, level.path):
                hair_file.define_curves(self._stage, path, level.counts)
                made.CreateWidthsAttr(_array("FloatArray", level.thickness * level.of_points(widths)))
                _write_primvars(made.GetPrim(), curves, level)
            with usd_variants.editing(self._stage, level.path or shown_look):
                _write_colors(made.GetPrim(), curves, level)
        if curves.is_guide:
            made.CreatePurposeAttr(UsdGeom.Tokens.guide)
        self._added.append((made, levels, Check(curves), moves, float(widths.max(initial=0.0)) / 2.0, []))
        return len(self._added) - 1

    def _bind_material(self, group, made, curves):
        """Bind strands to their look; returns the path of the present look's variant, None without variants."""
        from pxr import UsdGeom, UsdShade

        scope = UsdGeom.Scope.Define(self._stage, f"{_ROOT}/{MATERIALS}").GetPath()
        material = usd_materials.define_material(self._stage, scope.AppendChild(curves.group_name), curves.look)
        binding, looks = UsdShade.MaterialBindingAPI.Apply(made.GetPrim()), self._variants.looks
        if looks:
            given = curves.colors is not None, curves.radial_roughness is not None
            return usd_variants.define_looks(self._stage, group, made.GetPrim(), material, looks, *given)
        binding.Bind(material)
        return None

    def write_points(self, number, points):
        """Write points (N, 3) [m] of added curves at the next time. Raises `HairError` for non-finite values."""
        from pxr import Usd

        made, levels, check, moves, reach, times = self._added[number]
        time = Usd.TimeCode(self._first_frame + len(times)) if moves else Usd.TimeCode.Default()
        values = np.concatenate([*check.parts(points)])
        for level in levels:
            points = level.of_points(values)
            with usd_variants.editing(self._stage, level.path):
                made.CreatePointsAttr().Set(_array("Vec3fArray", points), time)
                made.CreateExtentAttr().Set(hair_file.extent(points, level.thickness * reach), time)
        times.append(time)
        if moves:
            self._stage.SetStartTimeCode(self._first_frame)
            self._stage.SetEndTimeCode(max(self._stage.GetEndTimeCode(), time.GetValue()))
            self._save()

    def _save(self):
        """Write the added data to the disk, which frees its memory."""
        from pxr import Tf

        try:
            self._stage.GetRootLayer().Save()
        except Tf.ErrorException as error:
            raise hair_file.failed(self._path, error) from error

    def add_instance(self, group_name, matrix):
        """Add an instance of a group; matrix: (4, 4), transform of the instance relative to the group [m]."""
        from pxr import Gf, UsdGeom

        path, number = f"{_ROOT}/{group_name}_instance", 1
        while self._stage.GetPrimAtPath(path):
            number += 1
            path = f"{_ROOT}/{group_name}_instance_{number}"
        made = UsdGeom.Xform.Define(self._stage, path)
        made.GetPrim().GetReferences().AddInternalReference(f"{_ROOT}/{group_name}")
        made.GetPrim().SetInstanceable(True)
        made.AddTransformOp().Set(Gf.Matrix4d(np.asarray(matrix, np.float64).T.tolist()))  # rows of vectors

    def notes(self):
        """Notes on how importers handle the written file."""
        return [note for _made, _levels, check, *_ in self._added for note in check.notes()]


@contextmanager
def writing(path: Path, final_path: Path, tool, properties, rate=24.0, first_frame=0, variants=_NO_VARIANTS):
    """Write a groom to a path; the file is whole after the context.

    final_path: for errors; rate: frames per second; variants: `Variants`; the rest as in `unreal_groom.writing`. Raises
    `HairError` if Blender lacks USD or the disk is full.
    """
    hair_file.require_usd()
    from pxr import Tf, Usd, UsdGeom

    # USD rewrites a whole text file at each save: the time would grow with the square of the number of frames.
    is_text = path.suffix.lower() == ".usda"
    binary = new_partial_of(path.with_suffix(".usdc")) if is_text else path
    try:
        stage = Usd.Stage.CreateNew(str(binary))
        UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
        UsdGeom.SetStageMetersPerUnit(stage, 1.0 / PER_METRE)
        stage.SetTimeCodesPerSecond(rate)
        stage.SetFramesPerSecond(rate)
        stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, _ROOT).GetPrim())
        yield UsdGroomWriter(stage, final_path, tool, properties, first_frame, variants)
        stage.GetRootLayer().Save()
        if is_text:
            stage.GetRootLayer().Export(str(path))
    except Tf.ErrorException as error:
        raise hair_file.failed(final_path, error) from error
    finally:
        if is_text:
            binary.unlink(missing_ok=True)


def _write_primvars(prim, curves, level):
    _primvar(prim, "groom_guide", "Int", "constant", int(curves.is_guide))
    _primvar(prim, "groom_group_id", "Int", "constant", curves.group_id)
    _primvar(prim, "groom_group_name", "String", "constant", curves.group_name)
    _primvar(prim, "groom_id", "IntArray", "uniform", _array("IntArray", level.of_curves(curves.ids)))
    if curves.root_uvs is not None:
        uvs = _array("Vec2fArray", level.of_curves(curves.root_uvs))
        _primvar(prim, "groom_root_uv", "Float2Array", "uniform", uvs)
        _primvar(prim, "st", "TexCoord2fArray", "uniform", uvs)
    if curves.guide_ids is not None:
        ids, weights = level.of_curves(curves.guide_ids), level.of_curves(curves.guide_weights)
        _primvar(prim, "groom_closest_guides", "Int3Array", "uniform", _array("Vec3iArray", ids))
        _primvar(prim, "groom_guide_weights", "Float3Array", "uniform", _array("Vec3fArray", weights))


def _write_colors(prim, curves, level):
    if curves.colors is not None:
        colors = _array("Vec3fArray", level.of_points(_all(curves.colors, curves)))
        _primvar(prim, "groom_color", "Color3fArray", "vertex", colors)
        _primvar(prim, "displayColor", "Color3fArray", "vertex", colors)
    if curves.roughness is not None:
        roughness = _array("FloatArray", level.of_points(_all(curves.roughness, curves)))
        _primvar(prim, "groom_roughness", "FloatArray", "vertex", roughness)
    if curves.radial_roughness is not None:
        radial = _array("FloatArray", level.of_curves(curves.radial_roughness))
        _primvar(prim, usd_variants.RADIAL_ROUGHNESS, "FloatArray", "uniform", radial)


def _primvar(prim, name, kind, scope, value):
    from pxr import Sdf, UsdGeom

    made = UsdGeom.PrimvarsAPI(prim).CreatePrimvar(name, getattr(Sdf.ValueTypeNames, kind), scope)
    made.Set(value)


def _array(kind, values):
    """Convert a NumPy array to a `Vt` array."""
    from pxr import Vt

    dtype = np.int32 if kind in {"IntArray", "Vec3iArray"} else np.float32
    return getattr(Vt, kind).FromNumpy(np.ascontiguousarray(values, dtype))


def _all(rows, curves):
    return np.concatenate([rows(chosen) for chosen in groom_curves.slices(curves.curve_count)])
