# SPDX-License-Identifier: GPL-3.0-or-later
"""Invalid files and unwritable folders: one message, status 1, no loss of data."""

import json
import os
import shutil
import subprocess
from functools import partial
from pathlib import Path

import bpy
import numpy as np
import pytest

from tests.support.commands import HEAD, PYTHONPATH, TETRAHEDRON, command, largest_file, run_here, write_obj
from tests.support.pairs import pairs, share_of

# A warning of Blender's FBX exporter.
pytestmark = pytest.mark.filterwarnings("ignore:Setting the shape:DeprecationWarning")

SMALL = ("--guides", 5, "--strands", 20)


def _vrm(filepath):
    """Write a binary glTF file with the ending of VRM, which the exporter would replace."""
    partial_path = Path(filepath).with_suffix(".glb")
    bpy.ops.export_scene.gltf(filepath=str(partial_path))
    partial_path.replace(filepath)


@pytest.fixture
def mesh(scene, tmp_path):
    """Return a function that writes the tetrahedron in a file of any kind, as one object or several."""

    def make(name, count=1):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        for number in range(count):
            data = bpy.data.meshes.new("Tetrahedron")
            data.from_pydata(TETRAHEDRON[0].tolist(), [], TETRAHEDRON[1].tolist())
            bpy.context.scene.collection.objects.link(bpy.data.objects.new(f"Part{number}", data))
        path = tmp_path / name
        write = {
            ".blend": partial(bpy.ops.wm.save_as_mainfile, compress=False),
            ".obj": bpy.ops.wm.obj_export,
            ".ply": bpy.ops.wm.ply_export,
            ".stl": bpy.ops.wm.stl_export,
            ".glb": bpy.ops.export_scene.gltf,
            ".vrm": _vrm,
            ".fbx": bpy.ops.export_scene.fbx,
            ".gltf": partial(bpy.ops.export_scene.gltf, export_format="GLTF_SEPARATE"),
            ".usdc": bpy.ops.wm.usd_export,
            ".usda": bpy.ops.wm.usd_export,
            ".usdz": bpy.ops.wm.usd_export,
            ".abc": partial(bpy.ops.wm.alembic_export, as_background_job=False),
        }[path.suffix]
        write(filepath=str(path))
        return path

    return make


def refuse(path, reported, *options, verb="groom"):
    """Check that a command refuses a file in one sentence and leaves nothing behind."""
    folder = path.parent
    before = {p: p.read_bytes() for p in folder.iterdir() if p.is_file()}
    words = (verb, path, *SMALL, "--out", folder / "out.npz") if verb == "groom" else (verb, path)
    ended = run_here(*words, *options)
    assert (ended.status, ended.out) == (1, "")
    assert reported in ended.errors and len(ended.errors.splitlines()) == 1, ended.errors
    assert any(named in ended.errors for named in (str(path), "mesh", "The surface"))
    assert {p: p.read_bytes() for p in folder.iterdir() if p.is_file()} == before


@pytest.mark.parametrize("verb", ["groom", "info"])
def test_missing_and_unsupported_files_are_refused(tmp_path, verb):
    refuse(tmp_path / "missing.blend", "does not exist", verb=verb)
    (tmp_path / "folder.obj").mkdir()
    refuse(tmp_path / "folder.obj", "is a folder", verb=verb)
    (tmp_path / "a.txt").write_text("hair")
    refuse(tmp_path / "a.txt", "a format that Vellus cannot read", verb=verb)
    (tmp_path / "none").touch()
    refuse(tmp_path / "none", "a format that Vellus cannot read", verb=verb)


ENDINGS = [".blend", ".obj", ".ply", ".stl", ".glb", ".gltf", ".vrm", ".fbx", ".usdc", ".usda", ".usdz", ".abc"]


@pytest.mark.parametrize("ending", share_of(ENDINGS, 2))
def test_a_whole_file_is_read(mesh, ending):
    """Undamaged files are read, so that the refusals of damaged files prove something."""
    path = mesh(f"whole{ending}")
    assert run_here("groom", path, *SMALL, "--out", path.parent / "out.npz").status == 0


@pytest.mark.parametrize(("ending", "part"), pairs(ENDINGS, [0.0, 0.3, 0.9], 2))
def test_truncated_files_are_refused(mesh, ending, part):
    path = mesh(f"short{ending}")
    content = path.read_bytes()
    if ending in (".obj", ".gltf") and part == 0.9:
        part = len(content.rstrip().rsplit(maxsplit=1)[0]) / len(content)  # before its last word
    path.write_bytes(content[: int(part * len(content))])
    refuse(path, "")


