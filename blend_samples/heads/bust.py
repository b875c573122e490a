# SPDX-License-Identifier: GPL-3.0-or-later
"""A bust under the sample's head: neck and shoulders in a jersey whose collar hides where the neck is cut."""

import bpy
import numpy as np

_SEGMENTS = 48

# Cross sections from the collar's inside down: height [m], middle along Y, half width, half depth, exponent of the
# superellipse, rise toward the nape per meter of depth.
_SECTIONS = np.array(
    [
        (0.602, -0.0250, 0.0470, 0.0460, 2.2, 0.22),
        (0.616, -0.0255, 0.0500, 0.0480, 2.2, 0.24),
        (0.619, -0.0255, 0.0520, 0.0500, 2.2, 0.24),
        (0.616, -0.0250, 0.0545, 0.0525, 2.2, 0.24),
        (0.600, -0.0235, 0.0590, 0.0570, 2.2, 0.24),
        (0.588, -0.0205, 0.0660, 0.0625, 2.2, 0.24),
        (0.574, -0.0170, 0.0850, 0.0710, 2.2, 0.20),
        (0.563, -0.0140, 0.1120, 0.0790, 2.3, 0.14),
        (0.551, -0.0120, 0.1420, 0.0870, 2.4, 0.08),
        (0.535, -0.0110, 0.1700, 0.0950, 2.5, 0.04),
        (0.510, -0.0110, 0.1900, 0.1030, 2.6, 0.0),
        (0.470, -0.0120, 0.2010, 0.1100, 2.6, 0.0),
        (0.410, -0.0140, 0.2020, 0.1160, 2.6, 0.0),
        (0.340, -0.0160, 0.1940, 0.1180, 2.6, 0.0),
        (0.300, -0.0160, 0.1880, 0.1160, 2.6, 0.0),
        (0.298, -0.0160, 0.1700, 0.1000, 2.6, 0.0),
    ]
)


def build(head_object):
    """Return the object `Bust`, a child of the head."""
    turn = 2.0 * np.pi * np.arange(_SEGMENTS) / _SEGMENTS
    cosine, sine = np.cos(turn), np.sin(turn)
    rings = []
    for height, middle, half_width, half_depth, exponent, rise in _SECTIONS:
        x = half_width * np.sign(cosine) * np.abs(cosine) ** (2.0 / exponent)
        y = half_depth * np.sign(sine) * np.abs(sine) ** (2.0 / exponent)
        rings.append(np.stack([x, middle + y, height + rise * y], axis=1))
    faces = [
        (first + i, first + (i + 1) % _SEGMENTS, first + _SEGMENTS + (i + 1) % _SEGMENTS, first + _SEGMENTS + i)
        for first in range(0, (len(rings) - 1) * _SEGMENTS, _SEGMENTS)
        for i in range(_SEGMENTS)
    ]
    last = (len(rings) - 1) * _SEGMENTS
    faces.append(tuple(range(last, last + _SEGMENTS)))
    mesh = bpy.data.meshes.new("Bust")
    mesh.from_pydata(np.concatenate(rings).tolist(), [], [face[::-1] for face in faces])
    mesh.materials.append(_jersey())
    mesh.shade_smooth()
    placed = bpy.data.objects.new("Bust", mesh)
    placed.parent = head_object
    subdivision = placed.modifiers.new("Subdivision", "SUBSURF")
    subdivision.levels = subdivision.render_levels = 2
    bpy.context.scene.collection.objects.link(placed)
    return placed


def _jersey():
    material = bpy.data.materials.new("Jersey")
    color = (0.045, 0.050, 0.060, 1.0)
    material.diffuse_color, material.roughness, material.specular_intensity = color, 0.9, 0.1  # of Solid view
    principled = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    principled.inputs["Base Color"].default_value = color
    principled.inputs["Roughness"].default_value = 0.85
    principled.inputs["Specular IOR Level"].default_value = 0.1  # wool
    return material
