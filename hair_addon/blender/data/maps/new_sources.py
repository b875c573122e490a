# SPDX-License-Identifier: GPL-3.0-or-later
"""New sources of maps on a surface: images, vertex groups and color attributes with one value everywhere."""

import bpy
import numpy as np
from mathutils import Color

_SIDE = 1024  # pixels of a side of an image


def new_image(name, color, is_color):
    """Return a new image of a scene-linear color (3,); is_color: whether it stores colors, encoded as sRGB."""
    image = bpy.data.images.new(name, _SIDE, _SIDE, is_data=not is_color)
    # Blender writes it unchanged, whatever the color space.
    image.generated_color = (*(Color(color).from_scene_linear_to_srgb() if is_color else color), 1.0)
    return image


def new_group(surface_object, name):
    """Return a new vertex group of a mesh object with the weight 1 at all vertices."""
    group = surface_object.vertex_groups.new(name=name)
    group.add(range(len(surface_object.data.vertices)), 1.0, "REPLACE")
    return group


def new_attribute(mesh, name, color):
    """Return a new color attribute of the vertices of a mesh, of a scene-linear color (3,)."""
    attribute = mesh.color_attributes.new(name, "FLOAT_COLOR", "POINT")
    values = np.tile(np.float32([*color, 1.0]), (len(attribute.data), 1))
    attribute.data.foreach_set("color", values.ravel())
    return attribute
