# SPDX-License-Identifier: GPL-3.0-or-later
"""Scripts and the command line use curves as guides, and brushes add to guides of any length."""

import io
import json
import zipfile
from pathlib import Path

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.groom.guides import brushes
from tests.support.commands import TETRAHEDRON, load, run_here, write_obj
from tests.support.exchange.imported import curves_object, lines_on, select, stored, world
from tests.support.pairs import share_of

ESSENTIALS = "brushes/essentials_brushes-curve_sculpt.blend/Brush/"


@pytest.fixture
def lines(sphere, rng):
    """Return 30 lines of 5 points that start on the sphere."""
    return np.float32(list(lines_on(sphere, rng, 30, 5, 5)))


# ------------------------------------------------------------------------------------------ for scripts


def test_a_script_uses_curves_as_guides_and_grows_hair(sphere, lines):
    made = curves_object(lines)
    before = world(made)
    guides = api.use_as_guides(made)
    np.testing.assert_allclose(world(made), before, atol=1e-6)
    assert guides == made.data and guides.vellus.kind == "GUIDES" and "Hair" not in bpy.data.objects
    hair = api.interpolate_hair(guides, strand_count=100)
    assert len(hair.curves) == 100
    with pytest.raises(api.HairError, match="already"):
        api.use_as_guides(guides)


def test_arrays_become_strands_on_a_mesh_of_arrays(sphere, lines):
    """Arrays become strands on a mesh of arrays: lines that begin at their tips are reversed, and single points are
    left out.
    """
    vertices = np.array([vertex.co for vertex in sphere.data.vertices], np.float32)
    triangles = np.array([polygon.vertices[:] for polygon in sphere.data.polygons], np.int32)
    turned = [line[::-1] for line in lines]
    guides = api.use_as_guides([*turned, lines[0][:1]], (vertices, triangles))
    np.testing.assert_allclose(guides.numpy()[:, [0, -1]], lines[:, [0, -1]], atol=1e-6)
    hair = api.interpolate_hair(guides, mesh=(vertices, triangles), strand_count=50)
    assert hair.numpy().shape == (50, 41, 3) and np.isfinite(hair.numpy()).all()


# ------------------------------------------------------------------------------------------ on the command line


def write_npz(path):
    np.savez(path, guide_points=stored(bpy.data.objects["Imported"]).reshape(30, 5, 3))


FILES = {
    ".blend": lambda path: bpy.ops.wm.save_as_mainfile(filepath=path, copy=True),
    ".usdc": lambda path: bpy.ops.wm.usd_export(filepath=path),
    ".abc": lambda path: bpy.ops.wm.alembic_export(filepath=path, as_background_job=False, start=1, end=1),
    ".npz": write_npz,
}


@pytest.mark.parametrize("ending", share_of(FILES, 2))
def test_guides_come_from_a_file(sphere, lines, tmp_path, ending):
    curves_object(lines)
    bpy.ops.wm.obj_export(filepath=str(tmp_path / "sphere.obj"), forward_axis="Y", up_axis="Z")
    FILES[ending](str(tmp_path / f"guides{ending}"))
    words = ("--guides-from", tmp_path / f"guides{ending}", "--strands", 100, "--out", tmp_path / "out.npz", "--json")
    ended = run_here("groom", tmp_path / "sphere.obj", *words)
    assert (ended.status, ended.errors) == (0, ""), ended
    assert json.loads(ended.out.splitlines()[-1])["guides"] == 30
    arrays = load(tmp_path / "out.npz")
    np.testing.assert_allclose(arrays["guide_points"], lines, atol=1e-5)
    assert arrays["strand_points"].shape == (100, 41, 3)
    assert [o.type for o in bpy.data.objects] == ["CURVES", "CURVES", "MESH"]  # nothing else of the file is left


def test_guides_come_from_the_same_file(sphere, lines, tmp_path):
    curves_object(lines)
    curves_object(lines[:3], "Others")
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    words = ("groom", path, "--guides-from", path, "--strands", 100, "--out", tmp_path / "out.blend")
    assert 'no curves "Fringe", but Imported, Others' in run_here(*words, "--object", "Fringe").errors
    assert run_here(*words, "--object", "Imported").status == 0
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    assert bpy.data.objects["Imported"].data.vellus.kind == "GUIDES"
    assert bpy.data.objects["Others"].data.vellus.kind == "NONE"
    assert run_here(*words).status == 0  # all that the file has
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    assert len(bpy.data.objects["Imported"].data.curves) == 33 and "Others" not in bpy.data.objects


def test_guides_of_ours_keep_the_hair_that_follows_them(hair, tmp_path):
    """Guides of ours keep the hair that follows them when their modifier is applied and their data is replaced."""
    path = tmp_path / "ours.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    ended = run_here("groom", path, "--guides-from", path, "--strands", 100, "--out", tmp_path / "out.blend")
    assert ended.status == 0, ended
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    guides = bpy.data.hair_curves["Guides"]
    assert [c.vellus.guide_curves for c in bpy.data.hair_curves if c.vellus.kind == "HAIR"] == [guides, guides]


