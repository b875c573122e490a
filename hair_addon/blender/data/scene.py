# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces and cameras: Blender's data → arrays."""

from contextlib import contextmanager
from dataclasses import replace

import bmesh
import bpy
import numpy as np
from mathutils import Matrix

from ...core import geometry
from ...core.errors import HairError
from ...core.geometry.faces.uv_maps import Texture
from ...core.geometry.mesh import Faces, TriMesh, interpolate
from ..host import scene_time
from ..host.caches import Cache
from ..host.notices import can_be_drawn, name_of
from . import subdivided_surfaces, surface_readings, surface_space
from .surface_readings import Reading
from .surfaces import cage_of, transformed

_MOST_CORNERS = 100_000  # of a face: the time to triangulate a face grows faster than its number of corners

# session_uid of a mesh object → last read (`Faces`, `_partition` of its corners).
faces_cache = Cache(capacity=64)

_read_once = None  # {(function, session_uid, counts of a mesh): its result} in `meshes_read_once`

_OF_CORNERS = {".corner_vert": "vertex_index", ".corner_edge": "edge_index"}  # attributes: properties of `mesh.loops`

# session_uid of a surface → last read (`Reading`, `Surface`, (F, 3) corners of its triangles).
surface_cache = Cache(capacity=16)


def require_scale(surface_object):
    """Raise `HairError` for an object whose scale is zero along an axis."""
    if surface_space.is_flattened(surface_object):
        raise HairError('"{name}" has a scale of zero: change its scale.', name=name_of(surface_object))


def read_surface(surface_object, depsgraph, has_uvs=True):
    """Return the evaluated mesh of an object as a `Surface`. Raises `HairError`, also for None, a deleted surface.

    has_uvs: whether UVs are needed; else the surface may have none. They take as long to read and to compare as the
    rest of a pose.
    """
    if surface_object is None:
        raise HairError("The surface is missing: pick a mesh.")
    if surface_object.type != "MESH":  # a script may have set it as the surface of Curves
        raise HairError(
            '"{name}" is not a mesh that hair can grow on: attach the hair to a mesh.', name=name_of(surface_object)
        )
    require_scale(surface_object)
    to_world_axes = np.array(surface_object.matrix_world.to_3x3(), np.float64)
    evaluated, known = surface_object.evaluated_get(depsgraph), surface_cache.get(surface_object.session_uid)
    mesh = evaluated.to_mesh()
    try:
        posed = cached_positions(surface_object, mesh)
        rest = _rest_positions(mesh, posed)
        faces = cached_faces(surface_object, mesh)
        if has_uvs or known is None:
            uv_map, loop_uvs = _loop_uvs(mesh)
        else:
            uv_map, loop_uvs = known[0].uv_map, known[0].loop_uvs
        is_turned = surface_space.is_turned(surface_object)
        is_divided = rest is not posed and subdivided_surfaces.is_divided(surface_object)
        read = Reading(
            *(name_of(surface_object), rest, faces, uv_map, loop_uvs, to_world_axes),
            *(rest is not posed, is_turned, is_divided, is_divided and surface_object.data.is_editmode),
        )
        undivided = subdivided_surfaces.undivided_corners(surface_object, depsgraph, faces)
        if known is None or not known[0].is_same(read) or known[1].undivided_corners != undivided:
            if read.has_rest and (np.diff(faces.starts) > 3).any():
                # The triangulation of polygons depends on vertex positions, and must be the same in every pose. Writing
                # to the attribute instead would not update triangles that Blender shares with the evaluated mesh.
                mesh.vertices.foreach_set("co", rest.ravel())
            if known is not None and not has_uvs:
                uv_map, loop_uvs = _loop_uvs(mesh)
                read = replace(read, uv_map=uv_map, loop_uvs=loop_uvs)
            corners = triangle_corners(mesh, faces, read.name)
            if is_turned:
                corners = surface_readings.turned_back(corners, faces, undivided)
            known = None
    finally:
        evaluated.to_mesh_clear()
    cage_corners = 0
    if read.has_rest and np.isfinite(rest).all():
        cage_corners = subdivided_surfaces.cage_corners(surface_object, depsgraph, faces)
    if known is not None and known[1].cage_corners == cage_corners:
        return known[1].posed_at(posed if read.has_rest else known[1].rest, has_uvs)
    if known is not None:
        if not has_uvs:
            return read_surface(surface_object, depsgraph)
        corners = known[2]
    own = _own_mesh(surface_object, uv_map) if is_divided else None
    surface = surface_readings.surface_of(read, posed, corners, cage_corners, undivided, own)
    surface_cache.keep(surface_object.session_uid, (read, surface, corners))
    return surface


