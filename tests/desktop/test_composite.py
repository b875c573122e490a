# SPDX-License-Identifier: GPL-3.0-or-later
"""Composite Hair in a window: rendered, animated, undone, copied, opened again, disabled; and a groom by the dialog."""

import json
import re
import shutil

import pytest

from tests.desktop.conftest import ROOT
from tools import desktop_blender

pytestmark = pytest.mark.desktop

SCRIPT = ROOT / "tests" / "desktop" / "composite.py"

# Of display colors: 8 bits of each, and what nodes that add nothing round.
ROUNDING = 0.5 / 255.0


class Walk:
    """What came of it: `facts`, and the `log`."""

    def __init__(self, folder, status):
        self.status = status
        self.log = (folder / "composite.log").read_text(errors="replace")
        facts = folder / "composite.json"
        self.facts = json.loads(facts.read_text()) if facts.exists() else {}


@pytest.fixture(scope="module", params=desktop_blender.BACKENDS)
def walk(request, desktop, extension, new_profile):
    """The `Walk` with one backend; its pictures are in out/desktop."""
    folder = ROOT / "out" / "desktop" / f"composite_{request.param}"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    status = desktop.run(
        SCRIPT,
        [extension, folder],
        backend=request.param,
        profile=new_profile(),
        log=folder / "composite.log",
        limit=300,
        size=(640, 400),
    )
    return Walk(folder, status)


def test_it_comes_to_its_end(walk):
    assert walk.status == 0 and walk.facts.get("is done"), walk.log[-4000:]


def test_the_console_tells_of_no_error(walk):
    told = r"Traceback|\w*(Error|Exception)\b(?! \(0x)|<\w+>: \(EXR_ERR"
    assert [line for line in walk.log.splitlines() if re.match(told, line)] == []
    assert "Not freed memory blocks" not in walk.log, walk.log[-4000:]


def test_it_is_turned_on_undone_and_redone(walk):
    assert walk.facts["on"] == walk.facts["redone"] == [True, True]
    assert walk.facts["undone"] == [False, False]
    assert walk.facts["changed"] > 2.0 * ROUNDING


def test_frames_of_an_animation_have_their_hair(walk):
    first, second = walk.facts["frames"]
    assert first < ROUNDING < second


def test_a_file_that_is_opened_beside_a_render_is_as_it_was_saved(walk):
    assert walk.facts["opened"] == [True, True] and walk.facts["as before"] < ROUNDING


def test_a_copied_scene_has_hair_of_its_own(walk):
    copy = walk.facts["copy"]
    assert copy["has its own"] and copy["scenes"] == 4
    assert copy["picture"] < ROUNDING
    assert copy["without its scene"] == [False, False]


def test_without_the_add_on_and_turned_off_cycles_renders_its_own_hair(walk):
    assert walk.facts["enabled"] == [True, True]
    assert max(walk.facts["disabled"], walk.facts["off"]) < ROUNDING


def test_what_is_out_of_focus_is_blurred_in_the_viewport(walk):
    sharp, blurred = walk.facts["shown"]
    assert blurred > 1.15 * sharp > 0.0


def test_the_dialog_exports_a_groom(walk):
    assert walk.facts["exported"] > 100_000 and walk.facts["frame"] == 1
