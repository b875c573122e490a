# SPDX-License-Identifier: GPL-3.0-or-later
"""Sources of shader sockets' values, followed through reroutes, muted nodes and node groups."""

from dataclasses import dataclass

import bpy
import numpy as np

from ....core.imaging import blackbody

LUMINANCE = (0.2126, 0.7152, 0.0722, 0.0)  # Rec. 709, for a color that is read as a number


@dataclass(frozen=True)
class ShaderNode:
    """A node of a shader; groups: the group nodes that contain it, the outermost first."""

    node: bpy.types.Node
    groups: tuple = ()

    @property
    def type(self):
        return self.node.type

    def __getitem__(self, name):
        """Return the `ShaderInput` of a name."""
        return ShaderInput(self.node.inputs[name], self.groups)


@dataclass(frozen=True)
class ShaderInput:
    """An input of a node; groups: as of `ShaderNode`."""

    socket: bpy.types.NodeSocket
    groups: tuple = ()

    def source(self):
        """Return (`ShaderNode`, output) that the socket reads; (None, None) for a constant."""
        _end, node, output = self._followed()
        return node, output

    def constant(self):
        """Return the constant value of the socket, of the socket it is linked to, or of nodes that compute a constant:
        RGB, Value, Math, Blackbody and a quadratic Light Falloff; None for other nodes.
        """
        return self._constant({}, 0)

    def _constant(self, known, depth):
        """Return as `constant`; known: {(`ShaderNode`, output): constant}, of nodes that several inputs read."""
        end, node, output = self._followed()
        own = self.socket.default_value
        if node is None or node.type in {"RGB", "VALUE"}:
            value = (end if node is None else output).default_value
        else:
            if (node, output) not in known:
                known[node, output] = _computed(node, output, known, depth + 1)
            value = known[node, output]
        if value is None:
            return None
        is_color = hasattr(own, "__len__")
        if is_color == hasattr(value, "__len__"):
            return value
        return (value,) * len(own) if is_color else _as_number(value)

    def value(self):
        """Return the constant value; if other nodes compute the value, the socket's default."""
        found = self.constant()
        return self.socket.default_value if found is None else found

    def _followed(self):
        """Return (last socket on the way, the linked `ShaderNode`, its output); None for node and output if none is
        linked.
        """
        socket, groups = self.socket, self.groups
        while (link := _link_of(socket)) is not None:
            node, output = _source_behind(link)
            if node is None:
                break
            if node.type == "GROUP":
                before, groups = _inside(node, output), (*groups, node)
            elif node.type == "GROUP_INPUT" and groups:
                before, groups = _of_identifier(groups[-1].inputs, output), groups[:-1]
            else:
                return socket, ShaderNode(node, groups), output
            if before is None:
                break
            socket = before
        return socket, None, None


def shown_shader(tree, kinds):
    """Return the `ShaderNode` linked to a tree's output, if its type is in `kinds`.

    Else the first node of the first type, or None.
    """
    if tree is None:
        return None
    output = tree.get_output_node("ALL")
    shown = ShaderInput(output.inputs["Surface"]).source()[0] if output else None
    if shown is not None and shown.type in kinds:
        return shown
    return next((node for node in nodes_of(tree) if node.type == next(iter(kinds))), None)


def nodes_of(tree, groups=()):
    """Each `ShaderNode` of a tree and of its groups."""
    for node in tree.nodes:
        yield ShaderNode(node, groups)
        if node.type == "GROUP" and node.node_tree is not None:
            yield from nodes_of(node.node_tree, (*groups, node))


_OPERATIONS = {
    "ADD": lambda a, b: a + b,
    "SUBTRACT": lambda a, b: a - b,
    "MULTIPLY": lambda a, b: a * b,
    "DIVIDE": lambda a, b: a / b if b else 0.0,
    "MINIMUM": min,
    "MAXIMUM": max,
}

_DEEPEST = 50  # nodes that read one another
_LARGEST = 3e38  # of numbers on GPUs


def _computed(found, output, known, depth):
    """Return the constant value of an output of a `ShaderNode` that computes it from constants, or None."""
    node = found.node
    if depth > _DEEPEST:
        return None
    if node.type == "MATH" and node.operation in _OPERATIONS:
        values = [ShaderInput(socket, found.groups)._constant(known, depth) for socket in node.inputs[:2]]
        if None in values:
            return None
        value = _OPERATIONS[node.operation](*values)
        value = min(max(value, 0.0), 1.0) if node.use_clamp else value
        return value if abs(value) < _LARGEST else None
    if node.type == "BLACKBODY":
        temperature = found["Temperature"]._constant(known, depth)
        if temperature is None:
            return None
        return (*map(float, blackbody.blackbody_color(temperature)), 1.0)
    if node.type == "LIGHT_FALLOFF" and output.name == "Quadratic" and found["Smooth"]._constant(known, depth) == 0.0:
        return found["Strength"]._constant(known, depth)
    return None


def _link_of(socket):
    """Return the link that a socket reads; None without one, or if it is part of a cycle."""
    if not socket.is_linked:
        return None
    return next((link for link in socket.links if link.is_valid and not link.is_muted), None)


def _source_behind(link):
    """Return (node, output) that a link comes from, through reroutes and muted nodes.

    (None, None) if these are not linked: they set no value, as in Cycles.
    """
    while link is not None and (link.from_node.mute or link.from_node.type == "REROUTE"):
        before = _passed_on(link.from_node, link.from_socket)
        link = None if before is None else _link_of(before)
    return (None, None) if link is None else (link.from_node, link.from_socket)


def _passed_on(node, output):
    """Return the input that a reroute or a muted node passes on to an output, or None."""
    if node.type == "REROUTE":
        return node.inputs[0]
    return next((link.from_socket for link in node.internal_links if link.to_socket == output), None)


def _inside(group, output):
    """Return the input of a group's output node for an output of the group, or None."""
    nodes = group.node_tree.nodes if group.node_tree else ()
    inside = next((node for node in nodes if node.type == "GROUP_OUTPUT" and node.is_active_output), None)
    return None if inside is None else _of_identifier(inside.inputs, output)


def _of_identifier(sockets, other):
    """Return the socket with the identifier of another."""
    return next((socket for socket in sockets if socket.identifier == other.identifier), None)


def _as_number(value):
    """Return a color or a vector as a number, converted as in Blender."""
    return float(np.dot(LUMINANCE, value)) if len(value) == 4 else float(np.mean(value))
