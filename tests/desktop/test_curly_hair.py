# SPDX-License-Identifier: GPL-3.0-or-later
"""The manual's ten steps to curly hair, done word for word in a window with a clean profile."""

import json
import re
import shutil
from pathlib import Path

import pytest

from tools import build_extension, desktop_blender

pytestmark = pytest.mark.desktop

SCRIPT = Path(__file__).with_name("curly_hair.py")
# Pictures of the manual are taken with OpenGL.
SIZES = {"opengl": (1600, 1000), "vulkan": (1100, 700)}
HEAD = build_extension.ROOT / "blend_samples" / "head.obj"


PARTS = ["cut", "curl", "beyond"]


class Walk:
    """What came of it: `facts`, and the `log`."""

    def __init__(self, folder, statuses):
        self.statuses = statuses
        self.log = "".join((folder / f"{part}.log").read_text(errors="replace") for part in PARTS)
        facts = folder / "curly_hair.json"
        self.facts = json.loads(facts.read_text()) if facts.exists() else {}


@pytest.fixture(scope="module", params=desktop_blender.BACKENDS)
def walk(request, desktop, extension, new_profile):
    """The `Walk` with one backend; its pictures are in out/desktop."""
    folder = build_extension.ROOT / "out" / "desktop" / f"curly_{request.param}"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    profile = new_profile()
    statuses = [
        desktop.run(
            SCRIPT,
            [part, extension, HEAD, folder],
            backend=request.param,
            profile=profile,
            log=folder / f"{part}.log",
            limit=600,
            size=SIZES[request.param],
        )
        for part in PARTS
    ]
    return Walk(folder, statuses)


def test_it_comes_to_its_end(walk):
    assert walk.statuses == [0, 0, 0] and walk.facts["done"] == PARTS, walk.log[-4000:]
    assert walk.facts["are finite"] and walk.facts["status"] == ""


def test_the_console_tells_of_no_error(walk):
    told = r"Vellus:|Traceback|\w*(Error|Exception)\b(?! \(0x)|<\w+>: \(EXR_ERR"
    assert [line for line in walk.log.splitlines() if re.match(told, line)] == []


def test_styles_are_added_by_clicks(walk):
    assert walk.facts["styles"] == ["Trim", "Fringe", "Clump", "Curl", "Frizz"]
    assert walk.facts["curled"] > 0.01 and walk.facts["points"] > 41


def test_hair_follows_the_brush_that_paints_a_mask(walk):
    assert walk.facts["painting"][0] == "PAINT_WEIGHT" and walk.facts["mode after painting"] == "OBJECT"
    assert min(walk.facts["painted"].values()) > 0.001


def test_keys_stay_with_a_style_that_is_moved_and_undone(walk):
    assert walk.facts["moved"] == ["Trim", "Fringe", "Curl", "Clump", "Frizz"]
    assert walk.facts["undone"] == walk.facts["styles"]
    assert walk.facts["keyed"] == walk.facts["keyed after undo"] == "Curl"


def test_hair_is_combed_with_its_styles_on(walk):
    assert min(walk.facts["combed with styles"].values()) > 0.001
