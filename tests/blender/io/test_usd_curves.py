# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves of USD files written by pxr are read as they are drawn."""

from itertools import pairwise
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from scipy.interpolate import BSpline, CubicHermiteSpline

from hair_addon.blender.io.usd import usd_curves, usd_stage
from hair_addon.core.errors import HairError
from hair_addon.core.geometry.strands import curve_offsets

bpy.utils.expose_bundled_modules()  # for pxr, which ships with Blender


def stage_at(path, up="Z", meters=1.0):
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.CreateInMemory() if path is None else Usd.Stage.CreateNew(str(path))
    if up:
        UsdGeom.SetStageUpAxis(stage, up)
    if meters:
        UsdGeom.SetStageMetersPerUnit(stage, meters)
    return stage


def add(stage, where, points, counts, kind="cubic", basis="bspline", wrap="pinned", widths=None, scope=None):
    from pxr import UsdGeom

    made = UsdGeom.BasisCurves.Define(stage, where)
    made.CreateTypeAttr(kind)
    made.CreateBasisAttr(basis)
    made.CreateWrapAttr(wrap)
    return fill(made, points, counts, widths, scope)


def fill(made, points, counts, widths=None, scope=None):
    from pxr import Vt

    made.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points, np.float32)))
    made.CreateCurveVertexCountsAttr(np.asarray(counts).tolist())
    if widths is not None:
        made.CreateWidthsAttr(np.asarray(widths, float).tolist())
    if scope is not None:
        made.SetWidthsInterpolation(scope)
    return made


def wandering(rng, count, scale=1.0):
    return np.float32(np.cumsum(rng.normal(size=(count, 3)) * 0.01 + [0.0, 0.0, 0.02], axis=0) * scale)


def lines_of(one):
    starts = curve_offsets(one.counts)
    return [one.points[a:b] for a, b in pairwise(starts)]


def length(line):
    return np.linalg.norm(np.diff(line, axis=0), axis=-1).sum()


def pinned_bspline(points):
    """Return the points of a pinned B-spline."""
    points = np.float64(points)
    near = np.concatenate([[2 * points[0] - points[1]], points, [2 * points[-1] - points[-2]]])
    return BSpline(np.arange(len(near) + 4.0) - 3.0, near, 3)(np.linspace(0.0, len(points) - 1.0, 4001))


def test_pinned_bsplines_begin_and_end_at_their_points_and_are_as_long_as_drawn(rng, tmp_path):
    counts = [9, 2, 30]
    points = wandering(rng, sum(counts))
    stage = stage_at(tmp_path / "a.usdc")
    add(stage, "/hair", points, counts)
    stage.Save()
    (one,) = usd_curves.read(tmp_path / "a.usdc").sets
    starts = curve_offsets(counts)
    for line, a, b in zip(lines_of(one), starts[:-1], starts[1:], strict=True):
        course = pinned_bspline(points[a:b])
        np.testing.assert_allclose(line[[0, -1]], points[[a, b - 1]], atol=1e-12)
        assert length(line) == pytest.approx(length(course), rel=1e-3)
    assert one.name == "hair" and not one.is_smooth.any() and one.is_guide is None and one.radii is None


def test_catmull_rom_without_ends_twice_begins_at_its_second_point(rng, tmp_path):
    points = wandering(rng, 8)
    stage = stage_at(tmp_path / "a.usda")
    add(stage, "/hair", points, [8], basis="catmullRom", wrap="nonperiodic")
    stage.Save()
    (one,) = usd_curves.read(tmp_path / "a.usda").sets
    tangents = (np.float64(points[2:]) - points[:-2]) / 2.0
    course = CubicHermiteSpline(np.arange(6), np.float64(points[1:-1]), tangents)(np.linspace(0.0, 5.0, 3001))
    np.testing.assert_allclose(one.points[[0, -1]], points[[1, -2]], atol=1e-8)
    assert length(one.points) == pytest.approx(length(course), rel=1e-3)


