# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces and cameras: Blender's data → arrays."""

import hashlib
from dataclasses import dataclass
from functools import cached_property

import bmesh
import bpy
import numpy as np
from mathutils import Matrix

from ...core import geometry
from ...core.errors import HairError
from ...core.geometry.mesh import Faces, TriMesh
from ...core.geometry.texture import Texture
from ..host.notices import can_be_drawn, name_of
from . import subdivided_surfaces

_MOST_CORNERS = 100_000  # of a face: the time to triangulate one grows faster than its corners


@dataclass(frozen=True)
class Surface:
    """A mesh object at rest: world axes and scale [m], with the object's origin at zero.

    So gravity is -Z and lengths are true, and an object far from the world's origin loses no precision. At rest means
    before shape keys and modifiers deform it: hair is generated there, and deformed with the surface
    (surface_deform.py).
    """

    name: str
    mesh: TriMesh
    faces: Faces
    rest: np.ndarray  # (V, 3) float32, vertices at rest in local coordinates
    posed: np.ndarray  # (V, 3) float32, where they are now, in local coordinates
    corner_uvs: np.ndarray | None  # (F, 3, 2) float32, None without a UV map
    uv_map: str
    to_world_axes: np.ndarray  # (3, 3) float64: local coordinates → these
    is_mirrored: bool  # negative scale: triangles are wound the other way than in Blender
    cage_corners: int  # of the faces that modifiers subdivide to a smooth surface, 0 for none
    smooth_rest: np.ndarray  # (V, 3) float32, vertices on the smooth surface at rest; `rest` itself where none is

    @cached_property
    def to_local_axes(self):
        """(3, 3) float64: these coordinates → local ones."""
        return np.linalg.inv(self.to_world_axes)

    def to_local(self, points):
        """(S, P, 3) points of strands → the object's local coordinates, float32."""
        return geometry.transform.transformed(points, self.to_local_axes)

    def from_local(self, positions):
        """Transform (..., 3) local coordinates to this space, float32."""
        return _transformed(positions, self.to_world_axes)

    @property
    def is_deformed(self):
        """Whether shape keys or modifiers deform it."""
        return not np.array_equal(self.rest, self.posed)

    @cached_property
    def posed_mesh(self):
        """The deformed `TriMesh`, with modifiers and shape keys, whose size the artist sees."""
        return TriMesh(self.from_local(self.posed), self.mesh.triangles) if self.is_deformed else self.mesh

    def is_at_rest_as(self, other):
        """Whether strands generated on one also fit the other."""
        mine, its = ((s.rest, s.mesh.triangles, s.to_world_axes) for s in (self, other))
        return self.cage_corners == other.cage_corners and all(map(np.array_equal, mine, its))

    def is_same(self, other):
        """Whether another surface equals this one, so that cached results are valid."""
        mine, its = (
            (s.rest, s.posed, s.mesh.triangles, s.faces.corner_vertices, s.faces.starts, s.to_world_axes, s.corner_uvs)
            for s in (self, other)
        )
        named = [(s.name, s.uv_map, s.cage_corners) for s in (self, other)]
        return named[0] == named[1] and all(map(np.array_equal, mine, its))

    @property
    def mirror_normal(self):
        """(3,) unit: of the plane across the object's own X axis."""
        normal = self.to_local_axes[0]
        return normal / np.linalg.norm(normal)

    @cached_property
    def shape(self):
        """The `TriMesh` at rest of which `mesh` is a rotated and uniformly scaled copy; None otherwise.

        Roots are placed on it, so that rotation and scale of the object do not move them, not even by rounding,
        which relaxation would amplify.
        """
        axes = self.to_world_axes
        squares = axes.T @ axes
        if not np.allclose(squares, np.eye(3) * np.trace(squares) / 3.0, rtol=0.0, atol=1e-5 * np.trace(squares)):
            return None
        # A mirrored object's triangles are wound the other way, as those of the rest mirrored at its origin are.
        return TriMesh(-self.rest if self.is_mirrored else self.rest, self.mesh.triangles)

    def root_vertices(self, points):
        """(N, 3) int32: the vertices that surface points lie between, in Blender's order of corners."""
        vertices = self.mesh.triangles[points.triangle]
        return np.ascontiguousarray(vertices[:, [0, 2, 1]]) if self.is_mirrored else vertices

    def places(self, points):
        """(N, 3) int32 vertices and (N, 3) float32 barycentric coordinates of points, in Blender's order of corners."""
        return self.root_vertices(points), self.swap_winding(points).barycentric

    @property
    def scale(self):
        """The mean scale of the object: metres in a unit of its local coordinates."""
        return abs(np.linalg.det(self.to_world_axes)) ** (1.0 / 3.0)

    @cached_property
    def extent(self):
        """The longest side of the box around its vertices at rest, in local coordinates."""
        return float(np.ptp(self.rest, axis=0).max())

    @cached_property
    def topology(self):
        """A key of the triangles and their order; the same for a mirrored mesh."""
        triangles = self.mesh.triangles[:, [0, 2, 1]] if self.is_mirrored else self.mesh.triangles
        return hashlib.blake2b(triangles.tobytes(), digest_size=16).hexdigest()

    def to_local_normals(self, normals):
        """(N, 3) unit normals → unit normals in local coordinates: the inverse transpose of `to_local`."""
        if np.array_equal(self.to_world_axes, np.eye(3)):
            return normals
        local = normals @ self.to_world_axes.astype(np.float32)
        return local / np.linalg.norm(local, axis=-1, keepdims=True)

    def identities(self, roots):
        """(S,) int32 identities and (S,) float32 random numbers in [0, 1), independent of the other strands."""

        return geometry.root_frames.identities(self.swap_winding(roots))

    def uvs(self, points):
        """(N, 2) float32 UV coordinates of surface points; zeros without a UV map."""
        if self.corner_uvs is None:
            return np.zeros((len(points), 2), np.float32)
        return np.einsum("nc,ncu->nu", points.barycentric, self.corner_uvs[points.triangle]).astype(np.float32)

    def swap_winding(self, points):
        """The same points with barycentric coordinates in Blender's order of corners, or back."""
        return points.wound_otherwise() if self.is_mirrored else points


