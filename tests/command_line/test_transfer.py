# SPDX-License-Identifier: GPL-3.0-or-later
"""`transfer` and `groom --hair-from` put hair on another mesh; errors are one message."""

import bpy
import numpy as np
import pytest

from tests.support.commands import run_here
from tests.support.exchange.imported import curves_object, lines_on


@pytest.fixture
def shot(hair, tmp_path):
    """Return a .blend with hair on a sphere, and a bare sphere twice as large."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=2.0)
    bpy.context.object.name = "Other"
    path = tmp_path / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def test_a_groom_goes_to_another_mesh_of_the_file(shot):
    ended = run_here("transfer", shot, "--to", "Other", "--out", "//moved.npz", "--json")
    (told,) = ended.results
    assert (told["surface"], told["lost"], told["scale"]) == ("Other", 0, pytest.approx(2.0, rel=0.02))
    with np.load(shot.parent / "moved.npz") as arrays:
        assert len(arrays["guide_points"]) == told["guides"] and len(arrays["strand_points"]) == told["strands"]
        assert np.linalg.norm(arrays["guide_points"][:, 0], axis=1) == pytest.approx(2.0, rel=0.03)


@pytest.mark.parametrize(
    ("words", "reported"),
    [
        (["--to", "Nobody"], "Nobody"),
        (["--to", "Sphere"], "another mesh"),
        (["--to", "Other", "--hair", "Nobody"], 'has no hair "Nobody"'),
        (["--to", "Other", "--method", "LANDMARKS"], "no landmarks"),
    ],
)
def test_what_is_wrong_is_one_sentence(shot, words, reported):
    ended = run_here("transfer", shot, "--out", "//moved.blend", *words)
    assert ended.status == 1 and reported in ended.errors and len(ended.errors.splitlines()) == 1
    assert not (shot.parent / "moved.blend").exists()


def test_hair_of_a_file_is_kept_and_guides_are_derived(sphere, rng, tmp_path):
    lines = list(lines_on(sphere, rng, 80, least=7, most=7))
    curves_object(lines, "Strands")
    path = tmp_path / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    ended = run_here("groom", path, "--hair-from", path, "--guides", "9", "--out", "//kept.npz")
    assert (ended.status, "9 guides, 80 strands" in ended.out) == (0, True)
    assert "The guides reproduce the strands to" in ended.errors
    with np.load(tmp_path / "kept.npz") as arrays:
        np.testing.assert_allclose(arrays["strand_points"], np.stack(lines), atol=1e-6)
    useless = ("--strands", 50, "--seed", 3, "--style", "clump", "--dynamics", "hold=7")
    ended = run_here("groom", path, "--hair-from", path, "--out", "//kept.blend", *useless)
    assert "--seed, --strands, --style have no effect" in ended.errors and "--dynamics" not in ended.errors
    guides = next(curves for curves in bpy.data.hair_curves if curves.vellus.kind == "GUIDES")
    assert guides.vellus.dynamics.hold == 7.0
    ended = run_here("groom", path, "--hair-from", path, "--guides-from", path, "--out", "//kept.npz")
    assert ended.status == 1 and "exclude each other" in ended.errors
