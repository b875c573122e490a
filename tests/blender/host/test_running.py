# SPDX-License-Identifier: GPL-3.0-or-later
"""Modal operators of all windows are found, and updates by scripts are distinguished from updates by the window."""

import _thread
import queue
from types import SimpleNamespace

from hair_addon.blender.host import running


def managers(*operators):
    """Return a window manager with two windows, the second of which runs operators."""
    return [SimpleNamespace(windows=[SimpleNamespace(modal_operators=[]), SimpleNamespace(modal_operators=operators)])]


def test_handlers_without_an_operator_are_passed_over():
    """Handlers without an operator, which Blender lists after an operator's type was removed, are skipped."""
    stroke = SimpleNamespace(bl_idname="SCULPT_CURVES_OT_brush_stroke")
    assert running.is_running("SCULPT_", managers(None, stroke))
    assert not running.is_running("TRANSFORM_", managers(None, stroke))
    assert not running.is_running("SCULPT_", managers(None))
    assert not running.is_running("SCULPT_")


def test_data_waits_in_a_window_but_not_for_scripts(monkeypatch):
    """Blender calls handlers without an outer Python function, as a thread starts its function here."""
    monkeypatch.setattr(running, "bpy", SimpleNamespace(app=SimpleNamespace(background=False)))
    found = queue.Queue()
    names = {"__name__": "hair_addon.blender.live.handlers", "found": found, "running": running}
    exec("def handler(): found.put(running.may_wait())", names)
    _thread.start_new_thread(names["handler"], ())
    assert found.get(timeout=10.0)
    names["handler"]()
    assert not found.get(timeout=10.0)
