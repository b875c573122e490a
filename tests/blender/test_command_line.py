# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: files in, files out, one sentence and a status when it cannot."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hair_addon.core import exr
from hair_addon.core.shading import lookup_tables

ROOT = Path(__file__).resolve().parents[2]
HEAD = ROOT / "blend_samples" / "head.obj"


def run(*arguments):
    """(exit status, standard error) of python -m hair_addon."""
    command = [sys.executable, "-m", "hair_addon", *map(str, arguments)]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    return ended.returncode, ended.stderr


def sentences(stderr):
    """Our lines of standard error, without what graphics drivers say."""
    return [line for line in stderr.splitlines() if line.startswith("hair_addon:")]


def test_a_head_is_groomed_into_arrays(tmp_path):
    out = tmp_path / "head.npz"
    status, stderr = run("groom", HEAD, "--guides", 50, "--strands", 400, "--seed", 3, "--out", out)
    assert status == 0, stderr
    arrays = np.load(out)
    assert arrays["guide_points"].shape == (50, 41, 3)
    assert arrays["strand_points"].shape == (400, 41, 3)
    np.testing.assert_array_equal(arrays["roots"], arrays["strand_points"][:, 0])
    vertices = np.array([line.split()[1:4] for line in HEAD.read_text().splitlines() if line.startswith("v ")], float)
    # The file's own axes: roots lie in the mesh's own box.
    assert (arrays["roots"] >= vertices.min(axis=0) - 1e-4).all()
    assert (arrays["roots"] <= vertices.max(axis=0) + 1e-4).all()


def test_a_groom_is_saved_and_drawn(tmp_path):
    blend, picture = tmp_path / "head.blend", tmp_path / "head.png"
    assert run("groom", HEAD, "--guides", 20, "--strands", 100, "--out", blend)[0] == 0
    status, stderr = run("render", blend, "--out", picture, "--width", 32, "--height", 32)
    assert status == 1 and "no camera" in "".join(sentences(stderr))
    assert not picture.exists()


def test_tables_are_baked(tmp_path):
    assert (
        run("bake-tables", "--out", tmp_path / "t", "--size", 32, "--sigma-a", 0.1, 0.2, 0.3, "--axes", "COSINES")[0]
        == 0
    )
    settings = exr.read_tables(tmp_path / "t").settings
    assert settings == lookup_tables.Settings(size=32, sigma_a=(0.1, 0.2, 0.3), axes="COSINES")


def test_tables_of_the_energy_conserving_mode_are_baked_and_plotted(tmp_path):
    bake = ("bake-tables", "--mode", "energy", "--roughness", 0.2, "--ior", 1.5, "--size", 32, "--plot")
    assert run(*bake, "--out", tmp_path / "t")[0] == 0
    expected = lookup_tables.Settings(mode="energy", roughness=0.2, eta=1.5, size=32)
    assert exr.read_tables(tmp_path / "t").settings == exr.read_dual_tables(tmp_path / "t").settings == expected
    tables, pictures = ({path.stem for path in (tmp_path / "t").glob(f"*.{ending}")} for ending in ("exr", "png"))
    assert tables == pictures == {"m", "n", "n_trt", "n_res", "dual", "n_g", "n_g_trt"}


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["groom", "missing.obj", "--out", "x.npz"], "missing.obj is not there"),
        (["groom", HEAD, "--out", "x.abc"], ".blend or .npz"),
        (["groom", "pyproject.toml", "--out", "x.npz"], "kind that Vellus does not read"),
        (["groom", HEAD, "--guides", 0, "--out", "x.npz"], "Guides must be"),
        (["groom", HEAD, "--strands", -3, "--out", "x.npz"], "Strands must be"),
        (["groom", HEAD, "--influence-distance", "nan", "--out", "x.npz"], "Influence distance must be"),
        (["groom", HEAD, "--influence-distance", 0, "--out", "x.npz"], "Influence distance must be"),
        (["groom", HEAD, "--influence-distance", -1, "--out", "x.npz"], "Influence distance must be"),
        (["groom", HEAD, "--density-group", "scalp", "--out", "x.npz"], 'no vertex group "scalp"'),
        (["bake-tables", "--out", "pyproject.toml/tables"], "pyproject.toml"),
        (["bake-tables", "--ior", 0.9, "--out", "x"], "IOR must be"),
        (["bake-tables", "--sigma-a", -1, 0, 0, "--out", "x"], "Absorption must be"),
        (["bake-tables", "--mode", "energy", "--roughness", 1.5, "--out", "x"], "Roughness must be"),
        (["render", "missing.blend", "--out", "x.png"], "missing.blend is not there"),
    ],
)
def test_what_cannot_be_done_is_one_sentence_and_status_1(arguments, said):
    status, stderr = run(*arguments)
    assert status == 1
    assert len(sentences(stderr)) == 1 and said in sentences(stderr)[0]
    assert "Traceback" not in stderr
    assert not any((ROOT / name).exists() for name in ("x.npz", "x.abc", "x.png", "x"))


@pytest.mark.parametrize(
    "arguments", [[], ["groom"], ["comb"], ["groom", "a.obj", "--out", "b.npz", "--guides", "many"]]
)
def test_what_is_not_understood_is_status_2(arguments):
    assert run(*arguments)[0] == 2
