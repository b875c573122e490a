# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair on a surface that bends in a window: Blender does not carry what Vellus draws until the surface rests."""

import json
import re
import shutil
from pathlib import Path

import pytest

from tools import build_extension, desktop_blender

pytestmark = pytest.mark.desktop

SCRIPT = Path(__file__).with_name("bending.py")

# Of the pixels with hair: rounding flips single samples at the edges of strands.
FLIPPED = 0.002

SIZE = (640, 400)  # of the window [pixels]: software drivers take their time for each


@pytest.fixture(scope="module", params=desktop_blender.BACKENDS)
def bending(request, desktop, extension, new_profile):
    """(facts, log) with one backend; its pictures are in out/desktop."""
    folder = build_extension.ROOT / "out" / "desktop" / f"bending_{request.param}"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    log = folder / "bending.log"
    profile = new_profile()
    desktop.run(SCRIPT, [extension, folder], backend=request.param, profile=profile, log=log, limit=300, size=SIZE)
    text = log.read_text(errors="replace")
    facts = folder / "bending.json"
    assert facts.exists(), text[-4000:]
    return json.loads(facts.read_text()), text


def test_it_comes_to_its_end(bending):
    facts, log = bending
    assert facts["is_done"], log[-4000:]
    told = r"Vellus:|Traceback|\w*(Error|Exception)\b(?! \(0x)|<\w+>: \(EXR_ERR"
    assert [line for line in log.splitlines() if re.match(told, line)] == []


def test_hair_is_at_rest_for_blender_while_the_surface_moves(bending):
    facts, _log = bending
    assert facts["playing"] == [True, 0.0] and facts["dragged"] == [True, 0.0]
    for moment in ("stopped", "beside Workbench", "rested"):
        is_paused, moved = facts[moment]
        assert not is_paused and moved > 0.01, moment


def test_the_window_shows_what_it_shows_at_rest(bending):
    facts, _log = bending
    assert facts["frame"] == facts["stopped_frame"]
    assert facts["covered"] > 0.02 and facts["differ"] < FLIPPED
