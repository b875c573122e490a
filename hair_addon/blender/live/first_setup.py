# SPDX-License-Identifier: GPL-3.0-or-later
"""The first-time setup in the background, once per version of the add-on: Warp is imported, kernels are loaded.

Python then compiles Warp's sources, and Warp compiles the kernels that the extension does not include. The setup begins
in a thread a few seconds after Blender has started. Hair that is generated meanwhile shares the work
(core/kernels/kernel_setup.py). It never runs without a window or in a checkout.
"""

import contextlib
from pathlib import Path

import bpy

from ...core import dynamics
from ...core.grooming import groom
from ...core.kernels import kernel_setup
from ...core.long_work import Job, part_of
from ..host import paths
from ..settings import preferences

_DELAY = 3.0  # [s] after registration: Blender's own start comes first
_INTERVAL = 0.5  # [s] between checks whether the setup is done

_job = None


def register():
    """Schedule the setup, unless it was done before."""
    if preferences.is_extension() and not bpy.app.background:
        bpy.app.timers.register(_advance, first_interval=_DELAY, persistent=True)


def unregister():
    """Stop the setup, and wait for the module that is being compiled: three seconds at most."""
    if bpy.app.timers.is_registered(_advance):
        bpy.app.timers.unregister(_advance)
    _end()


def _advance():
    """Called by Blender between redraws; returns when to call it again [s], or None."""
    global _job
    if _job is None:
        if _is_done():
            return None
        if kernel_setup.is_under_way():  # the user waits for hair
            return _INTERVAL
        # A single thread leaves the other cores to the user's work.
        _job = Job(_load)
        return _INTERVAL
    if not _job.is_done:
        return _INTERVAL
    job, _job = _job, None
    job.result()
    with contextlib.suppress(OSError):  # the next session repeats the setup from Warp's cache
        _stamp().write_text(paths.addon_version(), encoding="utf-8")
    return None


def _load(progress):
    """Load the kernels of the first hair, which is draped on a scalp, then the kernels of later steps."""
    groom.load_kernels("cpu", part_of(progress, 0.0, 0.5), most_threads=1)
    dynamics.draped_growth.load_kernels("cpu", part_of(progress, 0.5, 0.8), most_threads=1)
    groom.load_later_kernels("cpu", part_of(progress, 0.8, 1.0), most_threads=1)


def _end():
    global _job
    if _job is not None:
        _job.stop()
        _job.wait()
        _job = None


def _is_done():
    try:
        return _stamp().read_text(encoding="utf-8") == paths.addon_version()
    except OSError:
        return False


def _stamp():
    """Return the file with the version of the add-on that was set up last."""
    folder = bpy.utils.extension_path_user(preferences.ADDON_MODULE, path="setup", create=True)
    return Path(folder) / "version"
