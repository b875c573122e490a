# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface and the preview of a groom in an asset library: arrays ↔ a mesh object and pixels."""

import bpy
import numpy as np

from ....core.geometry.mesh import TriMesh
from ...host.notices import name_of
from .. import scene, vertex_groups

_UV_MAP = "UVMap"


def surface_object(name, mesh, corner_uvs, masks):
    """Return a new mesh object of a `TriMesh`, not linked to a scene.

    corner_uvs: (F, 3, 2), None for no UV map; masks: {name: (V,) weights}, which become vertex groups.
    """
    data = bpy.data.meshes.new(name)
    data.from_pydata(mesh.vertices.astype(np.float64), [], mesh.triangles)
    if corner_uvs is not None:
        layer = data.uv_layers.new(name=_UV_MAP)
        layer.uv.foreach_set("vector", np.ascontiguousarray(corner_uvs, np.float32).ravel())
    owner = bpy.data.objects.new(name, data)
    for mask, weights in masks.items():
        vertex_groups.paint(owner.vertex_groups.new(name=mask), weights)
    return owner


def read_surface(owner):
    """Return (`TriMesh`, (F, 3, 2) UV coordinates of corners or None) of a mesh object, without its modifiers."""
    mesh = owner.data
    faces = scene.faces_of(mesh)
    corners = scene.triangle_corners(mesh, faces, name_of(owner))
    found = TriMesh(scene.vertex_positions(mesh), faces.corner_vertices[corners])
    if mesh.uv_layers.active is None:
        return found, None
    uvs = np.empty((len(mesh.loops), 2), np.float32)
    mesh.uv_layers.active.uv.foreach_get("vector", uvs.ravel())
    return found, uvs[corners]


def set_picture(datablock, pixels):
    """Set the preview of a datablock to (height, width, 4) sRGB pixels, bottom row first."""
    preview = datablock.preview_ensure()
    preview.image_size = pixels.shape[1], pixels.shape[0]
    preview.image_pixels_float.foreach_set(np.ascontiguousarray(pixels, np.float32).ravel())


def read_pixels(image):
    """Return (height, width, 4) float32 of an image with an alpha channel, bottom row first."""
    width, height = image.size
    pixels = np.empty((height, width, image.channels), np.float32)
    image.pixels.foreach_get(pixels.ravel())
    return pixels
