# SPDX-License-Identifier: GPL-3.0-or-later
"""The face of the head in the manual's pictures of the window: skin, eyes, and a bust below the cut of the neck."""

import bpy
from mathutils import Vector

from blend_samples.heads import bust, eyes, skin

_MIDDLE = (0.0, 0.0, 0.72)  # [m], of the head

# Name, place [m], power [W] and size [m] of the lights beside that of Blender's first scene.
_LIGHTS = (
    ("Fill", (1.3, -0.1, 0.75), 6.0, 0.9),
    ("Rim", (-0.5, 1.0, 1.45), 34.0, 0.4),
    ("Rim 2", (1.2, 0.9, 1.3), 22.0, 0.4),
)


def light():
    """Add key, fill and rim lights for a head, as Blender's first scene has one light, for a cube of two meters."""
    key = bpy.data.objects["Light"]
    key.location, key.data.energy, key.data.shadow_soft_size = (0.75, -1.35, 1.35), 60.0, 0.25  # [m], [W], [m]
    for name, place, watts, size in _LIGHTS:
        data = bpy.data.lights.new(name, "AREA")
        data.energy, data.size = watts, size
        lamp = bpy.data.objects.new(name, data)
        bpy.context.scene.collection.objects.link(lamp)
        lamp.location = place
        lamp.rotation_euler = (Vector(_MIDDLE) - lamp.location).to_track_quat("-Z", "Y").to_euler()


def dress(head, target):
    """Give an imported head skin and eyes for a portrait without hair; target: what its eyes look at [m]."""
    material = bpy.data.materials.new("Skin")
    material.diffuse_color, material.roughness = (*skin.COLOR, 1.0), 0.6  # of Solid view
    head.data.materials.clear()
    head.data.materials.append(material)
    skin.paint(head)
    _balls, corneas, _lids = eyes.build(head, target)
    corneas.hide_set(True)  # Solid shows glass as opaque
    bust.build(head)
