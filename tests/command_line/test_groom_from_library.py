# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line puts a saved groom on a mesh of a file."""

import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data import scene as scene_data
from tests.support.commands import load, run_here, write_obj


@pytest.fixture
def groom(guides, tmp_path):
    """Return (the file of a saved groom of 60 guides and 80 strands, an .obj of its surface twice as large, the
    guides).
    """
    hair = api.interpolate_hair(guides, strand_count=80)
    picture = np.ones((8, 8, 4), np.float32)
    path = api.save_groom(hair, tmp_path, name="Bob", catalog="", picture=picture)
    mesh = scene_data.read_surface(guides.data.surface, scene_data.present_depsgraph()).mesh
    return path, write_obj(tmp_path / "mesh.obj", 2.0 * mesh.vertices, mesh.triangles), api.points(guides)


def test_a_saved_groom_is_put_on_a_mesh(groom, tmp_path):
    path, mesh, points = groom
    for number, place in enumerate((path, f"{path}:Bob")):
        out = tmp_path / f"{number}.npz"
        ended = run_here("groom", mesh, "--from-library", place, "--strands", 90, "--out", out)
        assert (ended.status, ended.errors) == (0, "")
        np.testing.assert_allclose(load(out)["guide_points"], 2.0 * points, atol=1e-4)
        assert load(out)["strand_points"].shape == (90, 41, 3)


def test_what_cannot_be_is_refused_in_one_sentence(groom, tmp_path):
    path, mesh, _points = groom
    for options in (
        ("--from-library", f"{path}:Alice"),
        ("--from-library", tmp_path / "missing.blend"),
        ("--from-library", mesh),
        ("--from-library", path, "--guides-from", path),
    ):
        ended = run_here("groom", mesh, *options, "--out", tmp_path / "out.npz")
        assert ended.status == 1 and ended.errors.count("\n") == 1
        assert not (tmp_path / "out.npz").exists()
