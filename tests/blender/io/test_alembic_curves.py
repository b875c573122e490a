# SPDX-License-Identifier: GPL-3.0-or-later
"""Alembic files of other programs are read as guides and as hair, by Blender's exporter and with one object per
curve.
"""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.io import curve_objects
from hair_addon.core.errors import HairError
from hair_addon.core.files import alembic
from tests.support.commands import load, run_here
from tests.support.dynamics.following import update
from tests.support.exchange.alembic_files import of_maya
from tests.support.exchange.imported import curves_object, lines_on, world


@pytest.fixture
def lines(sphere, rng):
    """Return 12 lines of 5 points on a sphere that is elsewhere, in the world."""
    sphere.location, sphere.scale = (0.4, -0.3, 1.5), (0.1, 0.1, 0.1)
    update()
    return np.float32(list(lines_on(sphere, rng, 12, 5, 5)))


@pytest.mark.parametrize("kind", ["POLY", "CATMULL_ROM"])
def test_blenders_curves_are_read_as_they_are_seen_in_every_frame(scene, lines, tmp_path, kind):
    """Blender's curves are read as they are seen in every frame, turned, scaled and parented to a moving object."""
    made = curves_object(lines, kind=kind)
    made.data.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", np.full(60, 0.001, np.float32))
    made.rotation_euler, made.scale = (0.5, 0.2, 0.1), (2.0, 2.0, 2.0)
    carrier = bpy.data.objects.new("Carrier", None)
    scene.collection.objects.link(carrier)
    made.parent = carrier
    for frame, place in ((1, 0.0), (4, 3.0)):
        carrier.location = (place, 0.0, 1.0)
        carrier.keyframe_insert("location", frame=frame)
    path = tmp_path / "curves.abc"
    bpy.ops.wm.alembic_export(filepath=str(path), as_background_job=False, start=1, end=4)
    (found,) = alembic.grooms.read(path).sets
    placed = found.placed(1.0, "Y")
    assert found.name == "Imported" and found.is_smooth.all() == (kind == "CATMULL_ROM")
    np.testing.assert_allclose(placed.radii, 0.002, rtol=1e-6)
    np.testing.assert_allclose(placed.motion.times * 24.0, [1, 2, 3, 4])
    for frame in (1, 3, 4):
        scene.frame_set(frame)
        np.testing.assert_allclose(placed.motion.points_at(frame - 1), world(made), atol=1e-5)


def test_one_object_a_curve_is_hair_of_all_of_them(scene, sphere, lines, tmp_path):
    """A file with one object per curve becomes hair of all curves.

    Unit and axis are inferred and reported; wrong ones are refused with a sentence that names fitting ones.
    """
    of_maya(tmp_path / "curves.abc", lines)
    bpy.ops.wm.obj_export(filepath=str(tmp_path / "sphere.obj"), forward_axis="Y", up_axis="Z")
    words = ["groom", tmp_path / "sphere.obj", "--hair-from", tmp_path / "curves.abc", "--out", tmp_path / "out.npz"]
    refused = run_here(*words, "--unit", "m", "--json")
    assert refused.status == 1 and "they would lie on it in centimeters with Y up" in refused.errors
    assert not (tmp_path / "out.npz").exists()
    for more, notes in (((), 1), (("--unit", "0.01"), 1)):
        ended = run_here(*words, *more)
        assert ended.status == 0 and ended.errors.count("does not state its unit") == notes, ended
        arrays = load(tmp_path / "out.npz")
        np.testing.assert_allclose(arrays["strand_points"], lines, atol=1e-6)
        np.testing.assert_allclose(arrays["strand_widths"], 1e-4, rtol=1e-5)
    assert run_here(*words, "--object", "curve3").status == 0
    np.testing.assert_allclose(load(tmp_path / "out.npz")["strand_points"], lines[3:4], atol=1e-6)
    for options, reported in (
        (("--object", "fringe"), 'no curves "fringe", but curve0, curve1, curve2, curve3, curve4…'),
        (("--unit", "yards"), "yards is not a unit"),
    ):
        ended = run_here(*words, *options)
        assert ended.status == 1 and reported in ended.errors, ended


