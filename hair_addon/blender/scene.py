# SPDX-License-Identifier: GPL-3.0-or-later
"""The door for surfaces, lights and cameras: Blender's data → arrays."""

from dataclasses import dataclass

import numpy as np

from ..core.errors import HairError
from ..core.mesh import SurfacePoints, TriMesh
from . import uniforms

LIGHT_KINDS = {"SUN": 0, "POINT": 1, "SPOT": 2, "AREA": 3}  # as in shaders/include/lights.glsl


@dataclass(frozen=True)
class Surface:
    """A mesh object as the mathematics sees it: world axes and scale [m], the object's origin at zero.

    So gravity is -Z and lengths are true, while an object far from the world's origin loses no precision.
    """

    name: str
    mesh: TriMesh
    corner_uvs: np.ndarray | None  # (F, 3, 2) float32, None without a UV map
    uv_map: str
    to_world_axes: np.ndarray  # (3, 3) float64: local coordinates → these
    is_mirrored: bool  # negative scale: triangles are wound the other way than in Blender

    def to_local(self, positions):
        """(..., 3) positions → the object's local coordinates, float32."""
        return (positions @ np.linalg.inv(self.to_world_axes).T).astype(np.float32)

    def from_local(self, positions):
        """(..., 3) local coordinates → positions here, float32."""
        return (positions @ self.to_world_axes.T).astype(np.float32)

    def to_local_normals(self, normals):
        """(N, 3) unit normals → unit normals in local coordinates: the inverse transpose of `to_local`."""
        local = normals @ self.to_world_axes
        return (local / np.linalg.norm(local, axis=-1, keepdims=True)).astype(np.float32)

    def uvs(self, points):
        """(N, 2) float32 UV coordinates of surface points; zeros without a UV map."""
        if self.corner_uvs is None:
            return np.zeros((len(points), 2), np.float32)
        return np.einsum("nc,ncu->nu", points.barycentric, self.corner_uvs[points.triangle]).astype(np.float32)

    def swap_winding(self, points):
        """The same points with barycentric coordinates in Blender's order of corners, or back."""
        if not self.is_mirrored:
            return points
        return SurfacePoints(points.triangle, np.ascontiguousarray(points.barycentric[:, [0, 2, 1]]))


def read_surface(surface_object, depsgraph):
    """The evaluated mesh of an object as a `Surface`."""
    to_world_axes = np.array(surface_object.matrix_world.to_3x3(), np.float64)
    determinant = np.linalg.det(to_world_axes)
    if not np.isfinite(to_world_axes).all() or abs(determinant) < 1e-30:
        raise HairError(f'"{surface_object.name}" is scaled to nothing: set its scale to something other than zero.')
    evaluated = surface_object.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        vertices = _vertex_positions(mesh)
        mesh.calc_loop_triangles()
        triangles = np.empty((len(mesh.loop_triangles), 3), np.int32)
        mesh.loop_triangles.foreach_get("vertices", triangles.ravel())
        corner_uvs, uv_map = None, ""
        if mesh.uv_layers.active is not None:
            uv_map = mesh.uv_layers.active.name
            uvs = np.empty((len(mesh.loops), 2), np.float32)
            mesh.uv_layers.active.uv.foreach_get("vector", uvs.ravel())
            loops = np.empty((len(triangles), 3), np.int32)
            mesh.loop_triangles.foreach_get("loops", loops.ravel())
            corner_uvs = uvs[loops]
    finally:
        evaluated.to_mesh_clear()
    is_mirrored = bool(determinant < 0.0)
    if is_mirrored:
        triangles = np.ascontiguousarray(triangles[:, [0, 2, 1]])
        corner_uvs = None if corner_uvs is None else corner_uvs[:, [0, 2, 1]]
    with np.errstate(invalid="ignore"):  # what is not finite is refused where the mesh is checked
        vertices = (vertices @ to_world_axes.T).astype(np.float32)
    return Surface(surface_object.name, TriMesh(vertices, triangles), corner_uvs, uv_map, to_world_axes, is_mirrored)


def _vertex_positions(mesh):
    """(V, 3) float32; a mesh without vertices has no attribute of positions either."""
    vertices = np.empty((len(mesh.vertices), 3), np.float32)
    if len(vertices):
        mesh.attributes["position"].data.foreach_get("vector", vertices.ravel())
    return vertices


def read_vertex_group(surface_object, depsgraph, name):
    """(V,) float32 weights of a vertex group on the evaluated mesh, or None for the empty name."""
    if not name:
        return None
    group = surface_object.vertex_groups.get(name)
    if group is None:
        raise HairError(f'"{surface_object.name}" has no vertex group "{name}": pick one of its groups, or none.')
    evaluated = surface_object.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        weights = np.zeros(len(mesh.vertices), np.float32)
        # Blender offers no array access to vertex groups.
        for vertex, entry in enumerate(mesh.vertices):
            for element in entry.groups:
                if element.group == group.index:
                    weights[vertex] = element.weight
    finally:
        evaluated.to_mesh_clear()
    return weights


def read_lights(depsgraph, for_render):
    """The visible lights, or those that are rendered, as a `uniforms.LIGHTS` record: its capacity of the first."""
    lights = [
        _read_light(instance.object.data, np.array(instance.matrix_world))
        for instance in depsgraph.object_instances
        if instance.object.type == "LIGHT" and not (for_render and instance.object.hide_render)
    ][: uniforms.LIGHT_CAPACITY]
    record = uniforms.LIGHTS.record()
    record["light"][: len(lights)] = lights
    record["count"] = len(lights)
    return record


