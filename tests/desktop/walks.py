# SPDX-License-Identifier: GPL-3.0-or-later
"""A walk through the add-on in a window of Blender runs a script of this folder and returns its results."""

import json
import re
import shutil
from pathlib import Path

import pytest

from tools import build_extension, desktop_blender

SCRIPTS = Path(__file__).parent

# Lines of the console by which the add-on, Python and OpenEXR complain.
_COMPLAINT = re.compile(r"Vellus:|Traceback|\w*(Error|Exception)\b(?! \(0x)|<\w+>: \(EXR_ERR")


# For tests that do not depend on the driver: the file of a walk lists its parts for each driver.
with_opengl = pytest.mark.parametrize("walk", desktop_blender.BACKENDS[:1], indirect=True)

# For walks that draw nothing of their own: Vulkan, in software, takes as long again and is left to the long run.
LONG_WITH_VULKAN = [
    pytest.param(name, marks=pytest.mark.long if name == "vulkan" else ()) for name in desktop_blender.BACKENDS
]


class Walk:
    """The result of a walk: `facts` noted by its script, the `log` of its output, and its pictures in `folder`."""

    def __init__(self, folder, parts):
        self.folder, self.parts = folder, list(parts)
        self.facts, self.log, self.statuses = {"done": []}, "", []

    def read(self, log, status):
        """Add what a part printed and noted, and Blender's exit status."""
        self.log += log.read_text(errors="replace")
        self.statuses.append(status)
        facts = self.folder / "facts.json"
        if facts.exists():
            self.facts = json.loads(facts.read_text())

    def is_done(self, part):
        """Whether a part reached its end, and Blender ended without an error."""
        return part in self.facts["done"] and not any(self.statuses)

    def complaints(self):
        """Return lines of the console with an error or with what the add-on refused."""
        return [line for line in self.log.splitlines() if _COMPLAINT.match(line)]

    def assert_done(self):
        """Assert that every part is done."""
        assert all(map(self.is_done, self.parts)), self.log[-4000:]


def take(desktop, name, extension, profile, backend, *, parts=("all",), more=(), folder=None, **details):
    """Run the parts of a script, each in a Blender of its own, up to one that fails; returns the `Walk`.

    desktop: the `DesktopBlender`; name: the script's path in this folder, without `.py`; extension: the zip; more: its
    words after those that all have; folder: its name in out/desktop, by default that of the script and the backend;
    details: of `DesktopBlender.run`.
    """
    made = build_extension.ROOT / "out" / "desktop" / (folder or f"{Path(name).name}_{backend}")
    shutil.rmtree(made, ignore_errors=True)
    made.mkdir(parents=True)
    script, walk = SCRIPTS / f"{name}.py", Walk(made, parts)
    for part in parts:
        log = made / f"{part}.log"
        status = desktop.run(
            script, [part, extension, made, *more], backend=backend, profile=profile, log=log, **details
        )
        walk.read(log, status)
        if not walk.is_done(part):
            break
    return walk