def _loop_uvs(mesh):
    """Return (name of the active UV map, (C, 2) float32 of the mesh's corners); ("", None) without one."""
    layer = mesh.uv_layers.active
    if layer is None:
        return "", None
    uvs = np.empty((len(mesh.loops), 2), np.float32)
    layer.uv.foreach_get("vector", uvs.ravel())
    return name_of(layer), uvs


def _own_mesh(surface_object, uv_map):
    """Return (`Faces`, (C, 2) float32 of the UV map or None) of a mesh before its modifiers; None without faces."""
    mesh = surface_object.data
    if not len(mesh.polygons):
        return None
    layer = None if subdivided_surfaces.moves_uvs(surface_object) else mesh.uv_layers.get(uv_map)
    if layer is None or not len(layer.uv):
        return faces_of(mesh), None
    uvs = np.empty((len(mesh.loops), 2), np.float32)
    layer.uv.foreach_get("vector", uvs.ravel())
    return faces_of(mesh), uvs


def read_own_mesh(surface_object, to_world_axes):
    """Return the `TriMesh` of a mesh object before its modifiers, in the axes and scale of a `Surface`."""
    mesh = surface_object.data
    faces = faces_of(mesh)
    triangles = faces.corner_vertices[triangle_corners(mesh, faces, name_of(surface_object))]
    return TriMesh(transformed(vertex_positions(mesh), to_world_axes), triangles)


def shown_surface(surface_object, surface):
    """Return the last read `Surface` of an object if the given surface has the faces of its cage; else the given
    surface.

    Roots that were placed on the cage are stored on it.
    """
    known = None if surface_object is None else surface_cache.get(surface_object.session_uid)
    return known[1] if known is not None and known[1].cage.topology == surface.topology else surface


def present_depsgraph():
    """Return the evaluated dependency graph of the context's scene and view layer. Raises `HairError` within a
    driver.
    """
    with scene_time.outside_drivers():
        return bpy.context.evaluated_depsgraph_get()


def last_depsgraph():
    """Return the dependency graph of the view layer as it is, for functions that handlers call: an update would call
    these.
    """
    return bpy.context.view_layer.depsgraph or present_depsgraph()


def triangle_count(surface_object, view_layer):
    """Return the triangle count of an evaluated mesh object, without reading its geometry."""
    depsgraph = view_layer.depsgraph
    mesh = surface_object.data if depsgraph is None else surface_object.evaluated_get(depsgraph).data
    return len(mesh.loops) - 2 * len(mesh.polygons)


def _rest_positions(mesh, posed):
    """Return (V, 3) float32 of the attribute that Blender stores before modifiers; `posed` without it."""
    attribute = mesh.attributes.get("rest_position")
    if attribute is None or (attribute.data_type, attribute.domain) != ("FLOAT_VECTOR", "POINT") or not len(posed):
        return posed
    rest = np.empty_like(posed)
    attribute.data.foreach_get("vector", rest.ravel())
    return rest


def faces_of(mesh):
    """Return the `Faces` of a mesh."""
    return _faces_of_corners(mesh, corner_values(mesh, ".corner_vert"))


@contextmanager
def meshes_read_once():
    """Context for reading a single evaluation of a dependency graph: `cached_faces` and `cached_positions` read each
    mesh only once.
    """
    global _read_once
    before, _read_once = _read_once, {}
    try:
        yield
    finally:
        _read_once = before


