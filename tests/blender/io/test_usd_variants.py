# SPDX-License-Identifier: GPL-3.0-or-later
"""Exported USD has levels of detail and looks as variants, of which the first is the hair without variants."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from hair_addon.blender.io.usd import usd_curves
from hair_addon.blender.settings import saved_looks
from hair_addon.core.errors import HairError
from hair_addon.core.shading import appearance, presets
from hair_addon.core.shading.appearance import Appearance
from tests.support.dynamics.following import update
from tests.support.exchange.exported import export

STRANDS = "/groom/Hair/strands"
NAMES = ["full", "half", "quarter", "eighth"]
VARIANTS = {"level_count": 4, "looks": "Black, dyed_blue"}
COLORS = ("groom_color", "displayColor", "groom_roughness")


def stage_of(path):
    bpy.utils.expose_bundled_modules()
    from pxr import Usd

    return Usd.Stage.Open(str(path))


def choose(stage, set_name, variant, group="/groom/Hair"):
    stage.GetPrimAtPath(group).GetVariantSet(set_name).SetVariantSelection(variant)


def values(stage, path=STRANDS):
    """Return {name: (type, value, interpolation)} of the attributes of a prim."""
    prim = stage.GetPrimAtPath(path)
    found = {}
    for one in prim.GetAuthoredAttributes():
        value = one.Get()
        value = np.array(value) if hasattr(value, "__len__") and not isinstance(value, str) else value
        found[one.GetName()] = (str(one.GetTypeName()), value, one.GetMetadata("interpolation"))
    return found


def require_equal(found, wanted):
    assert found.keys() == wanted.keys()
    for name, (kind, value, scope) in wanted.items():
        assert (found[name][0], found[name][2]) == (kind, scope), name
        np.testing.assert_array_equal(found[name][1], value, name)


def material_of(stage):
    from pxr import UsdShade

    return UsdShade.MaterialBindingAPI(stage.GetPrimAtPath(STRANDS)).ComputeBoundMaterial()[0]


@pytest.mark.parametrize("changes", [VARIANTS, {"level_count": 3}, {"looks": "Blond"}])
def test_the_first_variants_are_the_hair_without_variants(twisted, tmp_path, changes):
    """The selected variants have the bits of an export without variants, for USD, for Blender and for our reader."""
    export(tmp_path / "plain.usdc")
    export(tmp_path / "variants.usdc", **changes)
    plain, made = stage_of(tmp_path / "plain.usdc"), stage_of(tmp_path / "variants.usdc")
    assert not plain.GetPrimAtPath("/groom/Hair").HasVariantSets()
    for path in (STRANDS, "/groom/Hair/guides"):
        require_equal(values(made, path), values(plain, path))
    assert material_of(made).GetPath() == material_of(plain).GetPath() == "/groom/materials/Hair"
    read = {}
    for name in ("plain", "variants"):
        read[name] = {one.name: one for one in usd_curves.read(tmp_path / f"{name}.usdc").sets}
    assert read["plain"].keys() == read["variants"].keys()
    for name, before in read["plain"].items():
        after = read["variants"][name]
        np.testing.assert_array_equal(before.points, after.points)
        np.testing.assert_array_equal(before.radii, after.radii)
        np.testing.assert_array_equal(before.ids, after.ids)
    before = set(bpy.data.objects)
    bpy.ops.wm.usd_import(filepath=str(tmp_path / "variants.usdc"), import_guide=True)
    came = [len(one.data.curves) for one in set(bpy.data.objects) - before if one.type == "CURVES"]
    assert sorted(came) == [60, 500]


def test_levels_have_fewer_strands_with_the_same_total_width(twisted, tmp_path):
    """Each level has every second strand of the previous level, with all values, and the total width of all strands."""
    hair, _guides = twisted
    export(tmp_path / "groom.usdc", **VARIANTS)
    stage = stage_of(tmp_path / "groom.usdc")
    assert stage.GetPrimAtPath("/groom/Hair").GetVariantSet("lod").GetVariantNames() == sorted(NAMES)
    full, strand_count = values(stage), len(hair.data.curves)
    count = full["curveVertexCounts"][1][0]
    assert (full["curveVertexCounts"][1] == count).all()
    for index, name in enumerate(NAMES):
        choose(stage, "lod", name)
        level = values(stage)
        chosen = np.arange(0, strand_count, 2**index)
        points = (chosen[:, None] * count + np.arange(count)).ravel()
        assert level.keys() == full.keys()
        for attribute, (_kind, value, scope) in full.items():
            if attribute == "extent":
                continue
            rows = {"uniform": chosen, "vertex": points}.get(scope)
            rows = {"points": points, "curveVertexCounts": chosen}.get(attribute, rows)
            wanted = value if rows is None else value[rows]
            factor = strand_count / len(chosen) if attribute == "widths" else None
            if factor is None:
                np.testing.assert_array_equal(level[attribute][1], wanted, attribute)
            else:
                np.testing.assert_allclose(level[attribute][1], factor * wanted, rtol=1e-6)
        total = level["widths"][1].reshape(-1, count).sum(axis=0)
        np.testing.assert_allclose(total, full["widths"][1].reshape(-1, count).sum(axis=0), rtol=0.02)
        low, high = level["extent"][1]
        reach = 0.5 * level["widths"][1].max()
        np.testing.assert_allclose(low, level["points"][1].min(axis=0) - reach, rtol=1e-5)
        np.testing.assert_allclose(high, level["points"][1].max(axis=0) + reach, rtol=1e-5)


def test_looks_have_their_materials_and_colors(twisted, tmp_path):
    """A look's variant binds its material, and its mean color replaces the colors of points, at each level."""
    export(tmp_path / "groom.usdc", **VARIANTS)
    stage = stage_of(tmp_path / "groom.usdc")
    for variant, identifier in (("Black", "BLACK"), ("dyed_blue", "DYED_BLUE")):
        look = presets.PRESETS[identifier][1]
        choose(stage, "look", variant)
        for level in NAMES[:2]:
            choose(stage, "lod", level)
            material, found = material_of(stage), values(stage)
            assert material.GetPath() == f"/groom/Hair/looks/{variant}"
            np.testing.assert_allclose(material.GetInput("absorption").Get(), appearance.sigma_a(look), rtol=1e-5)
            assert material.ComputeSurfaceSource("mtlx")[0].GetIdAttr().Get() == "ND_surface"
            for name in COLORS[:2]:
                _kind, color, scope = found[f"primvars:{name}"]
                assert scope == "constant"
                np.testing.assert_allclose(color, appearance.mean_color(look)[None], rtol=1e-5)
            assert found["primvars:groom_roughness"][1] == pytest.approx(look.roughness)
    choose(stage, "look", "present")
    choose(stage, "lod", "full")
    assert values(stage)["primvars:groom_color"][2] == "vertex"


