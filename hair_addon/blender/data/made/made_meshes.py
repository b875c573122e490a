# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes made of hair: arrays → objects in their own collection."""

import bpy
import numpy as np

from .. import surface_collections

UV_MAP, COLOR = "UVMap", "Color"


def new_collection(name, surface_object):
    """Add a collection to the collection of a surface and return it."""
    collection = bpy.data.collections.new(name)
    surface_collections.collection_of(surface_object).children.link(collection)
    return collection


def new_object(name, source, surface_object, collection, material):
    """Add a mesh object of a `PolygonMesh` in a surface's local coordinates, a child of the surface; return it."""
    mesh = bpy.data.meshes.new(name)
    faces = source.faces
    mesh.vertices.add(len(source.vertices))
    mesh.vertices.foreach_set("co", np.ascontiguousarray(source.vertices, np.float32).ravel())
    mesh.loops.add(len(faces.corner_vertices))
    mesh.loops.foreach_set("vertex_index", faces.corner_vertices)
    mesh.polygons.add(len(faces.starts) - 1)
    mesh.polygons.foreach_set("loop_start", faces.starts[:-1])
    uv_map = mesh.uv_layers.new(name=UV_MAP)
    uv_map.uv.foreach_set("vector", np.ascontiguousarray(source.uvs, np.float32).ravel())
    if source.colors is not None:
        attribute = mesh.color_attributes.new(COLOR, "FLOAT_COLOR", "POINT")
        opaque = np.ones((len(source.colors), 1), np.float32)
        attribute.data.foreach_set("color", np.concatenate([source.colors, opaque], axis=1).ravel())
    mesh.update(calc_edges=True)
    mesh.shade_smooth()
    mesh.materials.append(material)
    mesh_object = bpy.data.objects.new(name, mesh)
    mesh_object.parent = surface_object
    collection.objects.link(mesh_object)
    return mesh_object


def hide(mesh_object):
    """Hide an object in the viewport and in renders."""
    if bpy.context.view_layer.objects.get(mesh_object.name) == mesh_object:  # the view layer may exclude it
        mesh_object.hide_set(True)
    mesh_object.hide_render = True