def _once(function, mesh_object, mesh, is_own):
    """Return function(session_uid, mesh); in `meshes_read_once` the first result for the mesh of an object."""
    uid = mesh_object.session_uid
    if _read_once is None or not is_own:
        return function(uid, mesh)
    key = function, uid, len(mesh.vertices), len(mesh.loops), len(mesh.polygons)
    if key not in _read_once:
        _read_once[key] = function(uid, mesh)
    return _read_once[key]


def cached_positions(mesh_object, mesh, is_own=True):
    """`vertex_positions` of the evaluated mesh of an object, which must not be changed; is_own: as in
    `cached_faces`.
    """
    return _once(_positions_of, mesh_object, mesh, is_own)


def _positions_of(_uid, mesh):
    return vertex_positions(mesh)


def cached_faces(mesh_object, mesh, is_own=True):
    """`faces_of` the evaluated mesh of an object; the last read `Faces` of the object if they are the same.

    is_own: whether the mesh is the object's own, not an instance of Geometry Nodes. Reading the starts of polygons is
    the slowest part, so that they are compared by `_partition`.
    """
    return _once(_known_faces, mesh_object, mesh, is_own)


def _known_faces(uid, mesh):
    vertices = corner_values(mesh, ".corner_vert")
    partition, known = _partition(mesh), faces_cache.get(uid)
    if known is not None:
        faces, known_partition = known
        is_as_long = len(faces.starts) == len(mesh.polygons) + 1
        if (
            is_as_long
            and np.array_equal(partition, known_partition)
            and np.array_equal(vertices, faces.corner_vertices)
        ):
            return faces
    faces = _faces_of_corners(mesh, vertices)
    faces_cache.keep(uid, (faces, partition))
    return faces


def _partition(mesh):
    """Return (N,) int32 that are the same for the same number of polygons only if all starts of polygons are the same.

    The polygon of each triangle, as a polygon of n corners has n - 2 triangles. In Edit Mode the edges at corners, as
    the last edge of each polygon leads back to its first vertex.
    """
    if mesh.is_editmode:
        return corner_values(mesh, ".corner_edge")
    polygons = np.empty(len(mesh.loop_triangle_polygons), np.int32)
    mesh.loop_triangle_polygons.foreach_get("value", polygons)
    return polygons


def corner_values(mesh, name):
    """Return (C,) int32 of an attribute that each mesh has; two hundred times as fast as `mesh.loops`.

    In Edit Mode the attributes of a mesh without its modifiers belong to the edited mesh, so corners are read from
    `mesh.loops`.
    """
    values = np.empty(len(mesh.loops), np.int32)
    if mesh.is_editmode:
        mesh.loops.foreach_get(_OF_CORNERS[name], values)
    elif len(values):
        mesh.attributes[name].data.foreach_get("value", values)
    return values


def _faces_of_corners(mesh, corner_vertices):
    starts = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_start", starts)
    return Faces(corner_vertices, np.append(starts, np.int32(len(corner_vertices))))


def triangle_corners(mesh, faces, name):
    """Return (F, 3) int32: corners, in `Faces`, of Blender's triangulation of polygons. Raises `HairError`."""
    if np.diff(faces.starts).max(initial=0) > _MOST_CORNERS:
        sentence = '"{name}" has a face with more than {most} corners: split it into smaller faces.'
        raise HairError(sentence, name=name, most=_MOST_CORNERS)
    mesh.calc_loop_triangles()
    corners = np.empty((len(mesh.loop_triangles), 3), np.int32)
    mesh.loop_triangles.foreach_get("loops", corners.ravel())
    return corners


def vertex_positions(mesh):
    """Return (V, 3) float32; also of a mesh without vertices, which has no position attribute."""
    vertices = np.empty((len(mesh.vertices), 3), np.float32)
    if mesh.is_editmode:
        mesh.vertices.foreach_get("co", vertices.ravel())
    elif len(vertices):
        mesh.attributes["position"].data.foreach_get("vector", vertices.ravel())
    return vertices