def _transformed(positions, matrix):
    """(..., 3) float32 positions by a (3, 3) matrix, float32; the positions themselves where it changes nothing."""
    if np.array_equal(matrix, np.eye(3)):
        return np.asarray(positions, np.float32)
    return np.asarray(positions, np.float32) @ matrix.T.astype(np.float32)


def read_surface(surface_object, depsgraph):
    """The evaluated mesh of an object as a `Surface`. Raises `HairError`."""
    if surface_object.type != "MESH":  # a script may have set it as the surface of Curves
        raise HairError(
            '"{name}" is not a mesh that hair can grow on: attach the hair to a mesh.', name=name_of(surface_object)
        )
    to_world_axes = np.array(surface_object.matrix_world.to_3x3(), np.float64)
    determinant = np.linalg.det(to_world_axes)
    if not np.isfinite(to_world_axes).all() or abs(determinant) < 1e-30:
        raise HairError(f'"{name_of(surface_object)}" has a scale of zero: change its scale.')
    evaluated = surface_object.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        posed = vertex_positions(mesh)
        rest = _rest_positions(mesh, posed)
        faces = faces_of(mesh)
        if rest is not posed and (np.diff(faces.starts) > 3).any():
            # Where polygons are cut depends on where vertices are: triangles are to stay the same in every pose.
            # Written to the attribute, positions would not reach triangles that Blender shares with the evaluated mesh.
            mesh.vertices.foreach_set("co", rest.ravel())
        corners = triangle_corners(mesh, faces, name_of(surface_object))
        triangles = faces.corner_vertices[corners]
        corner_uvs, uv_map = None, ""
        if mesh.uv_layers.active is not None:
            uv_map = name_of(mesh.uv_layers.active)
            uvs = np.empty((len(mesh.loops), 2), np.float32)
            mesh.uv_layers.active.uv.foreach_get("vector", uvs.ravel())
            corner_uvs = uvs[corners]
    finally:
        evaluated.to_mesh_clear()
    cage_corners, smooth_rest = 0, rest
    if rest is not posed and np.isfinite(rest).all():
        cage_corners = subdivided_surfaces.cage_corners(surface_object, depsgraph, faces)
        smooth_rest = subdivided_surfaces.smooth_positions(rest, faces, cage_corners)
    is_mirrored = bool(determinant < 0.0)
    if is_mirrored:
        triangles = np.ascontiguousarray(triangles[:, [0, 2, 1]])
        corner_uvs = None if corner_uvs is None else corner_uvs[:, [0, 2, 1]]
    with np.errstate(invalid="ignore"):  # non-finite values are rejected by the check of the mesh
        smooth = None if smooth_rest is rest else _transformed(smooth_rest, to_world_axes)
        mesh = TriMesh(_transformed(rest, to_world_axes), triangles, smooth)
    return Surface(
        name_of(surface_object),
        mesh,
        faces,
        rest,
        posed,
        corner_uvs,
        uv_map,
        to_world_axes,
        is_mirrored,
        cage_corners,
        smooth_rest,
    )


