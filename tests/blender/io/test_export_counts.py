# SPDX-License-Identifier: GPL-3.0-or-later
"""Exported curves keep their numbers of points."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data.strands import curves
from hair_addon.blender.io import groom_files
from hair_addon.core.errors import HairError
from hair_addon.core.files import array_grooms
from tests.support.dynamics.following import update
from tests.support.exchange import alembic_reader
from tests.support.exchange.exported import export, shape, widths


def ragged(curves_object):
    """Return (counts (S,), points (N, 3) [m]) of curves with any point counts, as Blender renders them."""
    evaluated = curves_object.evaluated_get(bpy.context.evaluated_depsgraph_get())
    matrix = np.array(evaluated.matrix_world)
    there = curves.read_points(evaluated.data) @ matrix[:3, :3].T + matrix[:3, 3]
    return np.diff(curves.curve_offsets(evaluated.data)), there


@pytest.mark.parametrize(("ending", "animation"), [(".abc", "NONE"), (".usda", "NONE"), (".usdc", "ALL")])
def test_curves_keep_their_numbers_of_points(imported, tmp_path, ending, animation):
    """60 curves of 2 to 12 points, carried by a twisted surface, keep their numbers of points in all frames."""
    radii = np.linspace(0.001, 0.002, len(imported.data.points), dtype=np.float32)
    imported.data.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", radii)
    made = api.use_as_hair(imported, bpy.data.objects["Sphere"])
    made.hair.vellus.appearance.tip_absorption = 0.2
    twist = bpy.data.objects["Sphere"].modifiers.new("Twist", "SIMPLE_DEFORM")
    twist.deform_method, twist.angle = "TWIST", 0.0
    twist.keyframe_insert("angle", frame=1)
    twist.angle = 1.0
    twist.keyframe_insert("angle", frame=3)
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 3
    bpy.context.scene.frame_set(3)
    counts, points = ragged(bpy.data.objects[imported.name])
    assert len({*counts}) > 5
    export(tmp_path / f"groom{ending}", animation=animation)
    found = arrays_of(tmp_path / f"groom{ending}")
    np.testing.assert_array_equal(found["counts"], counts)
    np.testing.assert_allclose(found["points"], points, atol=1e-6)
    np.testing.assert_allclose(found["widths"], widths(bpy.data.objects[imported.name]), rtol=1e-5)
    starts = np.cumsum([0, *counts])
    at_roots, at_tips = found["colors"][starts[:-1]], found["colors"][starts[1:] - 1]
    assert (at_tips > at_roots).all() and len(found["colors"]) == len(points)  # tips are lighter


def test_arrays_keep_them_too(imported, tmp_path):
    """60 curves of 2 to 12 points keep their numbers of points in an .npz file that is read as hair and as guides."""
    radii = np.linspace(0.001, 0.002, len(imported.data.points), dtype=np.float32)
    imported.data.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", radii)
    made = api.use_as_hair(imported, bpy.data.objects["Sphere"])
    update()
    counts, points = ragged(bpy.data.objects[imported.name])
    assert len({*counts}) > 5
    path = tmp_path / "groom.npz"
    groom_files.write(path, made.guides, made.hair, np.eye(3))
    guides, hair = array_grooms.read(path).sets
    np.testing.assert_array_equal(hair.counts, counts)
    np.testing.assert_allclose(hair.points, points, atol=1e-6)
    np.testing.assert_allclose(2.0 * hair.radii, widths(bpy.data.objects[imported.name]), rtol=1e-5)
    assert guides.is_guide and len({*guides.counts}) == 1
    arrays = dict(np.load(path))
    np.testing.assert_array_equal(arrays["roots"], arrays["strand_points"][np.cumsum([0, *counts])[:-1]])
    assert "guide_counts" not in arrays and arrays["guide_points"].ndim == 3
    counts[0] -= 1
    for wrong in (counts, counts[None], counts + 0.5, np.zeros(0, int), np.full(2, 2**62)):
        np.savez(path, **(arrays | {"strand_counts": wrong}))
        with pytest.raises(HairError, match="strand_"):
            array_grooms.read(path)


def test_catmull_rom_splines_are_written_through_their_points(imported, tmp_path):
    imported.data.set_types(type="CATMULL_ROM")
    radii = np.linspace(0.001, 0.002, len(imported.data.points), dtype=np.float32)
    imported.data.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", radii)
    api.use_as_hair(imported, bpy.data.objects["Sphere"])
    update()
    counts, points = ragged(bpy.data.objects[imported.name])
    export(tmp_path / "groom.usda")
    found = arrays_of(tmp_path / "groom.usda")
    lines = np.where(counts > 2, np.ceil(40 / np.maximum(counts - 1, 1)), 1).astype(int)
    np.testing.assert_array_equal(found["counts"], (counts - 1) * lines + 1)
    starts, own = np.cumsum([0, *found["counts"]])[:-1], np.repeat(np.arange(len(counts)), counts)
    along = np.arange(len(own)) - np.cumsum([0, *counts])[own]
    kept = starts[own] + along * lines[own]
    np.testing.assert_allclose(found["points"][kept], points, atol=1e-6)
    np.testing.assert_allclose(found["widths"][kept], widths(bpy.data.objects[imported.name]), rtol=1e-5)
    assert (found["widths"] > 0.0).all()
    # In the middle of a segment between four points: the spline's own (-1, 9, 9, -1) / 16.
    curve = int(np.flatnonzero((counts >= 6) & (lines % 2 == 0))[0])
    near = points[np.cumsum([0, *counts])[curve] + np.arange(1, 5)]
    middle = found["points"][starts[curve] + 2 * lines[curve] + lines[curve] // 2]
    np.testing.assert_allclose(middle, np.array([-1, 9, 9, -1]) @ near / 16.0, atol=1e-6)


def arrays_of(path):
    """Return {name: array} [m] of the strands of the only group of an exported file, at its last time."""
    if path.suffix == ".abc":
        archive = alembic_reader.read(path)
        (name,) = (n for n in archive.objects["groom"].children if "_guides" not in n)
        found = shape(archive, name)
        return {
            "counts": found["nVertices"].only,
            "points": found["P"].only / 100.0,
            "widths": found["groom_width"].only / 100.0,
            "colors": found["groom_color"].only,
        }
    bpy.utils.expose_bundled_modules()
    from pxr import Usd

    stage = Usd.Stage.Open(str(path))
    (prim,) = (p for p in stage.Traverse() if p.GetName() == "strands")
    names = {"counts": "curveVertexCounts", "colors": "primvars:displayColor"}
    time = Usd.TimeCode(stage.GetEndTimeCode()) if stage.HasAuthoredTimeCodeRange() else Usd.TimeCode.Default()
    return {n: np.array(prim.GetAttribute(names.get(n, n)).Get(time)) for n in ("counts", "points", "widths", "colors")}


def test_guides_of_any_number_of_points_are_exported_as_they_are(imported, tmp_path):
    guides = api.use_as_guides(imported, bpy.data.objects["Sphere"])
    api.interpolate_hair(guides, strand_count=50)
    update()
    counts, points = ragged(bpy.data.objects[imported.name])
    export(tmp_path / "groom.abc")
    (name,) = (n for n in alembic_reader.read(tmp_path / "groom.abc").objects["groom"].children if "_guides" in n)
    found = shape(alembic_reader.read(tmp_path / "groom.abc"), name)
    np.testing.assert_array_equal(found["nVertices"].only, counts)
    np.testing.assert_allclose(found["P"].only, 100.0 * points, atol=1e-3)
    assert (found["groom_width"].only > 0.0).all()
    guides.vellus.simulates = guides.vellus.is_live = True
    made = export(tmp_path / "groom.abc")
    assert [str(note) for note in made.notes if "41 points per guide" in str(note)]
