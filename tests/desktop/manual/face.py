# SPDX-License-Identifier: GPL-3.0-or-later
"""The face of the head in the manual's pictures of the window: skin, eyes, and a bust below the cut of the neck."""

import bpy

from blend_samples.heads import bust, eyes

_SKIN = (0.52, 0.31, 0.22, 1.0)


def light():
    """Move the light of Blender's first scene, which is for a cube of two meters, near a head."""
    lamp = bpy.data.objects["Light"]
    lamp.location, lamp.data.energy = (1.1, -1.0, 1.6), 150.0  # [m], [W]


def dress(head, target):
    """Give an imported head what a portrait has without hair; target: what its eyes look at [m]."""
    material = bpy.data.materials.new("Skin")
    material.diffuse_color, material.roughness = _SKIN, 0.6  # of Solid view
    principled = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    principled.inputs["Base Color"].default_value = _SKIN
    principled.inputs["Roughness"].default_value = 0.55
    head.data.materials.clear()
    head.data.materials.append(material)
    _balls, corneas, _lids = eyes.build(head, target)
    corneas.hide_set(True)  # Solid shows glass as opaque
    bust.build(head)
