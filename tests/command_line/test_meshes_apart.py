# SPDX-License-Identifier: GPL-3.0-or-later
"""A separate process imports meshes with the same resulting scene, and a crash of it is one message."""

import signal
import sys

import bpy
import numpy as np
import pytest

from hair_addon.blender.host import cli_command
from hair_addon.blender.io import mesh_checks, mesh_files
from hair_addon.command_line import import_mesh
from hair_addon.core.errors import HairError
from tests.support.commands import HEAD, run_here

GROOM = ("--guides", 5, "--strands", 20, "--out")


@pytest.fixture
def files(scene, tmp_path):
    """Return paths of a moved and painted sphere, in a file of each kind."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=0.1, location=(0.3, 0.2, 0.1), rotation=(0.4, 0, 0))
    sphere = bpy.context.object
    sphere.name = "Scalp"
    sphere.data.materials.append(bpy.data.materials.new("Skin"))
    bpy.ops.wm.usd_export(filepath=str(tmp_path / "a.usdc"))
    bpy.ops.wm.ply_export(filepath=str(tmp_path / "a.ply"), up_axis="Y", forward_axis="NEGATIVE_Z")
    bpy.ops.wm.alembic_export(filepath=str(tmp_path / "a.abc"), as_background_job=False)
    bpy.ops.export_scene.gltf(filepath=str(tmp_path / "a.gltf"), export_format="GLTF_SEPARATE")
    return {ending: tmp_path / f"a{ending}" for ending in (".usdc", ".ply", ".abc", ".gltf")}


def seen():
    """Return the state of the open file that must not change."""
    bpy.context.view_layer.update()
    meshes = {}
    for one in (o for o in bpy.context.view_layer.objects if o.type == "MESH"):
        places = np.array([one.matrix_world @ vertex.co for vertex in one.data.vertices])
        uvs = np.array([loop.uv[:] for layer in one.data.uv_layers for loop in layer.data])
        faces = [face.vertices[:] for face in one.data.polygons]
        meshes[one.name] = (places.tobytes(), uvs.tobytes(), faces, [slot.name for slot in one.material_slots])
    return meshes, bpy.data.filepath, bpy.context.scene.unit_settings.scale_length


# All are handled alike, .abc too.
@pytest.mark.farm
@pytest.mark.parametrize("ending", [".usdc", ".ply", pytest.param(".gltf", marks=pytest.mark.long)])
def test_another_process_gives_the_same_scene(files, tmp_path, ending):
    up = "Y" if ending == ".ply" else "Z"
    file_axes = mesh_files.open_file(files[ending], up=up)
    expected = seen()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    ended = run_here(
        "groom", files[ending], *GROOM, tmp_path / "out.npz", *(["--up", up] if up == "Y" else []), reads_apart=True
    )
    assert (ended.status, ended.errors) == (0, "")
    meshes, path, scale = seen()
    assert expected == ({name: of for name, of in meshes.items() if name in expected[0]}, path, scale)
    with np.load(tmp_path / "out.npz") as arrays:
        roots = arrays["roots"] @ file_axes  # back to Blender's axes
    assert abs(np.linalg.norm(roots - [0.3, 0.2, 0.1], axis=1) - 0.1).max() < 0.01


@pytest.mark.parametrize("verb", ["groom", "info"])
@pytest.mark.parametrize("ending", [".usdc", ".ply", ".abc"])
def test_an_importer_that_ends_its_process_is_one_sentence(files, tmp_path, monkeypatch, verb, ending):
    script = f"import os; os.kill(os.getpid(), {int(signal.SIGSEGV)})"
    monkeypatch.setattr(cli_command, "words", lambda: [sys.executable, "-c", script])
    before = set(tmp_path.iterdir())
    ended = run_here(
        verb, files[ending], *([*GROOM, tmp_path / "out.npz"] if verb == "groom" else []), reads_apart=True
    )
    assert (ended.status, ended.out) == (1, "") and set(tmp_path.iterdir()) == before
    assert ended.errors == (
        f"vellus: {files[ending]} cannot be read: its importer crashed (signal 11), so the file may be damaged.\n"
    )


def test_curves_are_tried_apart(files, tmp_path, monkeypatch):
    """Curves are first read in a separate process, as a damaged file may keep USD's reader busy forever."""
    script = "import time; time.sleep(600)"
    monkeypatch.setattr(cli_command, "words", lambda: [sys.executable, "-c", script])
    monkeypatch.setattr(import_mesh, "_PATIENCE", 0.2)
    ended = run_here("groom", HEAD, "--guides-from", files[".usdc"], "--out", tmp_path / "out.npz", reads_apart=True)
    assert (ended.status, ended.out) == (1, "")
    assert ended.errors == (
        f"vellus: {files['.usdc']} cannot be read: reading takes too long, so the file may be damaged.\n"
    )


@pytest.mark.farm
def test_messages_of_the_other_process_are_reported(files):
    files[".usdc"].write_bytes(files[".usdc"].read_bytes()[:200])
    ended = run_here("info", files[".usdc"], reads_apart=True)
    assert (ended.status, ended.out) == (1, "")
    assert ended.errors == f"vellus: {files['.usdc']} is not a valid USD file: it is damaged, or has another format.\n"


def test_faces_of_vertices_that_are_not_there_are_refused(scene):
    """Faces with missing vertices, which importers create from some damaged files, are refused."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
    mesh_checks.require_imported("a.abc")
    for corner, vertex in ((3, 42), (5, -1)):
        loop = bpy.context.object.data.loops[corner]
        before, loop.vertex_index = loop.vertex_index, vertex
        with pytest.raises(HairError, match=r"a\.abc is damaged: the faces of its mesh Icosphere do not match"):
            mesh_checks.require_imported("a.abc")
        loop.vertex_index = before
    mesh_checks.require_imported("a.abc")
