# SPDX-License-Identifier: GPL-3.0-or-later
"""A new artist's first ten minutes, in a window with a clean profile: hair in three clicks, then README's steps."""

import json
import re
import shutil
from pathlib import Path

import pytest

from tools import build_extension, desktop_blender

pytestmark = pytest.mark.desktop

SCRIPT = Path(__file__).with_name("first_minutes.py")
HEAD = build_extension.ROOT / "blend_samples" / "head.obj"


class Minutes:
    """What came of it: `facts`, and the `log`."""

    def __init__(self, folder, status):
        self.status = status
        self.log = (folder / "first_minutes.log").read_text(errors="replace")
        self.facts = json.loads((folder / "first_minutes.json").read_text())


@pytest.fixture(scope="module", params=desktop_blender.BACKENDS)
def minutes(request, desktop, extension, tmp_path_factory):
    """The `Minutes` with one backend; their pictures are in out/desktop."""
    folder = build_extension.ROOT / "out" / "desktop" / f"first_{request.param}"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    status = desktop.run(
        SCRIPT,
        [extension, HEAD, folder],
        backend=request.param,
        profile=tmp_path_factory.mktemp("profile"),
        log=folder / "first_minutes.log",
        limit=600,
        size=(1600, 1000),
    )
    return Minutes(folder, status)


def test_it_comes_to_its_end(minutes):
    assert minutes.status == 0 and minutes.facts.get("is_done"), minutes.log[-4000:]


def test_the_console_tells_of_no_error(minutes):
    told = r"Vellus:|Traceback|\w*(Error|Exception)\b(?! \(0x)|<\w+>: \(EXR_ERR"
    assert [line for line in minutes.log.splitlines() if re.match(told, line)] == []


def test_three_clicks_bring_hair_that_covers_the_cube(minutes):
    """The arrow of the sidebar, the Hair tab, New Hair System."""
    assert (minutes.facts["category"], minutes.facts["surface"]) == ("Hair", "Cube")
    assert minutes.facts["covered"] > 0.7


def test_strands_grow_where_the_guides_may(minutes):
    assert minutes.facts["roots off the mask"] == 0


def test_hair_follows_the_comb(minutes):
    assert minutes.facts["mode"] == "SCULPT_CURVES"
    guides_moved, hair_moved = minutes.facts["combed"]
    assert guides_moved > 0.002 and hair_moved > 0.002


def test_pictures_settings_tables_and_grooms_are_written(minutes):
    assert len(minutes.facts["files"]) == 4 and all(minutes.facts["files"].values())
