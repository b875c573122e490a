# SPDX-License-Identifier: GPL-3.0-or-later
"""USD and Alembic files have guides and hair in their posed positions, and are read back the same."""

import bpy
import numpy as np
import pytest

from tests.support.dynamics.following import update
from tests.support.reading import attribute

GUIDE_COUNT, STRAND_COUNT = 20, 60


def export_usd(path, animated):
    bpy.ops.wm.usd_export(filepath=path, export_hair=True, export_animation=animated)


def import_usd(path):
    bpy.ops.wm.usd_import(filepath=path)


def export_alembic(path, animated):
    end = bpy.context.scene.frame_end if animated else bpy.context.scene.frame_current
    bpy.ops.wm.alembic_export(filepath=path, start=bpy.context.scene.frame_current, end=end, export_hair=True)


def import_alembic(path):
    bpy.ops.wm.alembic_import(filepath=path, as_background_job=False)


FORMATS = {
    ".usdc": (export_usd, import_usd),
    ".usda": (export_usd, import_usd),
    ".abc": (export_alembic, import_alembic),
}


def world(curves_object):
    """Return (S, P, 3) points and (S, P) radii [m] in the world, as Blender renders them after the object's
    modifiers.
    """
    evaluated = curves_object.evaluated_get(bpy.context.evaluated_depsgraph_get())
    curves, matrix = evaluated.data, np.array(evaluated.matrix_world)
    points, radii = np.empty((len(curves.points), 3), np.float32), np.empty(len(curves.points), np.float32)
    curves.attributes["position"].data.foreach_get("vector", points.ravel())
    curves.attributes["radius"].data.foreach_get("value", radii)
    shape = len(curves.curves), -1
    points = points @ matrix[:3, :3].T + matrix[:3, 3]
    radii = radii * abs(np.linalg.det(matrix[:3, :3])) ** (1.0 / 3.0)
    return points.reshape(*shape, 3), radii.reshape(shape)


def grow(surface):
    bpy.context.view_layer.objects.active = surface
    bpy.ops.vellus.add_hair(guide_count=GUIDE_COUNT, strand_count=STRAND_COUNT, length=0.3, radius=0.004)
    return bpy.data.objects["Hair Guides"], bpy.data.objects["Hair"]


def imported(path, read):
    """Return the Curves objects of a file, by their number of strands."""
    before = set(bpy.data.objects)
    read(path)
    update()
    return {len(o.data.curves): o for o in set(bpy.data.objects) - before if o.type == "CURVES"}


@pytest.mark.parametrize("format", FORMATS)
@pytest.mark.parametrize("is_drawn", [True, False])
def test_strands_come_back_as_they_went(sphere, tmp_path, capfd, format, is_drawn):
    """Strands of a turned and twisted surface come back, whether Vellus or Blender draws the hair."""
    write, read = FORMATS[format]
    sphere.location, sphere.rotation_euler, sphere.scale = (1.0, 2.0, 3.0), (0.3, 0.2, 0.5), (2.0, 2.0, 2.0)
    update()
    made = grow(sphere)
    if not is_drawn:
        bpy.ops.vellus.toggle_drawing()
    twist = sphere.modifiers.new("Twist", "SIMPLE_DEFORM")
    twist.deform_method, twist.angle = "TWIST", 1.0
    update()
    expected = [world(curves_object) for curves_object in made]
    path = str(tmp_path / f"groom{format}")
    capfd.readouterr()
    write(path, False)
    reported = capfd.readouterr()
    assert not any(word in reported.out + reported.err for word in ("WARNING", "ERROR"))
    found = imported(path, read)
    assert sorted(found) == [GUIDE_COUNT, STRAND_COUNT]
    for count, (points, radii) in zip((GUIDE_COUNT, STRAND_COUNT), expected, strict=True):
        came_points, came_radii = world(found[count])
        np.testing.assert_allclose(came_points, points, atol=1e-5)
        np.testing.assert_allclose(came_radii, radii, rtol=1e-5)


def test_usd_keeps_what_strands_carry(sphere, tmp_path):
    """USD stores as primvars what differs by strand, with roots and clumps, for tools that read primvars."""
    _guides, hair = grow(sphere)
    path = str(tmp_path / "groom.usdc")
    export_usd(path, False)
    came = imported(path, import_usd)[STRAND_COUNT]
    for name, width in (
        ("strand_random", 1),
        ("guide_curve_index", 1),
        ("surface_uv_coordinate", 2),
        ("root_triangle", 1),
    ):
        np.testing.assert_array_equal(attribute(came, name, width), attribute(hair, name, width))


def test_usd_is_z_up_and_in_meters_and_widths_are_diameters(sphere, tmp_path):
    bpy.utils.expose_bundled_modules()
    from pxr import Usd, UsdGeom

    _guides, hair = grow(sphere)
    path = str(tmp_path / "groom.usdc")
    export_usd(path, False)
    stage = Usd.Stage.Open(path)
    assert UsdGeom.GetStageUpAxis(stage) == "Z" and UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    curves = [UsdGeom.BasisCurves(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.BasisCurves)]
    strands = next(c for c in curves if len(c.GetCurveVertexCountsAttr().Get()) == STRAND_COUNT)
    assert strands.GetTypeAttr().Get() == "linear"
    np.testing.assert_allclose(strands.GetWidthsAttr().Get(), 2.0 * world(hair)[1].ravel(), rtol=1e-5)


@pytest.mark.parametrize("format", [".usdc", ".abc"])
def test_every_frame_comes_back(arm, scene, tmp_path, format):
    write, read = FORMATS[format]
    _guides, hair = grow(arm)
    scene.frame_start, scene.frame_end = 1, 11
    path = str(tmp_path / f"groom{format}")
    write(path, True)
    came = imported(path, read)[STRAND_COUNT]
    moved = []
    for frame in (1, 6, 11):
        scene.frame_set(frame)
        np.testing.assert_allclose(world(came)[0], world(hair)[0], atol=1e-4)
        moved.append(world(came)[0])
    assert np.abs(moved[2] - moved[0]).max() > 0.5
