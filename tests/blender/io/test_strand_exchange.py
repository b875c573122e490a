# SPDX-License-Identifier: GPL-3.0-or-later
"""Strand files of other programs are read onto surfaces with any transform, written, and read back."""

import json
from pathlib import Path

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.io import curve_files
from hair_addon.core.errors import HairError
from hair_addon.core.files import curve_file
from hair_addon.core.files.export_settings import OF_STRANDS
from tests.support.commands import run_here
from tests.support.dynamics.following import update
from tests.support.exchange import strand_files
from tests.support.exchange.imported import lines_on, select, world

FORMATS = {
    ".hair": strand_files.hair,
    ".data": strand_files.data,
    ".bin": strand_files.bin_file,
    ".ply": strand_files.ply,
    ".obj": strand_files.obj,
    ".tfx": strand_files.tfx,
    ".npz": strand_files.npz,
}
WIDTHS = {".hair": "widths", ".ply": "widths", ".npz": "widths"}

# Where the surface is; a parent; meters in a unit of the scene.
PLACES = {
    "moved": {"location": (3.0, -2.0, 1.0)},
    "turned": {"rotation_euler": (0.4, 1.1, -0.7)},
    "small": {"scale": (0.01, 0.01, 0.01)},
    "large": {"scale": (100.0, 100.0, 100.0)},
    "uneven": {"scale": (0.5, 2.0, 1.0), "rotation_euler": (0.3, 0.0, 0.2)},
    "mirrored": {"scale": (-1.0, 1.0, 1.0), "location": (1.0, 0.0, 0.0)},
    "parented": {
        "location": (0.5, 0.0, 0.0),
        "parent": {"location": (1.0, 2.0, 3.0), "rotation_euler": (0.0, 0.6, 0.0)},
    },
    "in centimeters": {"scale": (10.0, 10.0, 10.0), "scene": 0.01},
}


def put(
    sphere, location=(0.0, 0.0, 0.0), rotation_euler=(0.0, 0.0, 0.0), scale=(1.0, 1.0, 1.0), parent=None, scene=1.0
):
    """Put the surface in one of `PLACES`."""
    sphere.location, sphere.rotation_euler, sphere.scale = location, rotation_euler, scale
    if parent is not None:
        sphere.parent = bpy.data.objects.new("Parent", None)
        bpy.context.scene.collection.objects.link(sphere.parent)
        sphere.parent.location, sphere.parent.rotation_euler = parent["location"], parent["rotation_euler"]
    bpy.context.scene.unit_settings.scale_length = scene
    update()


@pytest.mark.parametrize("place", PLACES)
def test_strands_lie_where_the_file_has_them(scene, sphere, rng, tmp_path, place):
    """Each format in centimeters with Y up gives positions within 1e-5 of the surface's size, and the file's widths."""
    put(sphere, **PLACES[place])
    meters = PLACES[place].get("scene", 1.0)
    lines = [np.float32(line) for line in lines_on(sphere, rng, 8, 5, 5)]
    size = float(np.ptp(np.concatenate(lines), axis=0).max())
    in_file = [np.float32(100.0 * meters * line[:, [0, 2, 1]] * [1.0, 1.0, -1.0]) for line in lines]
    diameters = np.float32(100.0 * meters * np.linspace(1e-4, 2e-4, 40) * size)
    for ending, made in FORMATS.items():
        path = tmp_path / f"strands{ending}"
        path.write_bytes(made(in_file, **({WIDTHS[ending]: diameters} if ending in WIDTHS else {})))
        found = api.import_curves(path, sphere, unit="cm", up="Y")
        assert found.notes == [] and len(found.curves.data.curves) == 8
        assert np.abs(world(found.curves) - np.concatenate(lines)).max() <= 1e-5 * size, ending
        if ending in WIDTHS:
            scale = abs(np.linalg.det(np.array(found.curves.matrix_world)[:3, :3])) ** (1.0 / 3.0)
            radii = np.array([one.value for one in found.curves.data.attributes["radius"].data])
            np.testing.assert_allclose(2.0 * radii * scale * meters * 100.0, diameters, rtol=1e-6, err_msg=ending)
        bpy.data.objects.remove(found.curves)


def test_unit_and_axis_are_found_by_the_surface(scene, sphere, rng, tmp_path):
    """The unit and the axis that fit the surface are found; CT2Hair's millimeters and HairSalon's meters with Y up
    come first.

    Else unit and axis fit the surface.
    """
    sphere.location, sphere.scale = (0.1, 0.2, 1.6), (0.1, 0.1, 0.1)
    update()
    lines = [np.float32(line) for line in lines_on(sphere, rng, 8, 5, 5)]
    y_up = [np.float32(line[:, [0, 2, 1]] * [1.0, 1.0, -1.0]) for line in lines]
    for ending, in_file in (
        (".bin", [1000.0 * line for line in lines]),
        (".data", y_up),
        (".hair", [line / np.float32(0.0254) for line in lines]),
    ):
        path = tmp_path / f"strands{ending}"
        path.write_bytes(FORMATS[ending](in_file))
        found = api.import_curves(path, sphere)
        np.testing.assert_allclose(world(found.curves), np.concatenate(lines), atol=1e-6)
        assert "which puts roots on the surface" in str(found.notes[0])