@pytest.mark.parametrize("ending", ENDINGS)
def test_files_of_another_format_are_refused(tmp_path, ending, rng):
    path = tmp_path / f"noise{ending}"
    path.write_bytes(rng.bytes(3000))
    refuse(path, "no mesh" if ending == ".obj" else str(path))


@pytest.mark.parametrize(
    ("change", "reported"),
    [
        ({"accessors": []}, "IndexError: list index out of range"),  # an error of the importer
        ({"buffers": [{"uri": "gone.bin", "byteLength": 36}]}, "gone.bin"),
    ],
)
def test_a_gltf_with_parts_missing(mesh, capsys, change, reported):
    path = mesh("parts.gltf")
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    capsys.readouterr()
    refuse(path, reported)
    assert capsys.readouterr().err == ""  # no traceback, no message of the importer's own


@pytest.mark.parametrize("version", [b"v0503", b"v0600", b"v9900"])
@pytest.mark.parametrize("verb", ["groom", "info"])
def test_a_blend_of_a_newer_blender(mesh, version, verb):
    path = mesh("newer.blend")
    content = path.read_bytes()
    assert content.startswith(b"BLENDER17-01v0502")
    path.write_bytes(content.replace(b"v0502", version, 1))
    refuse(path, "was saved by Blender", verb=verb)


def test_a_blend_of_a_format_to_come(mesh):
    path = mesh("newer.blend")
    path.write_bytes(path.read_bytes().replace(b"BLENDER17-01v0502", b"BLENDER21-02v0700", 1))
    refuse(path, "cannot be read")


def test_several_meshes_need_a_name(mesh):
    path = mesh("several.blend", count=3)
    refuse(path, "3 meshes (Part0, Part1, Part2): choose one with --surface")
    refuse(path, 'no mesh object "Part9"', "--surface", "Part9")
    assert run_here("groom", path, *SMALL, "--surface", "Part1", "--out", path.parent / "o.npz").status == 0


def test_a_mesh_without_faces(tmp_path):
    write_obj(tmp_path / "points.obj", *TETRAHEDRON)
    text = (tmp_path / "points.obj").read_text()
    (tmp_path / "points.obj").write_text(text[: text.index("f ")])
    refuse(tmp_path / "points.obj", "no faces")


def test_no_mesh_at_all(mesh):
    refuse(mesh("none.blend", count=0), "no mesh to grow hair on")


def test_pictures_are_made_of_a_blend(tmp_path):
    write_obj(tmp_path / "a.obj", *TETRAHEDRON)
    ended = run_here("render", tmp_path / "a.obj", "--out", tmp_path / "a.png")
    assert ended.status == 1 and "is not a .blend" in ended.errors


