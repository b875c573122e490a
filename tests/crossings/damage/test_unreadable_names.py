# SPDX-License-Identifier: GPL-3.0-or-later
"""Names that are not UTF-8, as in damaged .blend files, which Python cannot read, and very long names."""

import os
import subprocess
import sys
from pathlib import Path

import bpy
import pytest

from hair_addon import api
from tests.support.reading import points

ROOT = Path(__file__).resolve().parents[3]


def test_hair_of_unreadable_names_is_drawn_edited_and_saved(tmp_path):
    program = [sys.executable, "-m", "tests.support.walk.walk_unreadable_names", str(tmp_path)]
    done = subprocess.run(program, cwd=ROOT, capture_output=True, text=True, errors="replace", timeout=120)
    assert done.returncode == 0 and "all was used" in done.stdout, done.stderr[-3000:]
    assert "Traceback" not in done.stderr + done.stdout


LAYERS = """
import sys
import bpy
from hair_addon import api
from tests.support.walk.walk_unreadable_names import Path, damage
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
guides = api.distribute_guides(bpy.context.object, guide_count=10)
api.add_layer(guides, "QQQQ")
damage(Path("layers.blend"))
bpy.ops.wm.open_mainfile(filepath="layers.blend")
guides = bpy.data.hair_curves[0]
(name,) = api.layers(guides)
assert name
guides.vellus.layers[0].name = "Fringe"
assert list(api.layers(guides)) == ["Fringe"]
print("renamed")
"""


def test_a_layer_with_an_unreadable_name_can_be_renamed(tmp_path):
    """Blender would crash if the name were not made readable when the file is opened."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    run = {"cwd": tmp_path, "env": environment, "capture_output": True, "text": True, "errors": "replace"}
    done = subprocess.run([sys.executable, "-c", LAYERS], timeout=120, **run)
    assert done.returncode == 0 and "renamed" in done.stdout, done.stderr[-3000:]


def test_names_of_any_length_are_names(sphere):
    """Blender cuts them where they are too long."""
    sphere.vertex_groups["top"].name = sphere.name = "ä" * 300
    name = sphere.vertex_groups[0].name
    guides = api.distribute_guides(sphere, guide_count=10, density_group=name)
    assert points(next(o for o in bpy.data.objects if o.data == guides))[:, 0, 2].min() > -0.1
    with pytest.raises(api.HairError, match="no vertex group") as refused:
        api.distribute_guides(sphere, guide_count=10, density_group="x" * 300)
    assert "\n" not in str(refused.value)
