# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the file of the nodes that deform strands, after a change of them in follow_nodes.py."""

import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from hair_addon.blender.data.strands import follow_nodes

if __name__ == "__main__":
    bpy.ops.wm.read_factory_settings(use_empty=True)
    follow_nodes.write_file()
