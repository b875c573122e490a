# SPDX-License-Identifier: GPL-3.0-or-later
"""A profile for other walks: the extension is installed, and its first-time setup done.

Run by a desktop Blender: set_up.py -- ZIP.
"""

import sys
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))
from tests.desktop.window import install  # noqa: E402


def set_up():
    """Install and save the enabled extension, and end Blender once the setup is done; Blender calls this between
    redraws.
    """
    first_setup = install(ZIP).live.first_setup
    if not first_setup._is_done():
        return 0.2
    bpy.ops.wm.save_userpref()
    bpy.ops.wm.quit_blender()
    return None


if __name__ == "__main__":
    (ZIP,) = sys.argv[sys.argv.index("--") + 1 :]
    bpy.app.timers.register(set_up, first_interval=0.5, persistent=True)
