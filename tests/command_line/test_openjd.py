# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps of docs/farm for OpenJobDescription [OpenJobDescription23] work by its own command."""

import os
import re
import sys
from pathlib import Path

import pytest

from tests.support.farms import farm

pytestmark = pytest.mark.farm


def test_the_template_bakes_and_renders(lit, tmp_path):
    shot = farm.save_shot(tmp_path / "shot.blend")
    programs = [farm.write_blender(tmp_path).parent, Path(sys.executable).parent]
    path = ":".join([*map(str, programs), os.environ["PATH"]])
    replaced = {"vellus-render.yaml": farm.DOCS / "vellus-render.yaml", "/farm/shot.blend": shot, "1-240": "1-4,6"}
    steps = farm.documented("OpenJobDescription", replaced | {"/farm/frames": tmp_path / "frames"})
    told = farm.shell(steps, tmp_path, PATH=path)
    assert re.findall(r"Frame\(CHUNK\[INT\]\) = (\S+)", told) == ["1-4", "6-6"]
    assert farm.frames_told(told) == [1, 2, 3, 4, 6]
    assert told.index(f"Guides: frame {farm.COUNT}") < told.index("Frame 1 in")
    farm.require_whole(tmp_path / "frames", [farm.FRAMES[number - 1] for number in (1, 2, 3, 4, 6)])
