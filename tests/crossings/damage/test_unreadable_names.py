# SPDX-License-Identifier: GPL-3.0-or-later
"""Very long names, and names that are not UTF-8 in damaged files, which Python cannot read, are handled."""

import os
import subprocess
import sys
from pathlib import Path

import bpy
import pytest

from hair_addon import api
from tests.support.commands import PYTHONPATH
from tests.support.reading import points

ROOT = Path(__file__).resolve().parents[3]


@pytest.mark.farm
def test_hair_of_unreadable_names_is_drawn_edited_and_saved(tmp_path):
    """Hair with unreadable names is drawn, edited and saved, and its layers of guides can be renamed."""
    program = [sys.executable, "-m", "tests.support.walk.walk_unreadable_names", str(tmp_path)]
    details = {"cwd": ROOT, "env": os.environ | {"PYTHONPATH": PYTHONPATH}, "timeout": 600}
    done = subprocess.run(program, capture_output=True, text=True, errors="replace", **details)
    assert done.returncode == 0 and "all was used" in done.stdout, done.stderr[-3000:]
    assert "Traceback" not in done.stderr + done.stdout


def test_names_of_any_length_are_names(sphere):
    """Names of any length can be used, and Blender truncates them where they are too long."""
    sphere.vertex_groups["top"].name = sphere.name = "ä" * 300
    name = sphere.vertex_groups[0].name
    guides = api.distribute_guides(sphere, guide_count=10, density_group=name)
    assert points(next(o for o in bpy.data.objects if o.data == guides))[:, 0, 2].min() > -0.1
    with pytest.raises(api.HairError, match="no vertex group") as refused:
        api.distribute_guides(sphere, guide_count=10, density_group="x" * 300)
    assert "\n" not in str(refused.value)