def test_the_operator_writes_saved_looks(twisted, tmp_path, monkeypatch):
    """The operator writes a saved look as a variant, with a name that USD permits, and refuses unknown names."""
    monkeypatch.setattr(saved_looks.FILES, "folder", lambda create: tmp_path)
    saved_looks.write("My red", Appearance(melanin=0.5, redness=0.9))
    bpy.context.view_layer.objects.active = twisted[0]
    path = tmp_path / "groom.usda"
    with pytest.raises(RuntimeError, match='no look "present"'):
        bpy.ops.vellus.export_groom(filepath=str(path), looks=" My red,, present ,")
    assert bpy.ops.vellus.export_groom(filepath=str(path), looks=" My red,, Black ,", level_count=2) == {"FINISHED"}
    stage = stage_of(path)
    choose(stage, "look", "My_red")
    assert material_of(stage).GetInput("redness").Get() == pytest.approx(0.9)
    choose(stage, "lod", "half")
    assert len(values(stage)["curveVertexCounts"][1]) == 250


@pytest.mark.parametrize("ending", [".usda", ".usdc"])
def test_files_with_variants_are_valid(twisted, tmp_path, ending):
    """USD's checker finds no fault in any variant."""
    path = tmp_path / f"groom{ending}"
    export(path, **VARIANTS)
    stage_of(path)
    from pxr import UsdUtils

    checker = UsdUtils.ComplianceChecker()
    checker.CheckCompliance(str(path))
    assert (checker.GetErrors(), checker.GetFailedChecks(), checker.GetWarnings()) == ([], [], [])


def test_an_instance_has_variants_of_its_own(twisted, tmp_path):
    """Another object that shows the hair can have another level and look than the hair."""
    hair, _guides = twisted
    again = bpy.data.objects.new("Again", hair.data)
    bpy.context.scene.collection.objects.link(again)
    again.matrix_world = Matrix.Translation((5.0, 1.0, 0.0)) @ hair.matrix_world
    update()
    export(tmp_path / "groom.usdc", **VARIANTS)
    stage = stage_of(tmp_path / "groom.usdc")
    place = "/groom/Hair_instance"
    assert len(values(stage, f"{place}/strands")["curveVertexCounts"][1]) == 500
    choose(stage, "lod", "quarter", place)
    assert len(values(stage, f"{place}/strands")["curveVertexCounts"][1]) == 125
    assert len(values(stage)["curveVertexCounts"][1]) == 500


def test_levels_move(baked, tmp_path):
    """Each level of animated hair has its strands' points in every frame."""
    export(tmp_path / "groom.usdc", animation="ALL", level_count=2)
    stage = stage_of(tmp_path / "groom.usdc")
    points = stage.GetPrimAtPath(STRANDS).GetAttribute("points")
    full = {time: np.array(points.Get(time)) for time in points.GetTimeSamples()}
    assert sorted(full) == [1.0, 2.0, 3.0, 4.0] and not np.array_equal(full[1.0], full[4.0])
    choose(stage, "lod", "half")
    points = stage.GetPrimAtPath(STRANDS).GetAttribute("points")
    assert points.GetTimeSamples() == sorted(full)
    for time, wanted in full.items():
        strands = wanted.reshape(500, -1, 3)[::2]
        np.testing.assert_array_equal(points.Get(time), strands.reshape(-1, 3))


@pytest.mark.parametrize(
    ("name", "changes", "reported"),
    [
        ("groom.abc", {"level_count": 2}, "neither levels of detail nor further looks"),
        ("groom.npz", {"looks": "Black"}, "neither levels of detail nor further looks"),
        ("groom.usdc", {"looks": "Black, Nobody's"}, 'no look "Nobody\'s"'),
    ],
)
def test_what_cannot_be_written_is_refused(hair, tmp_path, name, changes, reported):
    """Formats without variants and unknown looks are refused, and no file is written."""
    with pytest.raises(HairError, match=reported):
        export(tmp_path / name, **changes)
    assert not list(tmp_path.iterdir())
