# SPDX-License-Identifier: GPL-3.0-or-later
"""USD for other programs has curves with primvars in their scopes, and the same arrays as Alembic."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from hair_addon.blender.data.strands import curves
from hair_addon.blender.io.usd import usd_groom
from hair_addon.core.files.groom_curves import GroomCurves
from tests.support.dynamics.following import update
from tests.support.exchange import alembic_reader
from tests.support.exchange.exported import LAST, export, shape, widths, world
from tests.support.reading import evaluated_points

PLACES = {"Hair": "/groom/Hair/strands", "Hair_guides": "/groom/Hair/guides"}  # in Alembic → in USD


def stage_of(path):
    bpy.utils.expose_bundled_modules()
    from pxr import Usd

    return Usd.Stage.Open(str(path))


def primvars(prim):
    from pxr import UsdGeom

    return {p.GetPrimvarName(): p for p in UsdGeom.PrimvarsAPI(prim).GetPrimvarsWithAuthoredValues()}


@pytest.mark.parametrize("ending", [".usdc", ".usda"])
def test_usd_has_curves_with_primvars_in_their_scopes(twisted, tmp_path, ending):
    hair, guides = twisted
    export(tmp_path / f"groom{ending}")
    stage = stage_of(tmp_path / f"groom{ending}")
    from pxr import UsdGeom, UsdShade

    assert UsdGeom.GetStageUpAxis(stage) == "Z" and UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    root = stage.GetDefaultPrim()
    assert root.GetPath() == "/groom" and "GroomAPI" in root.GetMetadata("apiSchemas").GetAddedOrExplicitItems()
    scopes = {
        **dict.fromkeys(("groom_guide", "groom_group_id", "groom_group_name"), ("constant", None)),
        "groom_id": ("uniform", "int[]"),
        "groom_root_uv": ("uniform", "float2[]"),
        "st": ("uniform", "texCoord2f[]"),
        "groom_closest_guides": ("uniform", "int3[]"),
        "groom_guide_weights": ("uniform", "float3[]"),
        "groom_color": ("vertex", "color3f[]"),
        "displayColor": ("vertex", "color3f[]"),
        "groom_roughness": ("vertex", "float[]"),
        "widths": ("vertex", "float[]"),
    }
    for name, shown in (("strands", hair), ("guides", guides)):
        prim = UsdGeom.BasisCurves(stage.GetPrimAtPath(f"/groom/Hair/{name}"))
        counts = prim.GetCurveVertexCountsAttr().Get()
        np.testing.assert_array_equal(counts, curves.point_counts(shown.data))
        assert prim.GetTypeAttr().Get() == "linear" and prim.GetWrapAttr().Get() == "nonperiodic"
        points = np.array(prim.GetPointsAttr().Get())
        np.testing.assert_allclose(points, world(shown).reshape(-1, 3), atol=1e-5)
        np.testing.assert_allclose(prim.GetWidthsAttr().Get(), widths(shown), rtol=1e-5)
        assert prim.GetWidthsInterpolation() == "vertex"
        low, high = np.array(prim.GetExtentAttr().Get())
        assert (low <= points.min(axis=0)).all() and (high >= points.max(axis=0)).all()
        for primvar_name, primvar in primvars(prim.GetPrim()).items():
            scope, kind = scopes[primvar_name]
            assert primvar.GetInterpolation() == scope, primvar_name
            assert kind is None or str(primvar.GetTypeName()) == kind
            if scope != "constant":
                assert len(primvar.Get()) == (len(counts) if scope == "uniform" else sum(counts)), primvar_name
    strands = stage.GetPrimAtPath("/groom/Hair/strands")
    assert set(scopes) - set(primvars(strands)) == {"widths"}
    assert UsdGeom.Imageable(stage.GetPrimAtPath("/groom/Hair/guides")).GetPurposeAttr().Get() == "guide"
    material, _relationship = UsdShade.MaterialBindingAPI(strands).ComputeBoundMaterial()
    assert material.GetInput("melanin").Get() == pytest.approx(hair.data.vellus.appearance.melanin)
    surface, _name, _kind = material.ComputeSurfaceSource()
    assert surface.GetIdAttr().Get() == "UsdPreviewSurface"


def test_usd_and_alembic_have_the_same_arrays(hair, tmp_path):
    export(tmp_path / "groom.abc")
    export(tmp_path / "groom.usdc")
    archive, stage = alembic_reader.read(tmp_path / "groom.abc"), stage_of(tmp_path / "groom.usdc")
    for name, place in PLACES.items():
        found, prim = shape(archive, name), stage.GetPrimAtPath(place)
        shared = set(found) & set(primvars(prim))
        assert len(shared) >= 4
        for parameter in shared:
            values = primvars(prim)[parameter].Get()
            if found[parameter].kind == "string":
                assert [values] == found[parameter].only
            else:
                np.testing.assert_array_equal(np.ravel(values), found[parameter].only.ravel())


def test_hair_of_several_objects_is_instanced(twisted, tmp_path):
    hair, _guides = twisted
    bpy.context.scene.unit_settings.scale_length = 0.5
    again = bpy.data.objects.new("Again", hair.data)
    bpy.context.scene.collection.objects.link(again)
    again.matrix_world = Matrix.Translation((5.0, 1.0, 0.0)) @ Matrix.Rotation(0.7, 4, "Y") @ hair.matrix_world
    update()
    export(tmp_path / "groom.usdc")
    stage = stage_of(tmp_path / "groom.usdc")
    from pxr import UsdGeom

    prim = stage.GetPrimAtPath("/groom/Hair_instance")
    assert prim.IsInstance() and not stage.GetPrimAtPath("/groom/Hair_instance_2")
    strands = stage.GetPrimAtPath("/groom/Hair_instance/strands")
    to_world = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(strands))
    points = np.array(UsdGeom.BasisCurves(strands).GetPointsAttr().Get())
    matrix = np.array(again.matrix_world)
    wanted = evaluated_points(hair).reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
    np.testing.assert_allclose(points @ to_world[:3, :3] + to_world[3, :3], 0.5 * wanted, atol=1e-5)


def test_all_moves_in_usd_as_in_alembic(baked, tmp_path):
    export(tmp_path / "groom.abc", animation="ALL")
    export(tmp_path / "groom.usdc", animation="ALL")
    archive, stage = alembic_reader.read(tmp_path / "groom.abc"), stage_of(tmp_path / "groom.usdc")
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (1.0, LAST)
    assert stage.GetTimeCodesPerSecond() == bpy.context.scene.render.fps
    for name, place in PLACES.items():
        points = stage.GetPrimAtPath(place).GetAttribute("points")
        assert points.GetTimeSamples() == [1.0, 2.0, 3.0, 4.0]
        for frame, sample in enumerate(shape(archive, name)["P"].samples, 1):
            np.testing.assert_allclose(100.0 * np.array(points.Get(frame)), sample, atol=1e-3)
    bpy.context.scene.frame_set(3)
    shown = 100.0 * world(bpy.data.objects["Hair"]).reshape(-1, 3)
    np.testing.assert_allclose(shape(archive, "Hair")["P"].samples[2], shown, atol=1e-3)


def test_blender_takes_usd_back(hair, tmp_path):
    wanted = world(hair)
    export(tmp_path / "groom.usdc")
    before = set(bpy.data.objects)
    bpy.ops.wm.usd_import(filepath=str(tmp_path / "groom.usdc"), import_guide=True)
    update()
    came = {len(o.data.curves): o for o in set(bpy.data.objects) - before if o.type == "CURVES"}
    assert sorted(came) == [60, 500]
    np.testing.assert_allclose(world(came[500]), wanted, atol=1e-5)


@pytest.mark.parametrize("ending", [".usda", ".usdc"])
def test_a_text_file_is_written_once_whatever_its_number_of_frames(rng, tmp_path, ending):
    """A text file is saved only once, as USD rewrites it with each save, so the time would grow with the square of the
    frames.
    """
    path = tmp_path / f"groom{ending}"
    frames = rng.random((3, 10, 3), np.float32)
    made = GroomCurves(0, "Long", False, np.int32([4, 6]), 0, lambda _some: np.ones(10, np.float32))
    with usd_groom.writing(path, path, "Vellus", "", first_frame=5) as writer:
        number = writer.add(made, moves=True)
        for points in frames:
            writer.write_points(number, lambda _some, of=points: of)
        assert path.exists() == (ending == ".usdc")
    assert [one.name for one in tmp_path.iterdir()] == [path.name]
    stage = stage_of(path)
    points = stage.GetPrimAtPath("/groom/Long/strands").GetAttribute("points")
    for time, wanted in enumerate(frames, 5):
        np.testing.assert_array_equal(points.Get(time), wanted)


def test_files_are_valid(twisted, tmp_path):
    """USD's checker finds no fault in an exported file."""
    export(tmp_path / "groom.usdc")
    stage_of(tmp_path / "groom.usdc")
    from pxr import UsdUtils

    checker = UsdUtils.ComplianceChecker()
    checker.CheckCompliance(str(tmp_path / "groom.usdc"))
    assert (checker.GetErrors(), checker.GetFailedChecks(), checker.GetWarnings()) == ([], [], [])