def evaluated_positions(mesh_object, depsgraph):
    """Return (V, 3) float32 of an evaluated mesh object, in local coordinates."""
    evaluated = mesh_object.evaluated_get(depsgraph)
    if "position" in evaluated.data.attributes or not len(evaluated.data.vertices):
        return vertex_positions(evaluated.data)
    try:  # in Edit Mode, where the evaluated mesh has no attributes
        return vertex_positions(evaluated.to_mesh())
    finally:
        evaluated.to_mesh_clear()


def read_vertex_group(surface_object, depsgraph, name):
    """Return (V,) float32 weights of a vertex group on the evaluated mesh, or None for an empty name."""
    if not name:
        return None
    group = surface_object.vertex_groups.get(name)
    if group is None:
        sentence = '"{name}" has no vertex group "{group}": pick another group, or clear the field.'
        raise HairError(sentence, name=name_of(surface_object), group=name)
    evaluated = surface_object.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        return weights_in_group(mesh, group.index)
    finally:
        evaluated.to_mesh_clear()


_NUMBERS = {
    "FLOAT": ("value", 1, np.float32),
    "INT": ("value", 1, np.int32),
    "BOOLEAN": ("value", 1, bool),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color", 4, np.float32),
}


def _read_vertex_weights(surface_object, depsgraph, name):
    """`read_vertex_group`, or (V,) float32 of an attribute of numbers or colors, at least 0; None for an empty name."""
    if not name or surface_object.vertex_groups.get(name) is not None:
        return read_vertex_group(surface_object, depsgraph, name)
    evaluated = surface_object.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        attribute = mesh.attributes.get(name)
        if attribute is None or attribute.data_type not in _NUMBERS:
            sentence = '"{name}" has no vertex group or attribute "{group}": pick another, or clear the field.'
            raise HairError(sentence, name=name_of(surface_object), group=name)
        field, width, scalar = _NUMBERS[attribute.data_type]
        values = np.empty(len(attribute.data) * width, scalar)
        attribute.data.foreach_get(field, values)
        means = values.reshape(-1, width)[:, :3].astype(np.float64).mean(axis=1)
        means = np.where(np.isfinite(means), np.maximum(means, 0.0), 0.0)
        return _at_vertices(mesh, attribute.domain, means).astype(np.float32)
    finally:
        evaluated.to_mesh_clear()


def _at_vertices(mesh, domain, values):
    """Return (V,) means of the values (N,) of a domain around each vertex, 0 at vertices without any."""
    if domain == "POINT":
        return values
    if domain == "EDGE":
        vertices, values = np.empty(2 * len(mesh.edges), np.int32), np.repeat(values, 2)
        mesh.edges.foreach_get("vertices", vertices)
    else:
        vertices = np.empty(len(mesh.loops), np.int32)
        mesh.loops.foreach_get("vertex_index", vertices)
        if domain == "FACE":
            sizes = np.empty(len(mesh.polygons), np.int32)
            mesh.polygons.foreach_get("loop_total", sizes)
            values = np.repeat(values, sizes)
    counts = np.bincount(vertices, minlength=len(mesh.vertices))
    return np.bincount(vertices, values, len(mesh.vertices)) / np.maximum(counts, 1)


def read_weights(surface_object, surface, depsgraph, name):
    """`read_vertex_group` for a `Surface` of an object, which may be the cage or at another level of subdivision."""
    return _at_level(surface_object, surface, depsgraph, read_vertex_group(surface_object, depsgraph, name))


def read_density(surface_object, surface, depsgraph, name):
    """`read_weights` of a vertex group, or else of an attribute."""
    return _at_level(surface_object, surface, depsgraph, _read_vertex_weights(surface_object, depsgraph, name))


def _at_level(surface_object, surface, depsgraph, weights):
    """Weights (V,) of an evaluated mesh, or None, at the vertices of its `Surface` at another level of subdivision."""
    if weights is None or len(weights) == len(surface.rest):
        return weights
    present = read_surface(surface_object, depsgraph)
    if present.cage.topology == surface.topology:
        return present.of_cage(weights)
    if cage_of(present.topology) != cage_of(surface.topology):
        return weights
    nearest = geometry.closest_point.SurfaceQuery(present.local_mesh).nearest(surface.rest)
    return interpolate(weights, present.local_mesh, nearest)