@pytest.mark.parametrize("ending", OF_STRANDS)
def test_written_strands_come_back(hair, tmp_path, ending):
    """Points and widths are read back with the same bits; guides, IDs and weights as well, if the format has them."""
    bpy.data.objects["Sphere"].location = (1.0, 2.0, 3.0)
    update()
    path = tmp_path / f"groom{ending}"
    notes = api.export_groom(path, [hair])
    file = curve_files.read(path)
    meters, up = (file.stated.meters or 1.0), (file.stated.up or {".data": "Y"}.get(ending, "Z"))
    strands = [one for one in file.sets if not one.is_guide]
    (read,) = [one.placed(meters, up) for one in strands]
    np.testing.assert_array_equal(read.points, api.points(hair).reshape(-1, 3))
    assert any("strands alone" in note for note in notes) == (ending in (".hair", ".data"))
    if ending != ".data":
        radii = np.array([one.value for one in hair.data.attributes["radius"].data], np.float32)
        np.testing.assert_array_equal(read.radii, radii)
    if ending in (".ply", ".npz"):
        (guides,) = [one for one in file.sets if one.is_guide]
        np.testing.assert_array_equal(guides.points, api.points(bpy.data.objects["Guides"]).reshape(-1, 3))
        assert read.ids[0] == len(guides) and set(read.guide_ids.ravel()) <= set(guides.ids)
        np.testing.assert_allclose(read.guide_weights.sum(axis=1), 1.0, atol=1e-6)
        assert read.root_uvs.shape == (len(read), 2) and read.group_name == "Hair"
    select(bpy.data.objects["Sphere"])
    before = set(bpy.data.objects)
    assert bpy.ops.vellus.import_groom(filepath=str(path)) == {"FINISHED"}
    update()
    made = {one.data.vellus.kind: one for one in set(bpy.data.objects) - before}
    np.testing.assert_allclose(world(made["HAIR"]), read.points, atol=2e-6)
    assert ending not in (".ply", ".npz") or len(made["GUIDES"].data.curves) == len(guides)


@pytest.mark.parametrize("ending", [".usdc", ".abc"])
@pytest.mark.parametrize("place", ["uneven", "mirrored and uneven", "on a sheared rig"])
def test_exported_grooms_come_back_to_a_micrometer(scene, sphere, tmp_path, place, ending):
    """Hair and guides of an exported groom, imported onto the same surface, are off by less than a micrometer."""
    put(sphere, **PLACES["uneven"])
    if place == "mirrored and uneven":
        sphere.scale.x *= -1.0
    if place == "on a sheared rig":
        sphere.parent = bpy.data.objects.new("Rig", None)
        scene.collection.objects.link(sphere.parent)
        sphere.parent.scale, sphere.parent.rotation_euler = (1.0, 2.0, 0.5), (0.2, 0.1, 0.7)
        sphere.scale, sphere.rotation_euler = (1.0, 1.5, 0.7), (0.3, 0.5, 0.2)
    update()
    select(sphere)
    bpy.ops.vellus.add_hair(guide_count=20, strand_count=50, length=0.1)
    update()
    before = set(bpy.data.objects)
    wanted = {one.data.vellus.kind: world(one) for one in before if one.type == "CURVES"}
    api.export_groom(tmp_path / f"a{ending}")
    select(sphere)
    assert bpy.ops.vellus.import_groom(filepath=str(tmp_path / f"a{ending}")) == {"FINISHED"}
    update()
    made = {one.data.vellus.kind: world(one) for one in set(bpy.data.objects) - before}
    assert set(made) == set(wanted) == {"HAIR", "GUIDES"}
    for kind, points in wanted.items():
        np.testing.assert_allclose(made[kind], points, rtol=0.0, atol=1e-6)


def test_a_format_of_one_frame_refuses_animation(hair, tmp_path):
    with pytest.raises(HairError, match="one frame"):
        api.export_groom(tmp_path / "a.hair", [hair], animation="ALL")
    assert [*tmp_path.iterdir()] == []


def test_guides_alone_are_written_where_strands_are_left_out(hair, tmp_path):
    api.export_groom(tmp_path / "a.data", [hair], has_hair=False)
    (found,) = curve_files.read(tmp_path / "a.data").sets
    assert len(found) == len(bpy.data.objects["Guides"].data.curves)


def test_the_command_line_reads_and_writes_them(scene, sphere, rng, tmp_path):
    """The command line reads strand files by --hair-from, --guides-from and info, with unit and axis, and export
    writes them.
    """
    lines = [np.float32(line) for line in lines_on(sphere, rng, 8, 5, 5)]
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "sphere.blend"))
    (tmp_path / "a.bin").write_bytes(strand_files.bin_file([100.0 * line for line in lines]))
    for option in ("--hair-from", "--guides-from"):
        words = ("--unit", "cm", "--up", "Z", "--strands", 20, "--guides", 4, "--out", tmp_path / "out.blend")
        ended = run_here("groom", tmp_path / "sphere.blend", option, tmp_path / "a.bin", *words)
        assert ended.status == 0, ended
        ended = run_here("export", tmp_path / "out.blend", "--out", tmp_path / "out.ply")
        assert ended.status == 0, ended
        sets = {one.is_guide: one for one in curve_files.read(tmp_path / "out.ply").sets}
        is_hair = option == "--hair-from"
        np.testing.assert_allclose(
            sets[not is_hair].points[: 5 if is_hair else 1, :], lines[0][: 5 if is_hair else 1], atol=1e-5
        )
        assert len(sets[False]) == (8 if is_hair else 20)
    ended = run_here("info", tmp_path / "a.bin", "--json")
    assert (
        json.loads(ended.out.splitlines()[-1])["curves"][0] | {"name": "a", "curves": 8, "points": 40}
        == json.loads(ended.out.splitlines()[-1])["curves"][0]
    )


def test_every_ending_has_a_reader():
    """Every file name extension that options and file browsers show has a reader."""
    assert set(curve_file.ENDINGS) == set(curve_files._READERS)
    docs = Path(__file__).parents[3] / "docs" / "strand_files.md"
    for ending in (*FORMATS, *OF_STRANDS):
        assert ending in docs.read_text(encoding="utf-8")
