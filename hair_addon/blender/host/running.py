# SPDX-License-Identifier: GPL-3.0-or-later
"""The running long operation, if any, and whether there is a window for it.

Panels show the operation, handlers wait for it, and unregistering ends it. At most one runs at a time, as its operator
blocks all input except Esc and navigation.
"""

import contextlib
import sys

import bpy

_ADD_ON = __package__.rpartition(".blender.")[0]
_job = None
_work = None
_timer = None


def has_window():
    """Whether Blender has a window, and runs timers."""
    return not bpy.app.background


def may_wait():
    """Whether data may be written a moment after an update: in a window, but not for scripts, which may read it."""
    return has_window() and not _is_in_script()


def _is_in_script():
    """Whether a script or another add-on runs: the outermost function does not belong to this add-on.

    Without a window every update comes from a script.
    """
    if bpy.app.background:
        return False
    frame = sys._getframe()
    while frame.f_back is not None:
        frame = frame.f_back
    return not f"{frame.f_globals.get('__name__', '')}.".startswith(f"{_ADD_ON}.")


def is_rendering():
    """Whether a render job runs in a thread beside the window."""
    return bpy.app.is_job_running("RENDER")


def job():
    """Return the `Job` that runs now, or None."""
    return _job


def begin(context, started, work):
    """Set the running `Job`, one step of some work, and let the window send timer events until `end`.

    The job keeps the label of the previous step until it sets its own.
    """
    global _job, _work, _timer
    if _job is not None and not started.step:
        started.step, started.part = _job.step, _job.part
    _job, _work = started, work
    if _timer is None:
        _timer = context.window_manager.event_timer_add(0.05, window=context.window)


@contextlib.contextmanager
def set_aside():
    """Hide the running operation in a context, in which hair must follow changes of the scene."""
    global _job
    before, _job = _job, None
    try:
        yield
    finally:
        _job = before


def end(context):
    """Stop the job if it still runs, wait for it, close its work, and remove the timer and the status text.

    The work is closed at once, which restores the scene after a stop: the garbage collector might close it after the
    add-on was disabled.
    """
    global _job, _work, _timer
    if _job is not None:
        _job.stop()
        _job.wait()
        _job = None
    if _timer is not None:
        context.window_manager.event_timer_remove(_timer)
        context.workspace.status_text_set(None)
        _timer = None
    if _work is not None:
        closing, _work = _work, None
        closing.close()


def found(window_managers=None):
    """Return the modal operators of all windows; window_managers: by default those of the file."""
    managers = bpy.data.window_managers if window_managers is None else window_managers
    windows = (window for manager in managers for window in manager.windows)
    # Blender lists a handler without an operator as None, for example if the operator's type was removed.
    return [operator for window in windows for operator in window.modal_operators if operator is not None]


def is_running(prefix, window_managers=None):
    """Whether a modal operator whose identifier begins with a prefix runs in any window."""
    return any(operator.bl_idname.startswith(prefix) for operator in found(window_managers))