def test_catmull_rom_with_ends_twice_stays_a_spline_through_its_points(rng, tmp_path):
    points = wandering(rng, 12).reshape(2, 6, 3)
    twice = np.concatenate([points[:, :1], points, points[:, -1:]], axis=1)
    stage = stage_at(tmp_path / "a.usda")
    add(stage, "/hair", twice.reshape(-1, 3), [8, 8], "cubic", "catmullRom", "nonperiodic", range(16), "vertex")
    add(stage, "/thick", twice.reshape(-1, 3), [8, 8], "cubic", "catmullRom", "nonperiodic", range(12), "varying")
    stage.Save()
    first, second = usd_curves.read(tmp_path / "a.usda").sets
    for one in (first, second):
        np.testing.assert_array_equal(one.points, points.reshape(-1, 3))
        assert one.is_smooth.all() and one.counts.tolist() == [6, 6]
    np.testing.assert_array_equal(2.0 * first.radii, [*range(1, 7), *range(9, 15)])
    np.testing.assert_array_equal(2.0 * second.radii, np.arange(12))


def test_hermite_curves_and_nurbs_are_read(rng, tmp_path):
    from pxr import UsdGeom, Vt

    points, tangents = wandering(rng, 7), np.float32(rng.normal(size=(7, 3)) * 0.02)
    stage = stage_at(tmp_path / "a.usdc")
    hermite = fill(UsdGeom.HermiteCurves.Define(stage, "/hermite"), points, [4, 3], range(7), "varying")
    hermite.CreateTangentsAttr(Vt.Vec3fArray.FromNumpy(tangents))
    knots = np.array([0, 0, 0, 0, 0.3, 0.5, 0.8, 1, 1, 1, 1])
    weights = rng.uniform(0.5, 2.0, 7)
    nurbs = fill(UsdGeom.NurbsCurves.Define(stage, "/nurbs"), points, [7], np.ones(7), "vertex")
    nurbs.CreateOrderAttr([4])
    nurbs.CreateKnotsAttr(knots.tolist())
    nurbs.CreatePointWeightsAttr(weights.tolist())
    nurbs.CreateRangesAttr([(0.0, 0.9)])
    stage.Save()
    first, second = usd_curves.read(tmp_path / "a.usdc").sets
    for line, its in zip(lines_of(first), (slice(0, 4), slice(4, 7)), strict=True):
        count = its.stop - its.start
        spline = CubicHermiteSpline(np.arange(count), np.float64(points[its]), np.float64(tangents[its]))
        np.testing.assert_allclose(line[[0, -1]], points[[its.start, its.stop - 1]], atol=1e-8)
        assert length(line) == pytest.approx(length(spline(np.linspace(0.0, count - 1.0, 3001))), rel=1e-3)
    ends = np.concatenate([[0], np.cumsum(first.counts)])
    np.testing.assert_allclose(2.0 * first.radii[[ends[0], ends[1] - 1, ends[1], ends[2] - 1]], [0, 3, 4, 6])
    spline = BSpline(knots, np.column_stack([points * weights[:, None], weights]).astype(float), 3)
    course = spline(np.linspace(0.0, 0.9, 3001))
    course = course[:, :3] / course[:, 3:]
    np.testing.assert_allclose(second.points[[0, -1]], course[[0, -1]], atol=1e-8)
    assert length(second.points) == pytest.approx(length(course), rel=1e-3)
    np.testing.assert_allclose(second.radii, 0.5, rtol=1e-6)  # rational means of ones


