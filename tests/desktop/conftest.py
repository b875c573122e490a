# SPDX-License-Identifier: GPL-3.0-or-later
"""A desktop Blender that walks through the add-on once with each graphics backend; its pictures are in out/desktop."""

import fcntl
import json
import os
import shutil
import sysconfig
from pathlib import Path

import bpy
import numpy as np
import pytest

from tools import build_extension, compile_kernels, desktop_blender

ROOT = build_extension.ROOT
WALK = Path(__file__).with_name("walk.py")
SET_UP = Path(__file__).with_name("set_up.py")
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


def _once(tmp_path_factory, name, make):
    """The path that `make` makes of a folder: once, also where several processes test."""
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent
    made = folder / f"{name}.path"
    with open(folder / f"{name}.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # until it is closed
        if not made.exists():
            (folder / name).mkdir()
            made.write_text(str(make(folder / name)))
    return Path(made.read_text())


@pytest.fixture(scope="session")
def extension(tmp_path_factory):
    """The extension's zip."""
    return _once(tmp_path_factory, "extension", lambda _folder: build_extension.build(compile_kernels.this_platform()))


@pytest.fixture(scope="session")
def new_profile(desktop, extension, tmp_path_factory):
    """A function that returns a new profile in which the extension is installed, and its first-time setup done.

    Its files are links: what is written in place is written into all profiles.
    """

    def set_up(folder):
        log = folder.with_suffix(".log")
        status = desktop.run(SET_UP, [extension], profile=folder, log=log, limit=300, size=(640, 400))
        assert status == 0, log.read_text(errors="replace")[-4000:]
        return folder

    template = _once(tmp_path_factory, "installed", set_up)

    def copy():
        folder = tmp_path_factory.mktemp("profile") / "user"
        shutil.copytree(template, folder, symlinks=True, copy_function=os.link)
        return folder

    return copy


@pytest.fixture(scope="session", params=desktop_blender.BACKENDS)
def walk(request, desktop, extension, tmp_path_factory):
    """The `Walk` with one backend, in a profile of its own."""
    folder = ROOT / "out" / "desktop" / request.param
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
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
