# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair on a swinging surface, for tests that bake and play dynamics."""

import bpy

SWINGS = ((1, 0.0), (6, 0.6), (11, -0.6), (16, 0.0))  # (frame, angle about Y)


def swing(surface):
    """Animate an object that swings in the first 16 frames."""
    for frame, angle in SWINGS:
        surface.rotation_euler.y = angle
        surface.keyframe_insert("rotation_euler", frame=frame)
    bpy.context.scene.frame_set(1)


def simulate(guides, folder, **settings):
    """Switch simulation of guides on, with frames in a folder and coarse settings unless given."""
    state = guides.data.vellus
    state.cache_folder = str(folder)
    coarse = {"vertex_count": 9, "substeps": 2, "automatic_substeps": False}
    for name, value in (coarse | settings).items():
        setattr(state.dynamics, name, value)
    state.simulates = True
    bpy.context.view_layer.update()


def simulate_apart(folder):
    """Simulate guides on a swinging sphere, which touch neither each other nor the sphere; returns their object."""
    swing(bpy.data.objects["Sphere"])
    guides = bpy.data.objects["Guides"]
    apart = {"hair_friction": 0.0, "hair_pressure": 0.0, "collides_with_surface": False, "sag_free": False}
    simulate(guides, folder, bend_stiffness=1.0, **apart)
    return guides
