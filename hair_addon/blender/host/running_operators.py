# SPDX-License-Identifier: GPL-3.0-or-later
"""Modal operators: strokes, drags and the like."""

import bpy


def found(window_managers=None):
    """Return the modal operators of all windows; window_managers: by default those of the file."""
    managers = bpy.data.window_managers if window_managers is None else window_managers
    windows = (window for manager in managers for window in manager.windows)
    # Blender lists a handler without an operator as None, for example if the operator's type was removed.
    return [operator for window in windows for operator in window.modal_operators if operator is not None]


def is_running(prefix, window_managers=None):
    """Whether a modal operator whose identifier begins with a prefix runs in any window."""
    return any(operator.bl_idname.startswith(prefix) for operator in found(window_managers))
