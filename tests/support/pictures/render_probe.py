# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair and its surface as a render engine receives them."""

import contextlib

import bpy
import numpy as np

from hair_addon.core.geometry import closest_point
from hair_addon.core.geometry.mesh import TriMesh, positions


@contextlib.contextmanager
def reading(read):
    """Context with a function that renders and returns [read(depsgraph)] of each frame; its engine draws nothing.

    Its arguments: the scene, None for the present one; frames: (first, last, step), None for the present frame.
    """
    seen = []

    class Reader(bpy.types.RenderEngine):
        bl_idname, bl_label = "VELLUS_TEST_READER", "Reader"

        def render(self, depsgraph):
            seen.append(read(depsgraph))

    def render(scene=None, frames=None):
        scene = scene or bpy.context.scene
        if scene.camera is None:
            scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
            scene.collection.objects.link(scene.camera)
        scene.render.engine = Reader.bl_idname
        scene.render.resolution_x = scene.render.resolution_y = 8
        if frames is not None:
            scene.frame_start, scene.frame_end, scene.frame_step = frames
        seen.clear()
        bpy.ops.render.render(animation=frames is not None, scene=scene.name)
        return list(seen)

    bpy.utils.register_class(Reader)
    try:
        yield render
    finally:
        bpy.utils.unregister_class(Reader)


def read_points(curves):
    """Return (S, P, 3) float32 of evaluated Curves of one point count."""
    found = np.empty((len(curves.points), 3), np.float32)
    curves.attributes["position"].data.foreach_get("vector", found.ravel())
    return found.reshape(len(curves.curves), -1, 3)


def read_mesh(mesh):
    """Return the `TriMesh` of an evaluated mesh."""
    vertices = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", vertices.ravel())
    mesh.calc_loop_triangles()
    triangles = np.empty((len(mesh.loop_triangles), 3), np.int32)
    mesh.loop_triangles.foreach_get("vertices", triangles.ravel())
    return TriMesh(vertices, triangles)


def _read_all(depsgraph):
    """Return {name: strands or `TriMesh`} of all Curves and meshes."""
    found = {shown.name: read_points(shown.data) for shown in depsgraph.objects if shown.type == "CURVES"}
    return found | {shown.name: read_mesh(shown.data) for shown in depsgraph.objects if shown.type == "MESH"}


@contextlib.contextmanager
def probing():
    """Context with a function of names of hair and surface: (strands, largest distance of a root), as rendered."""
    with reading(_read_all) as rendered:

        def render(hair, surface):
            (seen,) = rendered()
            bpy.context.scene.render.engine = "CYCLES"
            strands, mesh = seen[hair], seen[surface]
            nearest = closest_point.SurfaceQuery(mesh).nearest(strands[:, 0])
            return strands, np.linalg.norm(positions(mesh, nearest) - strands[:, 0], axis=1).max()

        yield render
