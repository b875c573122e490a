# SPDX-License-Identifier: GPL-3.0-or-later
"""Modal operators of all windows are found."""

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
