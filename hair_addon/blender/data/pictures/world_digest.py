# SPDX-License-Identifier: GPL-3.0-or-later
"""A digest of the nodes of a world, a light or a material: equal for those that look the same."""

import hashlib
from pathlib import Path

import bpy

from . import unsaved_images

_DEEPEST = 12  # maximum depth of nested settings
_LAYOUT = {"rna_type", "name", "label", "is_active_output", "debug_zone_body_lazy_function_graph"}


def digest_of(world):
    """Return a digest of the nodes, settings, groups and images of a world, light or material, evaluated or not."""
    return hashlib.blake2b(repr(_of_tree(world.node_tree, ())).encode("utf-8", "replace"), digest_size=16).hexdigest()


def settings_of(mesh_object):
    """Return what nodes of materials read of an object: place, name, color, pass index, and custom properties."""
    own = [(key, _of_value(value, (), 0)) for key, value in sorted(mesh_object.items())]
    matrix = [tuple(row) for row in mesh_object.matrix_world]
    return matrix, mesh_object.name, tuple(mesh_object.color), mesh_object.pass_index, own


def _of_tree(tree, above):
    """Nodes and links of a tree, sorted, as a click on a node changes their order.

    above: names of the trees that contain it, as a damaged file may be circular.
    """
    if tree is None or tree.name in above:
        return None
    nodes = [(node.name, node.bl_idname, node.mute, _of_node(node, (*above, tree.name))) for node in tree.nodes]
    links = [
        (link.from_node.name, link.from_socket.identifier, link.to_node.name, link.to_socket.identifier, link.is_muted)
        for link in tree.links
    ]
    return sorted(nodes, key=lambda node: node[0]), sorted(links)


def _of_node(node, above):
    shared = bpy.types.Node.bl_rna.properties
    own = [name for name in node.bl_rna.properties.keys() if name not in shared]
    values = [(name, _of_value(getattr(node, name), above, 0)) for name in own if name not in _LAYOUT]
    sockets = [
        (socket.identifier, _of_value(socket.default_value, above, 0))
        for socket in (*node.inputs, *node.outputs)
        if hasattr(socket, "default_value")
    ]
    if node.type == "TEX_IES" and node.mode == "EXTERNAL":
        values.append(_of_file(Path(bpy.path.abspath(node.filepath, library=node.id_data.library))))
    return values, sockets, getattr(node, "is_active_output", None)


def _of_value(value, above, depth):
    """Return a setting and its nested values as numbers and text."""
    if value is None or isinstance(value, (bool, int, float, str, bytes)):
        return value
    if isinstance(value, (set, frozenset)):
        return sorted(value)
    if isinstance(value, bpy.types.NodeTree):
        return _of_tree(value, above)
    if isinstance(value, bpy.types.Image):
        return _of_image(value)
    if isinstance(value, bpy.types.Object):
        return value.name, [tuple(row) for row in value.matrix_world]
    if isinstance(value, bpy.types.Text):
        return value.as_string()
    if isinstance(value, bpy.types.ID):
        return type(value).__name__, value.name
    if depth > _DEEPEST:
        return None
    if isinstance(value, bpy.types.bpy_struct):
        names = [name for name in value.bl_rna.properties.keys() if name not in _LAYOUT]
        return [(name, _of_value(getattr(value, name), above, depth + 1)) for name in names]
    try:
        return [_of_value(item, above, depth + 1) for item in value]
    except TypeError:  # functions of nodes and sockets
        return None


def _of_image(image):
    unsaved = unsaved_images.digest_of(image)
    described = image.source, image.colorspace_settings.name, image.alpha_mode, *image.size, unsaved
    if image.packed_file is not None:
        return *described, hashlib.blake2b(image.packed_file.data, digest_size=16).hexdigest()
    if image.source == "GENERATED":
        return *described, image.generated_type, tuple(image.generated_color)
    return *described, *_of_file(Path(bpy.path.abspath(image.filepath, library=image.library)))


def _of_file(path):
    try:
        status = path.stat()
    except OSError:
        return (str(path),)
    return str(path), status.st_mtime_ns, status.st_size
