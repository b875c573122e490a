# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects for curves read from files or meshes, their surfaces in the world, and joining of Curves objects."""

import bpy
import numpy as np
from mathutils import Matrix

from ...core.geometry.affine import Affine
from ...core.geometry.mesh import TriMesh
from ..data import scene
from ..data.strands import attributes, curves
from ..groom.foreign import foreign_curves
from . import strand_arrays


def new_object(name, placed, surface_object, guide_ids=None, groups=None):
    """Add an object for a `CurveSet` in meters with Z up to the scene, with the transform of a surface but its shear.

    guide_ids: (G,) IDs of the guides that the curves follow; their indices are stored with the weights; groups: (C,)
    IDs of groups, None for none.
    """
    datablock = bpy.data.hair_curves.new(name)
    made = bpy.data.objects.new(name, datablock)
    bpy.context.scene.collection.objects.link(made)
    made.matrix_world = _without_shear(surface_object.matrix_world)
    bpy.context.view_layer.update()
    # Blender rounds the transform, with relative errors of up to 3e-5.
    to_world = np.array(made.matrix_world, np.float64) * strand_arrays.meters_per_unit(bpy.context.scene)
    to_world[3, 3] = 1.0
    back, scale = np.linalg.inv(to_world), abs(np.linalg.det(to_world[:3, :3])) ** (1.0 / 3.0)
    with np.errstate(over="ignore", invalid="ignore"):
        points = (placed.points.astype(np.float64) @ back[:3, :3].T + back[:3, 3]).astype(np.float32)
    datablock.add_curves(np.asarray(placed.counts).tolist())
    datablock.set_types(type="POLY")
    if placed.is_smooth.any():
        datablock.set_types(type="CATMULL_ROM", indices=np.flatnonzero(placed.is_smooth).tolist())
    attributes.write(datablock, "position", "FLOAT_VECTOR", "POINT", points)
    if placed.radii is not None:
        attributes.write(datablock, "radius", "FLOAT", "POINT", placed.radii / np.float32(scale))
    if placed.ids is not None:
        attributes.write(datablock, "id", "INT", "CURVE", placed.ids)
    if placed.root_uvs is not None:
        attributes.write(datablock, "groom_root_uv", "FLOAT2", "CURVE", placed.root_uvs)
    if placed.colors is not None:
        colors = np.concatenate([placed.colors, np.ones((len(placed.colors), 1), np.float32)], axis=1)
        attributes.write(datablock, "groom_color", "FLOAT_COLOR", "POINT", colors)
    if groups is not None:
        attributes.write(datablock, "groom_group_id", "INT", "CURVE", groups)
    if guide_ids is not None and placed.guide_ids is not None:
        curves.write_guide_map(datablock, _guide_map(guide_ids, placed.guide_ids, placed.guide_weights))
    bpy.context.view_layer.update()
    return made


def world_mesh(surface_object):
    """Return the evaluated surface of an object as a `TriMesh` in world space [m]. Raises `HairError`."""
    surface = scene.read_surface(surface_object, scene.present_depsgraph())
    matrix = np.array(surface_object.matrix_world) * strand_arrays.meters_per_unit(bpy.context.scene)
    return TriMesh((surface.posed @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.float32), surface.mesh.triangles)


def _without_shear(matrix):
    """Return a transform that an object without a parent can have."""
    return Matrix.LocRotScale(*matrix.decompose())


def _guide_map(known, ids, weights):
    """Return (S, k) int32 indices in the known IDs, -1 for none, and (S, k) float32 weights."""
    order = np.argsort(known, kind="stable")
    places = np.minimum(np.searchsorted(known, ids, sorter=order), len(known) - 1)
    indices = order[places]
    is_used = (known[indices] == ids) & (weights > 0.0)
    return np.where(is_used, indices, -1).astype(np.int32), np.where(is_used, weights, 0.0).astype(np.float32)


def make_plain(curves_object):
    """Convert guides, hair or other curves to plain curves with their visible shape and without a surface."""
    datablock = foreign_curves.take(curves_object, True)
    datablock.vellus.kind, datablock.vellus.guide_curves, datablock.surface = "NONE", None, None
    to_world = Affine.of(curves_object.matrix_world)
    curves_object.parent = None
    curves_object.matrix_world = _without_shear(curves_object.matrix_world)
    bpy.context.view_layer.update()
    placed = Affine.of(curves_object.matrix_world)
    shear = placed.inverse @ to_world if placed.is_valid else Affine.identity()
    if not shear.is_identity:
        if datablock.users > 1:
            datablock = curves_object.data = datablock.copy()
        points = shear.points(curves.read_points(datablock))
        attributes.write(datablock, "position", "FLOAT_VECTOR", "POINT", points)
        curves.widen(datablock, shear)
        bpy.context.view_layer.update()


def joined(objects):
    """Join objects, with the visible shape of their curves, into the first one; returns it."""
    first, *others = objects
    if not others:
        return first
    for one in objects:
        datablock = foreign_curves.take(one, True)
        curves.write_guide_map(datablock, None)  # indices would refer to the guides before joining
    with bpy.context.temp_override(
        active_object=first, object=first, selected_objects=objects, selected_editable_objects=objects
    ):
        bpy.ops.object.join()
    bpy.context.view_layer.update()
    return first