@pytest.mark.parametrize("name", ["widths", "primvars:widths"])
def test_widths_are_where_their_interpolation_says(rng, tmp_path, name):
    """Widths of two pinned B-splines of 4 and 3 points are read at the 3 and 2 segments, by their interpolation."""
    points = np.float32([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0]])
    cases = {
        "constant": ([2.0], lambda x, y: 2.0 + 0.0 * x),
        "uniform": ([1.0, 3.0], lambda x, y: np.where(y < 0.5, 1.0, 3.0)),
        "varying": (range(7), lambda x, y: np.where(y < 0.5, x, x + 4.0)),
        "vertex": (range(7), lambda x, y: np.where(y < 0.5, x, x + 4.0)),  # linear in the points, as a B-spline is
    }
    for scope, (widths, wanted) in cases.items():
        stage = stage_at(None)
        made = add(stage, "/hair", points, [4, 3])
        if name == "widths":
            made.CreateWidthsAttr([float(w) for w in widths])
            made.SetWidthsInterpolation(scope)
        else:
            from pxr import Sdf, UsdGeom

            primvars = UsdGeom.PrimvarsAPI(made.GetPrim())
            primvars.CreatePrimvar("widths", Sdf.ValueTypeNames.FloatArray, scope).Set([float(w) for w in widths])
            made.CreateWidthsAttr([9.0])
        stage.Export(str(tmp_path / f"{scope}.usda"))
        (one,) = usd_curves.read(tmp_path / f"{scope}.usda").sets
        np.testing.assert_allclose(2.0 * one.radii, wanted(one.points[:, 0], one.points[:, 1]), atol=1e-6)


def test_widths_of_an_odd_number_are_left_out_with_a_sentence(rng, tmp_path):
    stage = stage_at(tmp_path / "a.usda")
    add(stage, "/hair", wandering(rng, 8), [4, 4], widths=np.ones(5), scope="vertex")
    add(stage, "/other", wandering(rng, 8), [4, 4], widths=[1.0, 3.0], scope="vertex")  # meant for each curve
    stage.Save()
    read = usd_curves.read(tmp_path / "a.usda")
    assert read.sets[0].radii is None and [str(n) for n in read.notes] and "widths" in str(read.notes[0])
    assert 2.0 * read.sets[1].radii[0] == 1.0 and 2.0 * read.sets[1].radii[-1] == 3.0


def test_transforms_move_points_and_widths_and_resets_end_them(rng, tmp_path):
    from pxr import Gf, UsdGeom

    points = wandering(rng, 4)
    stage = stage_at(tmp_path / "a.usdc", up="Y", meters=0.01)
    top = UsdGeom.Xform.Define(stage, "/top")
    top.AddTranslateOp().Set((1.0, 2.0, 3.0))
    top.AddScaleOp().Set((2.0, 2.0, 2.0))
    inner = UsdGeom.Xform.Define(stage, "/top/inner")
    inner.AddRotateZOp().Set(90.0)
    add(stage, "/top/inner/hair", points, [4], "linear", widths=[0.5], scope="constant")
    free = add(stage, "/top/inner/free", points, [4], "linear", widths=[0.5], scope="constant")
    free.AddTransformOp().Set(Gf.Matrix4d(1.0).SetTranslateOnly((5.0, 0.0, 0.0)))
    free.SetResetXformStack(True)
    stage.Save()
    read = usd_curves.read(tmp_path / "a.usdc")
    turned = np.column_stack([-points[:, 1], points[:, 0], points[:, 2]]) * 2.0 + [1.0, 2.0, 3.0]
    for one, wanted, radius in zip(read.sets, (turned, points + np.array([5.0, 0.0, 0.0])), (0.5, 0.25), strict=True):
        np.testing.assert_allclose(one.points, wanted, atol=1e-6)
        np.testing.assert_allclose(one.radii, radius, rtol=1e-6)
    assert (read.stated.meters, read.stated.up) == (pytest.approx(0.01), "Y")


def test_what_a_file_does_not_say_is_usual_of_usd(rng, tmp_path):
    stage = stage_at(tmp_path / "a.usda", up=None, meters=None)
    add(stage, "/hair", wandering(rng, 4), [4])
    stage.Save()
    read = usd_curves.read(tmp_path / "a.usda")
    assert (read.stated.meters, read.stated.up) == (None, None)
    assert (read.usual.meters, read.usual.up) == (0.01, "Y")


