# SPDX-License-Identifier: GPL-3.0-or-later
"""`pip install .` gives scripts without Blender a wheel of the part that works on arrays."""

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from hair_addon.api.blender_access import ARRAYS_ONLY

ROOT = Path(__file__).resolve().parents[1]

SCRIPT = """
import sys
sys.modules["bpy"] = None
import numpy as np
from hair_addon import api
assert "wheel" in api.__file__
vertices = np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0]], np.float32)
triangles = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
guides = api.distribute_guides((vertices, triangles), guide_count=20, length=0.03)
styles = [api.Curl(radius=0.002, pitch=0.008)]
hair = api.interpolate_hair(guides, mesh=(vertices, triangles), strand_count=500, styles=styles)
points = api.points(hair)
np.testing.assert_allclose(points[:, 0, 2], 0.0, atol=1e-7)  # roots are on the square
lengths = np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1)
np.testing.assert_allclose(lengths, 0.03, rtol=0.2)  # guides vary by a tenth or so
try:
    api.add_hair(None)
except api.HairError as error:
    print(error)
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(folder)]
    done = subprocess.run(build, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return next(folder.glob("vellus-*.whl"))


def test_a_wheel_holds_the_half_for_arrays_and_its_types(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    assert {"hair_addon/py.typed", "hair_addon/api/__init__.py", "hair_addon/core/styling/bend.py"} <= names
    assert not [name for name in names if name.startswith(("hair_addon/blender/", "tests/", "shaders/"))]
    sources = {path.relative_to(ROOT).as_posix() for path in (ROOT / "hair_addon" / "core").rglob("*.*")}
    assert {source for source in sources if "__pycache__" not in source} <= names


@pytest.mark.farm
def test_scripts_work_on_arrays_without_blender(wheel, tmp_path):
    zipfile.ZipFile(wheel).extractall(tmp_path / "wheel")
    run = [sys.executable, "-c", SCRIPT]
    done = subprocess.run(
        run, cwd=tmp_path, env={"PYTHONPATH": str(tmp_path / "wheel")}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == ARRAYS_ONLY
