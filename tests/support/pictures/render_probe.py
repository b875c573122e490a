# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair and its surface as a render engine receives them."""

import contextlib

import bpy
import numpy as np

from hair_addon.core.geometry import closest_point
from hair_addon.core.geometry.mesh import TriMesh, positions


class _Probe(bpy.types.RenderEngine):
    bl_idname, bl_label = "VELLUS_PROBE", "Probe"
    seen = {}

    def render(self, depsgraph):
        self.seen.clear()
        for shown in depsgraph.objects:
            if shown.type == "CURVES":
                self.seen[shown.name] = read_points(shown.data)
            elif shown.type == "MESH":
                self.seen[shown.name] = read_mesh(shown.data)


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


@contextlib.contextmanager
def probing():
    """Context with a function of names of hair and surface: (strands, largest distance of a root), as rendered."""

    def render(hair, surface):
        scene = bpy.context.scene
        if scene.camera is None:
            scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
            scene.collection.objects.link(scene.camera)
        scene.render.resolution_x = scene.render.resolution_y = 4
        scene.render.engine = _Probe.bl_idname
        bpy.ops.render.render()
        scene.render.engine = "CYCLES"
        strands, mesh = _Probe.seen[hair], _Probe.seen[surface]
        nearest = closest_point.SurfaceQuery(mesh).nearest(strands[:, 0])
        return strands, np.linalg.norm(positions(mesh, nearest) - strands[:, 0], axis=1).max()

    bpy.utils.register_class(_Probe)
    try:
        yield render
    finally:
        bpy.utils.unregister_class(_Probe)