def test_instances_are_read_and_what_is_not_drawn_is_not(rng, tmp_path):
    from pxr import Sdf, UsdGeom

    points = wandering(rng, 4)
    stage = stage_at(tmp_path / "a.usdc")
    add(stage, "/library/tuft/hair", points, [4], "linear")
    stage.GetPrimAtPath("/library").SetSpecifier(Sdf.SpecifierClass)
    for number in range(2):
        shown = UsdGeom.Xform.Define(stage, f"/tuft{number}")
        shown.GetPrim().GetReferences().AddInternalReference("/library/tuft")
        shown.GetPrim().SetInstanceable(True)
        shown.AddTranslateOp().Set((float(number), 0.0, 0.0))
    add(stage, "/hidden", points, [4]).MakeInvisible()
    add(stage, "/proxy", points, [4]).CreatePurposeAttr("proxy")
    add(stage, "/guides", points, [4]).CreatePurposeAttr("guide")
    instancer = UsdGeom.PointInstancer.Define(stage, "/instancer")
    add(stage, "/instancer/blade", points, [4])
    instancer.CreatePrototypesRel().AddTarget("/instancer/blade")
    stage.Save()
    read = usd_curves.read(tmp_path / "a.usdc")
    assert [one.name for one in read.sets] == ["/tuft0/hair", "/tuft1/hair", "guides"]
    assert [one.is_guide for one in read.sets] == [None, None, True]
    for number in range(2):
        np.testing.assert_allclose(read.sets[number].points, points + np.array([number, 0.0, 0.0]), atol=1e-6)
    assert [word for note in read.notes for word in ("invisible", "proxies", "scattered") if word in str(note)] == [
        "invisible",
        "proxies",
        "scattered",
    ]


def test_a_variant_is_the_one_that_is_selected(rng, tmp_path):
    from pxr import Usd, UsdGeom

    stage = stage_at(tmp_path / "a.usda")
    top = UsdGeom.Xform.Define(stage, "/top").GetPrim()
    variants = top.GetVariantSets().AddVariantSet("style")
    for name, count in (("short", 3), ("long", 5)):
        variants.AddVariant(name)
        variants.SetVariantSelection(name)
        with variants.GetVariantEditContext():
            add(stage, "/top/hair", wandering(rng, count), [count], "linear")
    variants.SetVariantSelection("short")
    stage.Save()
    assert usd_curves.read(tmp_path / "a.usda").sets[0].counts.tolist() == [3]
    # Another stage of this process still has the file open, and it is written anew.
    held = Usd.Stage.Open(str(tmp_path / "a.usda"))
    variants.SetVariantSelection("long")
    stage.Save()
    assert usd_curves.read(tmp_path / "a.usda").sets[0].counts.tolist() == [5] and held


def test_primvars_of_grooms_are_read_for_the_curves_that_are_kept(rng, tmp_path):
    from pxr import Sdf, UsdGeom, Vt

    stage = stage_at(tmp_path / "a.usda")
    made = add(stage, "/hair", wandering(rng, 13), [4, 1, 8], widths=range(3), scope="uniform")
    primvars = UsdGeom.PrimvarsAPI(made.GetPrim())
    primvars.CreatePrimvar("groom_group_id", Sdf.ValueTypeNames.Int, "constant").Set(7)
    primvars.CreatePrimvar("groom_group_name", Sdf.ValueTypeNames.String, "constant").Set("brows")
    primvars.CreatePrimvar("groom_guide", Sdf.ValueTypeNames.Int, "constant").Set(0)
    primvars.CreatePrimvar("groom_id", Sdf.ValueTypeNames.IntArray, "uniform").Set([5, 6, 8])
    uvs = np.float32([[0, 0], [0.5, 0.5], [1, 0.25]])
    primvars.CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "uniform").Set(Vt.Vec2fArray.FromNumpy(uvs))
    stage.Save()
    read = usd_curves.read(tmp_path / "a.usda")
    (one,) = read.sets
    assert (one.group_id, one.group_name, one.is_guide, one.ids.tolist()) == (7, "brows", False, [5, 8])
    np.testing.assert_array_equal(one.root_uvs, uvs[[0, 2]])
    np.testing.assert_array_equal(2.0 * one.radii[[0, -1]], [0.0, 2.0])
    assert len(read.notes) == 1 and "1 curves" in str(read.notes[0])


