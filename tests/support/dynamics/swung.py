# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair on a surface that swings: what dynamics tests bake and play."""

import bpy

SWINGS = ((1, 0.0), (6, 0.6), (11, -0.6), (16, 0.0))  # (frame, angle about Y)


def swing(surface):
    """Let an object turn to and fro in the first 16 frames."""
    for frame, angle in SWINGS:
        surface.rotation_euler.y = angle
        surface.keyframe_insert("rotation_euler", frame=frame)
    bpy.context.scene.frame_set(1)


def simulate(guides, folder, **settings):
    """Make guides simulate, with some settings, and frames in a folder: coarsely, where nothing else is asked for."""
    state = guides.data.vellus
    state.cache_folder = str(folder)
    coarse = {"vertex_count": 9, "substeps": 2, "automatic_substeps": False}
    for name, value in (coarse | settings).items():
        setattr(state.dynamics, name, value)
    state.simulates = True
    bpy.context.view_layer.update()
