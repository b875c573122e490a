# SPDX-License-Identifier: GPL-3.0-or-later
"""Render engines: the name of ours, and whether a window shows the scene with another engine."""

ENGINE = "VELLUS"  # name of our render engine


def shows_another(window):
    """Whether any viewport of a window shows the scene rendered by another engine."""
    spaces = [area.spaces.active for area in window.screen.areas if area.type == "VIEW_3D"]
    return window.scene.render.engine != ENGINE and any(space.shading.type == "RENDERED" for space in spaces)
