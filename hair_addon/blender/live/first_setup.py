# SPDX-License-Identifier: GPL-3.0-or-later
"""The first-time setup in the background, once for each version of the add-on: Warp imported, kernels loaded.

Python compiles Warp's sources then, and Warp the kernels that did not come compiled with the extension. It begins a
while after Blender has started with the add-on, in a thread. Hair that is asked for meanwhile shares the work
(core/kernels/kernel_setup.py). Never without a window, and never in a checkout.
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
_INTERVAL = 0.5  # [s] between checks whether it is done

_job = None


def register():
    """Begin in a while, unless it was done before."""
    if preferences.is_extension() and not bpy.app.background:
        bpy.app.timers.register(_advance, first_interval=_DELAY, persistent=True)


def unregister():
    """Stop it, and wait for the module that is being compiled: three seconds at most."""
    if bpy.app.timers.is_registered(_advance):
        bpy.app.timers.unregister(_advance)
    _end()


def _advance():
    """Called by Blender between redraws; returns when to call it again [s], or None."""
    global _job
    if _job is None:
        if _is_done():
            return None
        if kernel_setup.is_under_way():  # for hair that the user waits for
            return _INTERVAL
        # One thread: other cores are left to the user's work.
        _job = Job(_load)
        return _INTERVAL
    if not _job.is_done:
        return _INTERVAL
    job, _job = _job, None
    job.result()
    with contextlib.suppress(OSError):  # then the next session finds them in Warp's cache
        _stamp().write_text(paths.addon_version(), encoding="utf-8")
    return None


def _load(progress):
    """Kernels of the first hair, which is draped on a scalp, then those of what comes next."""
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
    """The file that holds the version of the add-on that was set up last."""
    folder = bpy.utils.extension_path_user(preferences.ADDON_MODULE, path="setup", create=True)
    return Path(folder) / "version"