@pytest.mark.parametrize(
    "content", [b"", b"noise", b"PK\x03\x04cut short"], ids=["empty", "something else", "cut short"]
)
@pytest.mark.parametrize("name", ["a.npz", "a.json", "n.exr", "dual.exr"])
def test_damaged_files_of_vellus_are_refused(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    refuse(tmp_path / name, name, verb="info")


def test_an_array_is_told_of_without_being_read(tmp_path):
    """An array whose header claims an excessive size is reported without being read."""
    np.savez(tmp_path / "a.npz", roots=np.zeros((7, 3), np.float32))
    ended = run_here("info", tmp_path / "a.npz", "--json")
    assert ended.results[0]["arrays"] == {"roots": {"shape": [7, 3], "type": "float32", "bytes": 84}}


# ------------------------------------------------------------------------------------------- where files are to go


OUTPUTS = {
    **{ending: ("groom", "HEAD", "--guides", 20, "--strands", 500, "--out", f"out{ending}") for ending in ENDINGS[:1]},
    **{
        ending: ("groom", "HEAD", "--guides", 20, "--strands", 500, "--out", f"out{ending}")
        for ending in (".npz", ".usdc", ".usda", ".usdz", ".abc")
    },
    ".png": ("render", "SHOT", "--width", 200, "--height", 150, "--out", "out.png"),
    ".exr": ("render", "SHOT", "--width", 200, "--height", 150, "--out", "out.exr"),
    "Cycles": ("render", "SHOT", "--width", 200, "--height", 150, "--engine", "cycles", "--out", "out.png"),
    "tables": ("bake-tables", "--size", 64, "--out", "out"),
    ".json": ("settings", "--out", "out.json"),
}
LIMITS = {".json": 500, ".png": 8_000, "Cycles": 8_000, "tables": 4_000}


@pytest.fixture
def words(lit, tmp_path_factory):
    """Return a function that gives the arguments of a command with an output of each kind."""
    shot = tmp_path_factory.mktemp("shot") / "shot.blend"
    bpy.context.scene.cycles.samples = 1
    bpy.ops.wm.save_as_mainfile(filepath=str(shot))
    return lambda kind: [{"HEAD": HEAD, "SHOT": shot}.get(word, word) for word in OUTPUTS[kind]]


def refused(ended, folder):
    assert ended.status == 1 and ended.out == "", ended.errors
    assert len(ended.errors.splitlines()) == 1 and ended.errors.startswith("vellus: "), ended.errors
    left = [path for path in folder.rglob("*") if path.is_file()]
    assert {path: path.read_bytes() for path in left} in ({}, {folder / "keep": b"kept"})


SLOW = pytest.mark.long  # of formats that go the way of another one


@pytest.mark.parametrize(
    "kind",
    [
        pytest.param(kind, marks=SLOW if kind in {".usda", ".usdz", ".npz", ".png", "Cycles"} else ())
        for kind in OUTPUTS
    ],
)
def test_a_full_disk_leaves_nothing_half_written(words, tmp_path, monkeypatch, kind):
    """A full disk leaves no incomplete file; a limit on the size of files, which also ends writing halfway, stands
    in for it.
    """
    monkeypatch.chdir(tmp_path)
    options = words(kind)
    with largest_file(LIMITS.get(kind, 60_000)):
        ended = run_here(*options)
    refused(ended, tmp_path)
    assert any(words in ended.errors for words in ("File too large", "cannot be written", "disk may be full"))


IS_ROOT = os.name == "posix" and os.geteuid() == 0
CAN_MOUNT = (
    IS_ROOT
    and shutil.which("unshare") is not None
    and subprocess.run(["unshare", "--mount", "true"], capture_output=True).returncode == 0
)
needs_mounts = pytest.mark.skipif(not CAN_MOUNT, reason="only root may mount")


def run_mounted(mounting, words, folder):
    """Run a command in a mount namespace of its own."""
    script = f'{mounting}; cd "$0"; "$@"; status=$?; ls -A "$0" > "$0.left"; exit $status'
    environment = os.environ | {"PYTHONPATH": PYTHONPATH}
    words = ["unshare", "--mount", "sh", "-c", script, str(folder), *command(*words)]
    done = subprocess.run(words, capture_output=True, text=True, env=environment, timeout=1200)
    return done, folder.with_name(folder.name + ".left").read_text().split()


@pytest.mark.farm
@needs_mounts
@pytest.mark.parametrize(
    "kind",
    [".npz", *(pytest.param(kind, marks=SLOW) for kind in (".blend", ".usdc", ".abc", ".png", "tables"))],
)
def test_a_disk_that_is_really_full(words, tmp_path, kind):
    folder = tmp_path / "disk"
    folder.mkdir()
    size = LIMITS.get(kind, 60_000) // 4096 * 4096 or 4096
    done, left = run_mounted(f'mount -t tmpfs -o size={size} tmpfs "$0"', words(kind), folder)
    assert (done.returncode, done.stdout, len(done.stderr.splitlines())) == (1, "", 1), done.stderr
    assert left in ([], ["out"])  # the folder of tables


@pytest.mark.farm
@needs_mounts
@pytest.mark.parametrize("kind", [".exr", ".json", *(pytest.param(kind, marks=SLOW) for kind in (".npz", "tables"))])
def test_a_read_only_folder_is_reported(words, tmp_path, kind):
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "keep").write_bytes(b"kept")
    mounting = 'mount --bind "$0" "$0" && mount -o remount,ro,bind "$0"'
    done, left = run_mounted(mounting, words(kind), folder)
    assert (done.returncode, done.stdout, len(done.stderr.splitlines())) == (1, "", 1), done.stderr
    assert "Read-only file system" in done.stderr
    assert left == ["keep"]


@pytest.mark.parametrize("kind", OUTPUTS)
def test_a_file_where_a_folder_should_be(words, tmp_path, kind):
    (tmp_path / "keep").write_bytes(b"kept")
    options = words(kind)
    options[-1] = tmp_path / "keep" / options[-1]
    refused(run_here(*options), tmp_path)


@pytest.mark.parametrize("kind", [kind for kind in OUTPUTS if kind != "tables"])
def test_a_folder_where_a_file_should_be(words, tmp_path, kind):
    options = words(kind)
    (tmp_path / options[-1]).mkdir()
    options[-1] = tmp_path / options[-1]
    refused(run_here(*options), tmp_path)