def _read_light(light, matrix):
    record = uniforms.LIGHT.record()
    record["kind"] = LIGHT_KINDS[light.type]
    record["position"][:3] = matrix[:3, 3]
    axis = -matrix[:3, 2]  # a light shines along its own -Z
    record["axis"][:3] = axis / np.linalg.norm(axis)
    temperature = light.temperature_color if light.use_temperature else (1.0, 1.0, 1.0)
    record["power"][:3] = np.array(light.color) * temperature * light.energy * 2.0**light.exposure
    if not light.normalize:
        record["power"][:3] *= _emitting_area(light, matrix)
    if light.type == "SPOT":
        record["cos_cone"] = np.cos(0.5 * light.spot_size)
        record["blend"] = light.spot_blend
    elif light.type == "AREA":
        record["cos_cone"] = np.cos(0.5 * light.spread)
    return record


def _emitting_area(light, matrix):
    """What multiplies the power of a light that is not normalised: its area [m²], or a sun's on the unit sphere.

    As Cycles does it, which takes the disk of a point without size for one.
    """
    if light.type == "AREA":
        width, height = light.size, light.size_y if light.shape in {"RECTANGLE", "ELLIPSE"} else light.size
        x_scale, y_scale = np.linalg.norm(matrix[:3, :2], axis=0)
        part = 0.25 * np.pi if light.shape in {"DISK", "ELLIPSE"} else 1.0
        return part * width * x_scale * height * y_scale
    if light.type == "SUN":
        return np.pi * np.sin(0.5 * light.angle) ** 2 or 1.0
    return 4.0 * (np.pi * light.shadow_soft_size**2 or 1.0)


def read_world_radiance(scene):
    """(3,) colour times strength of the world's background, black without a world."""
    world = scene.world
    if world is None:
        return np.zeros(3)
    background = next((n for n in world.node_tree.nodes if n.type == "BACKGROUND"), None) if world.node_tree else None
    if background is None:
        return np.array(world.color)
    return np.array(background.inputs["Color"].default_value[:3]) * background.inputs["Strength"].default_value


def curves_objects(view_layer, kind, viewport=None):
    """The visible objects of a view layer that hold Curves of ours, of the kind GUIDES or HAIR."""
    return [
        o
        for o in view_layer.objects
        if o.type == "CURVES" and o.data.vellus.kind == kind and o.visible_get(view_layer=view_layer, viewport=viewport)
    ]


def read_camera(scene, depsgraph, width, height):
    """(world to view, view to clip), each (4, 4) float64, of the scene's camera for a picture of this size."""
    if scene.camera is None:
        raise HairError("The scene has no camera to look through: add one.")
    camera = scene.camera.evaluated_get(depsgraph)
    render = scene.render
    view_to_clip = camera.calc_matrix_camera(
        depsgraph, x=width, y=height, scale_x=render.pixel_aspect_x, scale_y=render.pixel_aspect_y
    )
    # An object's scale is no part of where its camera looks.
    location, rotation, _scale = camera.matrix_world.decompose()
    view_to_world = rotation.to_matrix().to_4x4()
    view_to_world.translation = location
    return np.array(view_to_world.inverted(), np.float64), np.array(view_to_clip, np.float64)


@dataclass(frozen=True)
class DrawnMesh:
    """Triangles as they are drawn: (3 F, 3) float32 corner positions [m] and unit normals in world space, colour."""

    positions: np.ndarray
    normals: np.ndarray
    color: tuple


def read_drawn_meshes(depsgraph, for_render):
    """A `DrawnMesh` for every visible mesh of the depsgraph, instances included; or for every one that is rendered."""
    meshes = []
    for instance in depsgraph.object_instances:
        is_hidden = for_render and instance.object.hide_render
        if instance.object.type == "MESH" and instance.show_self and not is_hidden:
            meshes.append(_read_drawn_mesh(instance.object, np.array(instance.matrix_world, np.float64)))
    return [mesh for mesh in meshes if len(mesh.positions)]


def _read_drawn_mesh(mesh_object, to_world):
    mesh = mesh_object.to_mesh()
    try:
        mesh.calc_loop_triangles()
        count = len(mesh.loop_triangles)
        vertices = _vertex_positions(mesh)
        corners = np.empty(3 * count, np.int32)
        mesh.loop_triangles.foreach_get("vertices", corners)
        loops = np.empty(3 * count, np.int32)
        mesh.loop_triangles.foreach_get("loops", loops)
        loop_normals = np.empty((len(mesh.loops), 3), np.float32)
        mesh.corner_normals.foreach_get("vector", loop_normals.ravel())
    finally:
        mesh_object.to_mesh_clear()
    positions = vertices[corners] @ to_world[:3, :3].T + to_world[:3, 3]
    normals = loop_normals[loops] @ np.linalg.pinv(to_world[:3, :3])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    return DrawnMesh(positions.astype(np.float32), normals.astype(np.float32), surface_color(mesh_object))


def surface_color(mesh_object):
    """Linear RGB: base colour of the first material's Principled BSDF, or its colour in the viewport; black of None."""
    if mesh_object is None:
        return (0.0, 0.0, 0.0)
    material = next((slot.material for slot in mesh_object.material_slots if slot.material), None)
    if material is None:
        return (0.8, 0.8, 0.8)
    nodes = material.node_tree.nodes if material.node_tree else ()
    principled = next((node for node in nodes if node.type == "BSDF_PRINCIPLED"), None)
    color = principled.inputs["Base Color"].default_value if principled else material.diffuse_color
    return tuple(color[:3])
