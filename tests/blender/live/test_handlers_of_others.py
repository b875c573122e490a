# SPDX-License-Identifier: GPL-3.0-or-later
"""Handlers stay correct when other add-ons delete hair while Blender reports it as changed."""

import os
import subprocess
import sys
from pathlib import Path

import bpy
import pytest

from hair_addon.blender.live import updates
from tests.support.commands import PYTHONPATH

ROOT = Path(__file__).resolve().parents[3]


@pytest.mark.farm
def test_hair_that_another_handler_deletes_does_not_end_blender():
    program = [sys.executable, "-m", "tests.support.walk.walk_handlers_of_others"]
    environment = os.environ | {"PYTHONPATH": PYTHONPATH}
    done = subprocess.run(program, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0 and "all went on" in done.stdout, done.stderr[-3000:]
    assert "Traceback" not in done.stderr + done.stdout


def test_reports_are_the_same_whether_others_run_first(hair):
    """Reports are the same before and after other handlers: existing data, and parts of other datablocks by their
    type.
    """
    found = {}

    def listen(_scene, depsgraph):
        found["first"] = updates.read(depsgraph, [listen], listen)
        found["later"] = updates.read(depsgraph, [None, listen], listen)

    surface = hair.data.surface
    surface.data.materials.append(bpy.data.materials.new("Skin"))
    bpy.app.handlers.depsgraph_update_post.append(listen)
    try:
        for changed in (surface, surface.data, hair.data, surface.data.materials[0].node_tree):
            changed.update_tag()
        bpy.context.view_layer.update()
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(listen)
    first, later = found["first"], found["later"]
    assert [one.kind for one in first] == [one.kind for one in later]
    assert {surface, surface.data, hair.data} <= {one.datablock for one in later}
    for one, other in zip(first, later, strict=True):
        assert other == one or (other.datablock is None and one.is_of(bpy.types.NodeTree)), (one, other)