def read_cage_weights(surface_object, depsgraph, name):
    """`read_density` at the vertices of a `Surface.of_cage`, the same at every level of subdivision."""
    weights = _read_vertex_weights(surface_object, depsgraph, name)
    return None if weights is None else read_surface(surface_object, depsgraph).of_cage(weights)


def on_surface(surface_object, surface, depsgraph, values, domain):
    """Values of an evaluated mesh on the domain POINT, FACE or CORNER → values of its `Surface`, or of the cage."""
    present = read_surface(surface_object, depsgraph)
    if present.topology == surface.topology or present.cage.topology != surface.topology:
        return values
    if domain == "POINT":
        return present.of_cage(values)
    if domain == "FACE":
        return values[present.divided_of[1]]
    return values[present.faces.corner_vertices < present.cage_size]


def weights_in_group(mesh, index):
    """Return (V,) float32. Blender has no array access to vertex groups; BMesh takes a quarter of the time of
    vertices.
    """
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
    """Return the `Texture` of an image on a `Surface`, the mean of its color channels; None for an empty name."""
    values = read_image(name, may_be_black)
    if values is None:
        return None
    if surface.corner_uvs is None:
        sentence = '"{name}" has no UV map for the density image: create one, or clear the image.'
        raise HairError(sentence, name=name_of(surface))
    return Texture(values, surface.corner_uvs)


def read_image(name, may_be_black=False):
    """Return (height, width) float32, at least zero, the mean of an image's color channels; None for an empty name."""
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
    """Return the visible objects of a view layer with our Curves; kind: GUIDES or HAIR."""
    return [
        o
        for o in view_layer.objects
        if o.type == "CURVES" and o.data.vellus.kind == kind and o.visible_get(view_layer=view_layer, viewport=viewport)
    ]


def read_camera(scene, depsgraph, width, height, camera=None, eye=None):
    """Return (world to view, view to clip), each (4, 4) float64, of a camera, by default the scene's, for a picture
    size.

    eye: (matrix, horizontal shift) of a view of a stereo picture; None: the camera's own. Raises `HairError`.
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
    # The scale of a camera object does not affect the view, but a mirrored camera shows a mirrored picture.
    view_to_world = to_world.to_3x3().normalized().to_4x4()
    view_to_world.translation = to_world.translation
    if not can_be_drawn(camera, camera.matrix_world, view_to_clip):
        sentence = 'The camera "{name}" has a non-finite transform or lens: correct its values.'
        raise HairError(sentence, name=name_of(camera))
    return np.array(view_to_world.inverted(), np.float64), np.array(view_to_clip, np.float64)


def _shift_unit(render, data, width, height):
    """Pixels per unit of shift: the side of the picture that the sensor fits, in pixels of the width."""
    wide, high = width * render.pixel_aspect_x, height * render.pixel_aspect_y
    is_horizontal = data.sensor_fit == "HORIZONTAL" or (data.sensor_fit == "AUTO" and wide >= high)
    return width if is_horizontal else high / render.pixel_aspect_x


def picture_size(render):
    """Return ((width, height), (left, bottom, width, height)) of a full picture and of its render region [pixels].

    render: a scene's `RenderSettings`, which may have a render region.
    """
    part = 0.01 * render.resolution_percentage
    width, height = max(int(render.resolution_x * part), 1), max(int(render.resolution_y * part), 1)
    if not render.use_border:
        return (width, height), (0, 0, width, height)
    # Rounded in single precision, as in Blender: 43 of 76 parts of 760 pixels are 430, and not 429.
    left, right = (int(np.float32(part) * np.float32(width)) for part in (render.border_min_x, render.border_max_x))
    bottom, top = (int(np.float32(part) * np.float32(height)) for part in (render.border_min_y, render.border_max_y))
    return (width, height), (left, bottom, right - left, top - bottom)
