# SPDX-License-Identifier: GPL-3.0-or-later
"""A desktop Blender that walks through the add-on once with each graphics backend; its pictures are in out/desktop."""

import json
import shutil
import sysconfig
from pathlib import Path

import bpy
import numpy as np
import pytest

from tools import build_extension, compile_kernels, desktop_blender

ROOT = build_extension.ROOT
WALK = Path(__file__).with_name("walk.py")
PARTS = ["groom", "view", "render", "mend"]
HEAD = ROOT / "blend_samples" / "head.obj"


class Walk:
    """What came of a walk: `facts`, `log`, and pictures by the name of their step."""

    def __init__(self, folder, statuses):
        self.folder = folder
        self.statuses = statuses
        self.log = "".join((folder / f"{part}.log").read_text(errors="replace") for part in PARTS)
        facts = folder / "facts.json"
        self.facts = json.loads(facts.read_text()) if facts.exists() else {}

    def picture(self, name):
        """(height, width, 3) display colours of the screen, 0 to 1, first row at the bottom."""
        image = bpy.data.images.load(str(self.folder / f"{name}.png"))
        try:
            width, height = image.size
            pixels = np.empty((height, width, 4), np.float32)
            image.pixels.foreach_get(pixels.ravel())
        finally:
            bpy.data.images.remove(image)
        return pixels[..., :3]


@pytest.fixture(scope="session")
def desktop():
    """The `DesktopBlender` of this machine."""
    try:
        return desktop_blender.find_or_install()
    except desktop_blender.Unavailable as reason:
        pytest.skip(str(reason))


@pytest.fixture(scope="session", params=desktop_blender.BACKENDS)
def walk(request, desktop, tmp_path_factory):
    """The `Walk` with one backend, in a profile of its own."""
    folder = ROOT / "out" / "desktop" / request.param
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    extension = build_extension.build(compile_kernels.this_platform())
    packages = Path(sysconfig.get_paths()["purelib"]).resolve()
    profile = tmp_path_factory.mktemp("profile")
    statuses = [
        desktop.run(
            WALK,
            [part, extension, HEAD, folder, packages],
            backend=request.param,
            profile=profile,
            folders=[packages],
            log=folder / f"{part}.log",
            limit=600,
        )
        for part in PARTS
    ]
    return Walk(folder, statuses)