@pytest.mark.parametrize(
    ("name", "content", "reported"),
    [
        ("none.usdc", None, "is not a file"),
        ("curves.txt", b"", "Curves cannot be read from"),
        ("cut.npz", b"PK\x03\x04 and no more", "cannot be read"),
        ("cut.usdc", b"PXR-USDC and no more", "cannot be read"),
        ("cut.abc", b"Ogawa\xff\x00\x01 and no more", "Alembic"),
        ("cut.blend", b"BLENDER and no more", "cannot be read"),
    ],
)
def test_a_file_without_curves_is_one_sentence(scene, tmp_path, name, content, reported):
    mesh = write_obj(tmp_path / "mesh.obj", *TETRAHEDRON)
    if content is not None:
        (tmp_path / name).write_bytes(content)
    ended = run_here("groom", mesh, "--guides-from", tmp_path / name, "--out", tmp_path / "out.npz")
    assert ended.status != 0 and reported in ended.errors and ended.errors.count("\n") == 1
    assert not (tmp_path / "out.npz").exists()


@pytest.mark.parametrize("shape", [(0, 5, 3), (3, 1, 3), (3, 5), (3, 5, 2)])
def test_arrays_that_are_no_curves_are_one_sentence(scene, tmp_path, shape):
    mesh = write_obj(tmp_path / "mesh.obj", *TETRAHEDRON)
    np.savez(tmp_path / "guides.npz", guide_points=np.zeros(shape, np.float32))
    ended = run_here("groom", mesh, "--guides-from", tmp_path / "guides.npz", "--out", tmp_path / "out.npz")
    assert ended.status == 1 and "must be (G, P, 3)" in ended.errors


# ------------------------------------------------------------------------------------------ brushes that add


def brush(name):
    bpy.ops.brush.asset_activate(asset_library_type="ESSENTIALS", relative_asset_identifier=ESSENTIALS + name)
    return bpy.context.tool_settings.curves_sculpt.brush.curves_sculpt_settings


@pytest.fixture
def shipped():
    """Return a function that resets brushes to the settings that Blender ships."""

    def reset():
        brushes._fitted.clear()
        for name in ("Add", "Density"):
            for setting, value in brushes._SHIPPED.items():
                setattr(brush(name), setting, value)

    return reset


def test_blender_ships_brushes_as_we_take_them_to_be(scene):
    """Blender's brushes have the settings that we expect; otherwise all would count as changed by the artist."""
    folder = Path(bpy.utils.system_resource("DATAFILES", path="assets/brushes"))
    with bpy.data.libraries.load(str(folder / "essentials_brushes-curve_sculpt.blend")) as (_there, wanted):
        wanted.brushes = ["Add", "Density"]
    for own in wanted.brushes:
        assert brushes._settings_of(own.curves_sculpt_settings) == brushes._rounded(brushes._SHIPPED)
        bpy.data.brushes.remove(own)


def test_combing_fits_the_brushes_that_add_to_the_guides(guides, shipped):
    bpy.ops.object.mode_set(mode="SCULPT_CURVES")
    shipped()
    brush("Comb")
    bpy.ops.object.mode_set(mode="OBJECT")
    select(guides)
    bpy.ops.vellus.comb_guides()
    assert bpy.context.tool_settings.curves_sculpt.brush.name == "Comb"
    lengths = np.linalg.norm(np.diff(stored(guides).reshape(60, 41, 3), axis=1), axis=-1).sum(axis=1)
    for name in ("Add", "Density"):
        settings = brush(name)
        assert settings.curve_length == pytest.approx(np.median(lengths), rel=1e-5)
        assert settings.points_per_curve == 41
        assert settings.use_length_interpolate and settings.use_point_count_interpolate
        assert settings.use_shape_interpolate  # else they plant spikes along the normal in draped hair
    assert guides.data.use_sculpt_collision  # else strokes push guides into the surface
    assert guides.data.surface_collision_distance == pytest.approx(0.02 * np.median(lengths), rel=1e-5)
    guides.data.use_sculpt_collision = False  # an artist's choice
    brush("Add").curve_length = 0.7  # an artist's choice
    bpy.ops.object.mode_set(mode="OBJECT")
    guides.data.vellus.guides.length = 0.2
    bpy.context.view_layer.update()
    bpy.ops.vellus.comb_guides()
    assert brush("Add").curve_length == pytest.approx(0.7)
    assert brush("Density").curve_length < 0.3
    assert not guides.data.use_sculpt_collision
    shipped()
    bpy.ops.object.mode_set(mode="OBJECT")


def test_arrays_that_claim_more_than_their_file_holds_take_no_memory(scene, tmp_path):
    mesh = write_obj(tmp_path / "mesh.obj", *TETRAHEDRON)
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f4", "fortran_order": False, "shape": (10**9, 41, 3)})
    with zipfile.ZipFile(tmp_path / "guides.npz", "w") as archive:
        archive.writestr("guide_points.npy", header.getvalue() + bytes(100))
    ended = run_here("groom", mesh, "--guides-from", tmp_path / "guides.npz", "--out", tmp_path / "out.npz")
    assert ended.status == 1 and "cannot be read: it is damaged" in ended.errors