@pytest.mark.parametrize(("basis", "wrap"), [("bspline", "pinned"), ("catmullRom", "nonperiodic")])
def test_what_moves_is_where_the_file_begins_and_has_all_its_times(rng, tmp_path, basis, wrap):
    from pxr import UsdGeom, Vt

    points = np.repeat(wandering(rng, 6), [2, 1, 1, 1, 1, 2], axis=0)
    stage = stage_at(tmp_path / "a.usdc")
    stage.SetTimeCodesPerSecond(25.0)
    stage.SetStartTimeCode(1001.0)
    stage.SetEndTimeCode(1003.0)
    top = UsdGeom.Xform.Define(stage, "/top")
    place = top.AddTranslateOp()
    made = add(stage, "/top/hair", points, [8], "cubic", basis, wrap)
    for time in (1001, 1002, 1003):
        place.Set((time - 1001.0, 0.0, 0.0), time)
        made.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(points * np.float32(time - 1000)), time)
    made.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(points * 100), 900)  # before the file begins
    stage.Save()
    del stage
    read = usd_curves.read(tmp_path / "a.usdc")
    (one,) = read.sets
    reported = [str(note) for note in read.notes]
    assert [("Catmull-Rom splines become polylines" in one) for one in reported] == [True] * (basis == "catmullRom")
    np.testing.assert_allclose(one.points[[0, -1]], points[[0, -1]], atol=1e-7)
    np.testing.assert_allclose(one.motion.times, np.array([1001, 1002, 1003]) / 25.0)
    assert not one.is_smooth.any()  # Blender plays polylines
    for index, grown in ((0, 1.0), (2, 3.0)):
        moved = one.motion.points_at(index)
        assert len(moved) == len(one.points)
        np.testing.assert_allclose(moved, one.points * grown + [grown - 1.0, 0.0, 0.0], atol=1e-6)


def damaged(stage, what, rng):
    """Return a file whose header contradicts its content."""
    from pxr import UsdGeom

    points = wandering(rng, 8)
    if what == "counts":
        add(stage, "/hair", points, [4, 5])
    elif what == "negative":
        add(stage, "/hair", points, [9, -1])
    elif what == "knots":
        nurbs = fill(UsdGeom.NurbsCurves.Define(stage, "/hair"), points, [8])
        nurbs.CreateOrderAttr([4])
        nurbs.CreateKnotsAttr([1.0] * 5)
    elif what == "falling":
        nurbs = fill(UsdGeom.NurbsCurves.Define(stage, "/hair"), points, [8])
        nurbs.CreateOrderAttr([4])
        nurbs.CreateKnotsAttr([float(k) for k in range(12, 0, -1)])
    elif what == "tangents":
        fill(UsdGeom.HermiteCurves.Define(stage, "/hair"), points, [8])
    elif what == "types":
        lines = "int[] curveVertexCounts = [2]", 'string[] points = ["a", "b"]'
        text = "\n".join(("#usda 1.0", 'def BasisCurves "hair"', "{", *lines, "}", ""))
        stage.GetRootLayer().ImportFromString(text)
    elif what == "units":
        add(stage, "/hair", points, [8])
        UsdGeom.SetStageMetersPerUnit(stage, 0.0)


@pytest.mark.parametrize("what", ["counts", "negative", "knots", "falling", "tangents", "types", "units"])
def test_damaged_files_are_refused_in_one_sentence(rng, tmp_path, what):
    stage = stage_at(tmp_path / "a.usda")
    damaged(stage, what, rng)
    stage.Save()
    with pytest.raises(HairError) as raised:
        usd_curves.read(tmp_path / "a.usda")
    assert "\n" not in str(raised.value) and str(raised.value).endswith(".")


