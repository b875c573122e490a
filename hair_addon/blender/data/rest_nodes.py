# SPDX-License-Identifier: GPL-3.0-or-later
"""Rest positions of surfaces whose modifiers copy faces.

Blender stores rest positions before it evaluates modifiers, and *Mirror* and *Solidify* copy them unchanged: both
sides of a mirrored head would coincide. Nodes after these modifiers separate them.
"""

import bpy

_NAME = "Vellus Rest Positions"
_MARK = "vellus_rest_version"  # custom property of our node groups
_VERSION = 1
_MIRRORED, _PLACED = "Socket_1", "Socket_2"  # identifiers of the group's inputs

_COPYING = {"MIRROR", "SOLIDIFY"}
_DEFORMING = {
    *("ARMATURE", "CAST", "CLOTH", "CORRECTIVE_SMOOTH", "CURVE", "DISPLACE", "EXPLODE", "FLUID", "HOOK"),
    *("LAPLACIANDEFORM", "LAPLACIANSMOOTH", "LATTICE", "MESH_CACHE", "MESH_DEFORM", "MESH_SEQUENCE_CACHE", "OCEAN"),
    *("SHRINKWRAP", "SIMPLE_DEFORM", "SMOOTH", "SOFT_BODY", "SURFACE_DEFORM", "VOLUME_DISPLACE", "WARP", "WAVE"),
}


def separate_copies(surface_object):
    """Add our nodes after the last modifier that copies faces, or remove them if there is none.

    Returns whether anything was changed. Mirrored faces are separated even if the mesh is deformed before them;
    `lost_copies` are not.
    """
    if surface_object.library is not None:
        return False
    modifiers = surface_object.modifiers
    ours = next((index for index, modifier in enumerate(modifiers) if _is_ours(modifier)), None)
    copying = _copying(surface_object)
    if not copying or lost_copies(surface_object):
        if ours is not None:
            modifiers.remove(modifiers[ours])
        return ours is not None
    after = max(index for index, _modifier in copying)
    is_new = ours is None
    if is_new:
        ours = len(modifiers)
        modifiers.new(_NAME, "NODES").node_group = _group()
    # If our modifier stands before the place, moving it shifts the place by one.
    wanted = after + 1 if ours > after else after
    if ours != wanted:
        modifiers.move(ours, wanted)
    mirrored = _axes(copying)
    inputs = modifiers[wanted].properties.inputs
    values = {_MIRRORED: mirrored or (0.0, 0.0, 0.0), _PLACED: mirrored is None}
    changed = {name: value for name, value in values.items() if _value(inputs, name) != value}
    for name, value in changed.items():
        getattr(inputs, name).value = value
    return is_new or ours != wanted or bool(changed)


def lost_copies(surface_object):
    """Return the modifier whose copies cannot be separated, as the mesh is deformed before it, or None."""
    copying = _copying(surface_object)
    if not copying or _axes(copying) is not None:
        return None
    last, modifier = copying[-1]
    deforming = any(m.type in _DEFORMING and _is_shown(m) for m in list(surface_object.modifiers)[:last])
    return modifier if deforming or surface_object.data.shape_keys is not None else None


def _copying(surface_object):
    """Return [(index, modifier)] that copy faces."""
    return [(index, m) for index, m in enumerate(surface_object.modifiers) if m.type in _COPYING and _is_shown(m)]


def _is_shown(modifier):
    return modifier.show_viewport or modifier.show_render


def _axes(copying):
    """Return (3,) 1.0 for each axis of the object along which modifiers mirror, else 0.0; None if modifiers copy
    otherwise.
    """
    if any(m.type != "MIRROR" or m.mirror_object is not None for _index, m in copying):
        return None
    return tuple(float(any(m.use_axis[axis] for _index, m in copying)) for axis in range(3))


def _value(inputs, name):
    value = getattr(inputs, name).value
    return tuple(value) if hasattr(value, "__len__") else value


def _is_ours(modifier):
    return modifier.type == "NODES" and modifier.node_group is not None and _MARK in modifier.node_group


def _group():
    """Return the node group of this version, created if the file has none.

    The rest position of a mirrored vertex is mirrored too; with *Placed* it is the vertex's position.
    """
    for group in bpy.data.node_groups:
        if group.get(_MARK) == _VERSION and group.library is None and group.bl_idname == "GeometryNodeTree":
            return group
    group = bpy.data.node_groups.new(_NAME, "GeometryNodeTree")
    group[_MARK] = _VERSION
    group.is_modifier = True
    for name, kind in (("Mesh", "Geometry"), ("Mirrored", "Vector"), ("Placed", "Bool")):
        group.interface.new_socket(name, in_out="INPUT", socket_type=f"NodeSocket{kind}")
    group.interface.new_socket("Mesh", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    inputs, output = group.nodes.new("NodeGroupInput").outputs, group.nodes.new("NodeGroupOutput")
    place = group.nodes.new("GeometryNodeInputPosition").outputs[0]
    stored = group.nodes.new("GeometryNodeInputNamedAttribute")
    stored.data_type, stored.inputs["Name"].default_value = "FLOAT_VECTOR", "rest_position"
    rest = stored.outputs["Attribute"]
    beyond = _vector(group, "MULTIPLY", _vector(group, "ABSOLUTE", rest), _vector(group, "SIGN", place))
    moved = _vector(group, "MULTIPLY", _vector(group, "SUBTRACT", beyond, rest), inputs["Mirrored"])
    apart = _switch(group, inputs["Placed"], _vector(group, "ADD", rest, moved), place)
    store = group.nodes.new("GeometryNodeStoreNamedAttribute")
    store.data_type, store.domain, store.inputs["Name"].default_value = "FLOAT_VECTOR", "POINT", "rest_position"
    group.links.new(inputs["Mesh"], store.inputs["Geometry"])
    group.links.new(_switch(group, stored.outputs["Exists"], place, apart), store.inputs["Value"])
    group.links.new(store.outputs["Geometry"], output.inputs["Mesh"])
    return group


def _vector(group, operation, *operands):
    node = group.nodes.new("ShaderNodeVectorMath")
    node.operation = operation
    for index, operand in enumerate(operands):
        group.links.new(operand, node.inputs[index])
    return node.outputs[0]


def _switch(group, is_on, off, on):
    node = group.nodes.new("GeometryNodeSwitch")
    node.input_type = "VECTOR"
    for name, socket in (("Switch", is_on), ("False", off), ("True", on)):
        group.links.new(socket, node.inputs[name])
    return node.outputs[0]