def read_own_mesh(surface_object, to_world_axes):
    """The `TriMesh` of a mesh object before its modifiers, in the axes and scale of a `Surface`."""
    mesh = surface_object.data
    faces = faces_of(mesh)
    triangles = faces.corner_vertices[triangle_corners(mesh, faces, name_of(surface_object))]
    return TriMesh(_transformed(vertex_positions(mesh), to_world_axes), triangles)


def present_depsgraph():
    """The dependency graph of the context's scene and view layer, evaluated."""
    return bpy.context.evaluated_depsgraph_get()


def triangle_count(surface_object, view_layer):
    """Return the triangle count of an evaluated mesh object, without reading its geometry."""
    depsgraph = view_layer.depsgraph
    mesh = surface_object.data if depsgraph is None else surface_object.evaluated_get(depsgraph).data
    return len(mesh.loops) - 2 * len(mesh.polygons)


def _rest_positions(mesh, posed):
    """(V, 3) float32 of the attribute that Blender adds before it deforms; where there is none, `posed`."""
    attribute = mesh.attributes.get("rest_position")
    if attribute is None or (attribute.data_type, attribute.domain) != ("FLOAT_VECTOR", "POINT") or not len(posed):
        return posed
    rest = np.empty_like(posed)
    attribute.data.foreach_get("vector", rest.ravel())
    return rest


def faces_of(mesh):
    corner_vertices = np.empty(len(mesh.loops), np.int32)
    if len(corner_vertices):  # two hundred times as fast as by `mesh.loops`
        mesh.attributes[".corner_vert"].data.foreach_get("value", corner_vertices)
    starts = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_start", starts)
    return Faces(corner_vertices, np.append(starts, np.int32(len(corner_vertices))))


def triangle_corners(mesh, faces, name):
    """(F, 3) int32: the corners, in `Faces`, of the triangles that Blender cuts polygons into. Raises `HairError`."""
    if np.diff(faces.starts).max(initial=0) > _MOST_CORNERS:
        sentence = '"{name}" has a face with more than {most} corners: split it into smaller faces.'
        raise HairError(sentence, name=name, most=_MOST_CORNERS)
    mesh.calc_loop_triangles()
    corners = np.empty((len(mesh.loop_triangles), 3), np.int32)
    mesh.loop_triangles.foreach_get("loops", corners.ravel())
    return corners


def vertex_positions(mesh):
    """(V, 3) float32; a mesh without vertices has no attribute of positions either."""
    vertices = np.empty((len(mesh.vertices), 3), np.float32)
    if len(vertices):
        mesh.attributes["position"].data.foreach_get("vector", vertices.ravel())
    return vertices


def evaluated_positions(mesh_object, depsgraph):
    """(V, 3) float32 of an evaluated mesh object, in its own coordinates."""
    evaluated = mesh_object.evaluated_get(depsgraph)
    if "position" in evaluated.data.attributes or not len(evaluated.data.vertices):
        return vertex_positions(evaluated.data)
    try:  # in Edit Mode, where the evaluated mesh has no attributes
        return vertex_positions(evaluated.to_mesh())
    finally:
        evaluated.to_mesh_clear()


def read_vertex_group(surface_object, depsgraph, name):
    """(V,) float32 weights of a vertex group on the evaluated mesh, or None for the empty name."""
    if not name:
        return None
    group = surface_object.vertex_groups.get(name)
    if group is None:
        raise HairError(
            f'"{name_of(surface_object)}" has no vertex group "{name}": pick another group, or clear the field.'
        )
    evaluated = surface_object.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        return weights_in_group(mesh, group.index)
    finally:
        evaluated.to_mesh_clear()


def weights_in_group(mesh, index):
    """(V,) float32. Blender offers no array access to vertex groups; by BMesh it takes a quarter of the time."""
    edited = bmesh.new()
    try:
        edited.from_mesh(mesh, face_normals=False, vertex_normals=False)
        layer = edited.verts.layers.deform.active
        if layer is None:  # no vertex has a weight
            return np.zeros(len(edited.verts), np.float32)
        return np.fromiter((vertex[layer].get(index, 0.0) for vertex in edited.verts), np.float32, len(edited.verts))
    finally:
        edited.free()


