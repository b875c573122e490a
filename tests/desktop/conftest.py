# SPDX-License-Identifier: GPL-3.0-or-later
"""A desktop Blender, and profiles with the installed extension."""

import fcntl
import os
import shutil
from pathlib import Path

import pytest

from tools import build_extension, compile_kernels, desktop_blender

SET_UP = Path(__file__).with_name("set_up.py")


@pytest.fixture(scope="session")
def desktop():
    """Return the `DesktopBlender` of this machine."""
    try:
        return desktop_blender.find_or_install()
    except desktop_blender.Unavailable as reason:
        pytest.skip(str(reason))


def _once(tmp_path_factory, name, make):
    """Return the path that `make` creates in a folder, once for all processes of tests."""
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent
    made = folder / f"{name}.path"
    with open(folder / f"{name}.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # until it is closed
        if not made.exists():
            (folder / name).mkdir(exist_ok=True)  # it exists if another process has failed
            made.write_text(str(make(folder / name)))
    return Path(made.read_text())


@pytest.fixture(scope="session")
def extension(tmp_path_factory):
    """Return the extension's zip."""
    return _once(
        tmp_path_factory,
        "extension",
        lambda _folder: build_extension.build(compile_kernels.this_platform(), "tests"),
    )


@pytest.fixture(scope="session")
def new_profile(desktop, extension, tmp_path_factory):
    """Return a function that returns a new profile with the installed extension, after its first-time setup.

    Its files are links: what is written in place is written into all profiles.
    """

    def set_up(folder):
        log = folder.with_suffix(".log")
        status = desktop.run(SET_UP, [extension], profile=folder, log=log, size=(640, 400))
        assert status == 0, log.read_text(errors="replace")[-4000:]
        return folder

    template = _once(tmp_path_factory, "installed", set_up)

    def copy():
        folder = tmp_path_factory.mktemp("profile") / "user"
        shutil.copytree(template, folder, symlinks=True, copy_function=os.link)
        return folder

    return copy