def test_scripts_read_them_too(scene, sphere, lines, tmp_path):
    of_maya(tmp_path / "curves.abc", lines)
    found = api.import_curves(tmp_path / "curves.abc", sphere, "GUIDES", unit="cm", up="Y")
    assert found.notes == [] and found.guides is None
    np.testing.assert_allclose(world(found.curves), lines.reshape(-1, 3), atol=1e-6)
    for arguments, reported in (
        ({"unit": 1.0, "up": "Y"}, "in meters with Y up: they would lie on it in centimeters with Y up"),
        ({"up": "up"}, "Unknown axis"),
        ({"kind": "FUR"}, "Unknown kind"),
        ({"unit": "yards"}, "is not a unit"),
        ({"name": "fringe"}, "has no curves"),
    ):
        with pytest.raises(api.HairError, match=reported):
            api.import_curves(tmp_path / "curves.abc", sphere, **arguments)


@pytest.mark.parametrize(("ending", "kind"), [(".abc", "POLY"), (".usdc", "POLY"), (".abc", "CATMULL_ROM")])
def test_hair_of_a_file_that_moves_plays_all_of_its_frames(scene, sphere, lines, tmp_path, ending, kind):
    """Animated hair plays all its frames in a .blend file, and gives other files the current frame and a warning."""
    lines[::3] = lines[::3, ::-1]  # from tip to root
    made = curves_object(lines, kind=kind)
    for frame, place in ((1, 0.0), (4, 0.3)):
        made.location = (place, 0.0, 0.0)
        made.keyframe_insert("location", frame=frame)
    path = tmp_path / f"moving{ending}"
    scene.frame_end = 4
    if ending == ".abc":
        bpy.ops.wm.alembic_export(filepath=str(path), as_background_job=False, start=1, end=4)
    else:
        bpy.ops.wm.usd_export(filepath=str(path), export_animation=True)
    expected = []
    for frame in (1, 2, 3, 4):
        scene.frame_set(frame)
        expected.append(world(made).reshape(12, 5, 3))
    bpy.ops.wm.obj_export(filepath=str(tmp_path / "sphere.obj"), forward_axis="Y", up_axis="Z")
    words = ["groom", tmp_path / "sphere.obj", "--hair-from", path, "--object", "Imported"]
    ended = run_here(*words, "--out", tmp_path / "out.npz")
    assert ended.status == 0 and "from frame 1 to 4: its curves are read only at frame 1" in ended.errors
    ended = run_here(*words, "--out", tmp_path / "out.blend")
    assert ended.status == 0 and "plays its 4 frames" in ended.errors
    assert ("its Catmull-Rom splines become polylines" in ended.errors) == (kind == "CATMULL_ROM")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    hair = next(o for o in bpy.data.objects if o.type == "CURVES" and o.data.vellus.kind == "HAIR")
    for frame, points in enumerate(expected, 1):
        bpy.context.scene.frame_set(frame)
        points[::3] = points[::3, ::-1]
        played = np.split(world(hair), np.cumsum([len(strand.points) for strand in hair.data.curves])[:-1])
        for strand, its in zip(played, points, strict=True):
            assert len(strand) == 5 if kind == "POLY" else len(strand) > 5
            np.testing.assert_allclose(strand[[0, -1]], its[[0, -1]], atol=1e-5)
            assert np.linalg.norm(strand[:, None] - its, axis=2).min(axis=0).max() < 1e-5


def test_a_failed_import_leaves_nothing(hair, tmp_path, monkeypatch):
    """If the hair of a groom cannot be made after its guides, no object and no Curves remain."""
    api.export_groom(tmp_path / "groom.abc", [hair])
    before = {*bpy.data.objects}, {*bpy.data.hair_curves}
    made, real = [], curve_objects.new_object

    def new_object(*arguments, **options):
        if made:
            raise HairError("No hair.")
        made.append(real(*arguments, **options).name)

    monkeypatch.setattr(curve_objects, "new_object", new_object)
    with pytest.raises(HairError, match=r"No hair\."):
        api.import_curves(tmp_path / "groom.abc", bpy.data.objects["Sphere"])
    assert made == ["Guides.001"] and ({*bpy.data.objects}, {*bpy.data.hair_curves}) == before