def read_texture(surface, name, may_be_black=False):
    """The `Texture` of an image on a `Surface`, the mean of its colours, or None for the empty name."""
    values = read_image(name, may_be_black)
    if values is None:
        return None
    if surface.corner_uvs is None:
        sentence = '"{name}" has no UV map for the density image: create one, or clear the image.'
        raise HairError(sentence, name=name_of(surface))
    return Texture(values, surface.corner_uvs)


def read_image(name, may_be_black=False):
    """(height, width) float32, at least zero, the mean of an image's colours; None for the empty name."""
    if not name:
        return None
    image = bpy.data.images.get(name)
    if image is None:
        raise HairError('There is no image "{name}": pick another image, or clear the field.', name=name)
    width, height = image.size
    if not (width and height and image.channels):
        raise HairError('The image "{name}" has no pixels: reload it, or pick another image.', name=name)
    pixels = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    values = pixels.reshape(height, width, image.channels)[:, :, :3].mean(axis=2)
    if not np.isfinite(values).all():
        raise HairError('The image "{name}" has non-finite pixels: paint over them, or pick another image.', name=name)
    if not (may_be_black or np.any(values > 0.0)):
        raise HairError('The image "{name}" is black: paint white where hair should grow.', name=name)
    return np.maximum(values, 0.0)


def curves_objects(view_layer, kind, viewport=None):
    """The visible objects of a view layer that hold Curves of ours, of the kind GUIDES or HAIR."""
    return [
        o
        for o in view_layer.objects
        if o.type == "CURVES" and o.data.vellus.kind == kind and o.visible_get(view_layer=view_layer, viewport=viewport)
    ]


def read_camera(scene, depsgraph, width, height, camera=None, eye=None):
    """(world to view, view to clip), each (4, 4) float64, of a camera, the scene's own, for a picture of this size.

    eye: (matrix, horizontal shift) of a view of a stereo picture, None: the camera's own.
    """
    camera = camera or scene.camera
    if camera is None:
        raise HairError("The scene has no camera: add one.")
    camera = camera.evaluated_get(depsgraph)
    render = scene.render
    view_to_clip = camera.calc_matrix_camera(
        depsgraph, x=width, y=height, scale_x=render.pixel_aspect_x, scale_y=render.pixel_aspect_y
    )
    to_world, shift = (camera.matrix_world, 0.0) if eye is None else (eye[0], eye[1] - camera.data.shift_x)
    if shift:
        moved = 2.0 * shift * _shift_unit(render, camera.data, width, height) / width  # in clip space
        view_to_clip = Matrix(((1, 0, 0, -moved), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))) @ view_to_clip
    # The scale of a camera object does not affect the view.
    location, rotation, _scale = to_world.decompose()
    view_to_world = rotation.to_matrix().to_4x4()
    view_to_world.translation = location
    if not can_be_drawn(camera, camera.matrix_world, view_to_clip):
        sentence = 'The camera "{name}" has a non-finite transform or lens: correct its values.'
        raise HairError(sentence, name=name_of(camera))
    return np.array(view_to_world.inverted(), np.float64), np.array(view_to_clip, np.float64)


def _shift_unit(render, data, width, height):
    """Pixels of the picture's width in a shift of one: the side of the picture that the sensor fits."""
    wide, high = width * render.pixel_aspect_x, height * render.pixel_aspect_y
    is_horizontal = data.sensor_fit == "HORIZONTAL" or (data.sensor_fit == "AUTO" and wide >= high)
    return width if is_horizontal else high / render.pixel_aspect_x


def picture_size(render):
    """((width, height), (left, bottom, width, height)) of a whole picture and of its render region [pixels].

    render: a scene's `RenderSettings`, which may have a border.
    """
    part = 0.01 * render.resolution_percentage
    width, height = max(int(render.resolution_x * part), 1), max(int(render.resolution_y * part), 1)
    if not render.use_border:
        return (width, height), (0, 0, width, height)
    # As Blender rounds them, in single precision: 43 of 76 parts of 760 pixels are 430, and not 429.
    left, right = (int(np.float32(part) * np.float32(width)) for part in (render.border_min_x, render.border_max_x))
    bottom, top = (int(np.float32(part) * np.float32(height)) for part in (render.border_min_y, render.border_max_y))
    return (width, height), (left, bottom, right - left, top - bottom)