@pytest.mark.parametrize("text", ["", "nonsense", "#usda 1.0\ndef X {", "PXR-USDC" + "\0" * 200])
@pytest.mark.parametrize("ending", ["usda", "usdc", "usd", "usdz"])
def test_files_that_are_none_of_usd_are_refused_in_one_sentence(tmp_path, ending, text):
    path = tmp_path / f"a.{ending}"
    path.write_text(text)
    with pytest.raises(HairError) as raised:
        usd_curves.read(path)
    assert "\n" not in str(raised.value) and str(path) in str(raised.value) and "pxr" not in str(raised.value)


def test_files_that_are_missing_are_named(rng, tmp_path):
    add(stage_at(tmp_path / "there.usda"), "/hair", wandering(rng, 4), [4])
    (tmp_path / "a.usda").write_text(
        "#usda 1.0\n(\n subLayers = [@./layer.usda@]\n)\n"
        'def Xform "a" (references = @./tuft.usda@) {}\ndef Xform "b" (payload = @./load.usda@</x>) {}\n'
    )
    with pytest.raises(HairError) as raised:
        usd_curves.read(tmp_path / "a.usda")
    assert all(name in str(raised.value) for name in ("layer.usda", "tuft.usda", "load.usda"))


def test_a_package_is_read(rng, tmp_path):
    from pxr import Sdf, UsdUtils

    points = wandering(rng, 4)
    stage = stage_at(tmp_path / "a.usdc")
    add(stage, "/hair", points, [4], "linear")
    stage.Save()
    assert UsdUtils.CreateNewUsdzPackage(Sdf.AssetPath(str(tmp_path / "a.usdc")), str(tmp_path / "a.usdz"))
    (tmp_path / "a.usdc").unlink()
    np.testing.assert_array_equal(usd_curves.read(tmp_path / "a.usdz").sets[0].points, points)


@pytest.mark.parametrize(
    ("line", "is_left_out"),
    [
        ("float widths = 0.1", True),
        ("float primvars:widths = 0.1", True),
        ('string[] primvars:widths = ["a"]', True),
        ("float[] widths = []", False),
        ('string primvars:groom_group_id = "abc"', False),
        ("matrix4d primvars:groom_group_id = ((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1))", False),
        ("int[] primvars:groom_group_name = [1]", False),
        ('string[] primvars:groom_guide = ["a"]', False),
        ("int primvars:groom_id = 3", False),
    ],
)
def test_values_of_another_type_are_left_out(tmp_path, line, is_left_out):
    path = tmp_path / "a.usda"
    kind, points = 'uniform token type = "linear"', "point3f[] points = [(0, 0, 0), (0, 0, 1)]"
    lines = "int[] curveVertexCounts = [2]", points, kind, line
    path.write_text("\n".join(("#usda 1.0", 'def BasisCurves "hair"', "{", *lines, "}", "")))
    read = usd_curves.read(path)
    (one,) = read.sets
    assert (one.radii, one.is_guide, one.group_id, one.group_name, one.ids) == (None, None, 0, "", None)
    assert ["widths" in str(note) for note in read.notes] == [True] * is_left_out


def test_an_array_of_negative_size_is_damaged():
    """An array of negative size, as in damaged .usdz files, is an error of the file, although USD raises on its
    conversion.
    """

    class Values:
        def __array__(self, *_options, **_names):
            raise ValueError("negative dimensions are not allowed")

        def __len__(self):
            raise OverflowError("cannot fit 'int' into an index-sized integer")

    for value in (Values(), 3.0):
        assert usd_stage.values_at(SimpleNamespace(Get=lambda _time, it=value: it), 0.0) is None
    assert usd_stage.values_at(SimpleNamespace(Get=lambda _time: None), 0.0).shape == (0,)
