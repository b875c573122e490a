# SPDX-License-Identifier: GPL-3.0-or-later
"""The running long operation, if any, and whether there is a window for one.

Panels show it, handlers wait for it, unregistering ends it.

There is at most one: its operator blocks all input except Esc and navigation until it has ended.
"""

import contextlib

import bpy

_job = None
_work = None
_timer = None


def has_window():
    """Whether there is a window, and timers run."""
    return not bpy.app.background


def is_rendering():
    """Whether a window renders, in a thread of its own."""
    return bpy.app.is_job_running("RENDER")


def job():
    """The `Job` that runs now, or None."""
    return _job


def begin(context, started, work):
    """Take note of a `Job`, a step of some work, and have its window send timer events for as long as it runs.

    It is called as the step before it until it says what it does.
    """
    global _job, _work, _timer
    if _job is not None and not started.step:
        started.step, started.part = _job.step, _job.part
    _job, _work = started, work
    if _timer is None:
        _timer = context.window_manager.event_timer_add(0.05, window=context.window)


@contextlib.contextmanager
def set_aside():
    """As if no operation ran: for a step of the running one that needs hair to follow a change of the scene."""
    global _job
    kept, _job = _job, None
    try:
        yield
    finally:
        _job = kept


def end(context):
    """Stop the job if it still runs, wait for it, close its work, and leave no timer and no status behind.

    What was stopped leaves all as it was: now, not when Python comes to the generator, as the add-on may be disabled.
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
