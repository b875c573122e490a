# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair follows its surface in Blender's own evaluation: in renders, exports, and files that link it."""

import bpy
import numpy as np
import pytest

from hair_addon.core.geometry.closest_point import SurfaceQuery
from hair_addon.core.geometry.mesh import positions
from tests.support.dynamics.following import assert_follows, grow, surface_points, update
from tests.support.pictures import render_probe
from tests.support.reading import evaluated_points, points


def read(depsgraph):
    """Return (frame, strands of the hair, `TriMesh` of its surface) as Cycles receives them."""
    handed = {i.object.name: i.object.data for i in depsgraph.object_instances}
    strands, surface = render_probe.read_points(handed["Hair"]), render_probe.read_mesh(handed["Grid"])
    return depsgraph.scene.frame_current, strands, surface


def test_every_frame_of_a_render_has_its_hair(arm, scene, tmp_path):
    """Every frame has its hair on a surface with a finer subdivision in renders than in the viewport."""
    finer = arm.modifiers.new("Finer", "SUBSURF")
    finer.subdivision_type, finer.levels, finer.render_levels = "SIMPLE", 0, 1
    update()
    _guides, hair = grow(arm)
    scene.render.filepath = str(tmp_path / "frame")
    with render_probe.reading(read) as render:
        seen = render(frames=(1, 11, 5))
    assert [frame for frame, *_ in seen] == [1, 6, 11]
    for frame, found, surface in seen:
        assert len(surface.vertices) > len(arm.data.vertices)
        nearest = positions(surface, SurfaceQuery(surface).nearest(found[:, 0]))
        np.testing.assert_allclose(found[:, 0], nearest, atol=1e-5)
        scene.frame_set(frame)
        # Vertices in between have rotations of their own: where the arm bends, strands of 0.3 m turn a little more.
        np.testing.assert_allclose(found, evaluated_points(hair), atol=0.05)
    assert np.abs(seen[2][1] - seen[0][1]).max() > 0.5


def test_an_export_has_hair_in_every_frame(arm, scene, tmp_path):
    bpy.utils.expose_bundled_modules()
    from pxr import Usd, UsdGeom

    _guides, hair = grow(arm)
    scene.frame_start, scene.frame_end = 1, 11
    path = str(tmp_path / "arm.usdc")
    bpy.ops.wm.usd_export(filepath=path, export_animation=True, export_hair=True)
    stage = Usd.Stage.Open(path)
    exported = [UsdGeom.BasisCurves(p) for p in stage.Traverse() if p.IsA(UsdGeom.BasisCurves)]
    strands = next(c for c in exported if len(c.GetCurveVertexCountsAttr().Get(1.0)) == 200)
    for frame in (1, 6, 11):
        scene.frame_set(frame)
        found = np.array(strands.GetPointsAttr().Get(float(frame))).reshape(200, -1, 3)
        np.testing.assert_allclose(found, evaluated_points(hair), atol=1e-5)


def linked_groom(tmp_path, sphere):
    """Return [sphere, guides, hair] objects, linked from a file."""
    grow(sphere)
    path = str(tmp_path / "library.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(path, link=True) as (_found, wanted):
        wanted.objects = ["Sphere", "Guides", "Hair"]
    linked = [bpy.data.objects[name] for name in ("Sphere", "Guides", "Hair")]
    for linked_object in linked:
        bpy.context.scene.collection.objects.link(linked_object)
    update()
    return linked


def test_linked_hair_is_drawn_and_refused_in_one_sentence(sphere, tmp_path):
    linked_sphere, guides, hair = linked_groom(tmp_path, sphere)
    assert_follows(guides, hair)
    bpy.context.view_layer.objects.active = linked_sphere
    with pytest.raises(RuntimeError, match="is linked from another file: make a library override of it first"):
        bpy.ops.vellus.distribute_guides(guide_count=5)
    assert len(guides.data.curves) == 40


def test_an_overridden_surface_carries_its_hair(sphere, tmp_path):
    linked_sphere, _guides, _hair = linked_groom(tmp_path, sphere)
    linked_sphere.override_hierarchy_create(bpy.context.scene, bpy.context.view_layer)
    update()
    surface, hair = (next(o for o in bpy.data.objects if o.name == n and o.library is None) for n in ("Sphere", "Hair"))
    twist = surface.modifiers.new("Twist", "SIMPLE_DEFORM")
    twist.deform_method, twist.angle = "TWIST", 1.0
    update()
    found = evaluated_points(hair)
    assert np.abs(found - points(hair)).max() > 0.1
    np.testing.assert_allclose(found[:, 0], surface_points(hair, surface), atol=1e-5)
