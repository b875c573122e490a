# SPDX-License-Identifier: GPL-3.0-or-later
"""Where sockets of shader nodes take their values: past reroutes and muted nodes, into node groups and out of them."""

from dataclasses import dataclass

import bpy
import numpy as np

LUMINANCE = (0.2126, 0.7152, 0.0722, 0.0)  # Rec. 709: a color that is read as a number


@dataclass(frozen=True)
class ShaderNode:
    """A node of a shader; groups: the group nodes that it stands in, the outermost first."""

    node: bpy.types.Node
    groups: tuple = ()

    @property
    def type(self):
        return self.node.type

    def __getitem__(self, name):
        """The `ShaderInput` of a name."""
        return ShaderInput(self.node.inputs[name], self.groups)


@dataclass(frozen=True)
class ShaderInput:
    """An input of a node; groups: as of `ShaderNode`."""

    socket: bpy.types.NodeSocket
    groups: tuple = ()

    def source(self):
        """(`ShaderNode`, its output) that the socket takes its value from; (None, None) where it is a constant."""
        _end, node, output = self._followed()
        return node, output

    def constant(self):
        """What the socket is set to, or the one that it leads to, or a node of one value; None where others give it."""
        end, node, output = self._followed()
        if node is not None and node.type not in {"RGB", "VALUE"}:
            return None
        value, own = (end if node is None else output).default_value, self.socket.default_value
        is_color = hasattr(own, "__len__")
        if is_color == hasattr(value, "__len__"):
            return value
        return (value,) * len(own) if is_color else _as_number(value)

    def value(self):
        """The same, or where other nodes give it what the socket would be set to without them."""
        found = self.constant()
        return self.socket.default_value if found is None else found

    def _followed(self):
        """(the last socket on the way, the `ShaderNode` that is linked to it, its output, or None for both)."""
        socket, groups = self.socket, self.groups
        while (link := _link_of(socket)) is not None:
            node, output = _past_what_passes_on(link)
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
    """The `ShaderNode` that a tree's output shows, of certain kinds; else the first of its first kind, or None."""
    if tree is None:
        return None
    output = tree.get_output_node("ALL")
    shown = ShaderInput(output.inputs["Surface"]).source()[0] if output else None
    if shown is not None and shown.type in kinds:
        return shown
    return next((node for node in nodes_of(tree) if node.type == next(iter(kinds))), None)


def nodes_of(tree, groups=()):
    """Each `ShaderNode` of a tree, with those of its groups."""
    for node in tree.nodes:
        yield ShaderNode(node, groups)
        if node.type == "GROUP" and node.node_tree is not None:
            yield from nodes_of(node.node_tree, (*groups, node))


def _link_of(socket):
    """The link that a socket takes its value from; None where there is none, or one that leads around in a circle."""
    if not socket.is_linked:
        return None
    return next((link for link in socket.links if link.is_valid and not link.is_muted), None)


def _past_what_passes_on(link):
    """(node, output) that a link comes from, past reroutes and muted nodes.

    (None, None) where nothing leads to these: they set nothing, as in Cycles.
    """
    while link is not None and (link.from_node.mute or link.from_node.type == "REROUTE"):
        before = _passed_on(link.from_node, link.from_socket)
        link = None if before is None else _link_of(before)
    return (None, None) if link is None else (link.from_node, link.from_socket)


def _passed_on(node, output):
    """The input that a reroute, or a muted node, passes on to an output; None without."""
    if node.type == "REROUTE":
        return node.inputs[0]
    return next((link.from_socket for link in node.internal_links if link.to_socket == output), None)


def _inside(group, output):
    """The input of a group's output node that is behind an output of the group; None without."""
    nodes = group.node_tree.nodes if group.node_tree else ()
    inside = next((node for node in nodes if node.type == "GROUP_OUTPUT" and node.is_active_output), None)
    return None if inside is None else _of_identifier(inside.inputs, output)


def _of_identifier(sockets, other):
    """The socket with the identifier of another."""
    return next((socket for socket in sockets if socket.identifier == other.identifier), None)


def _as_number(value):
    """A color, or a vector, as Blender takes it for a number."""
    return float(np.dot(LUMINANCE, value)) if len(value) == 4 else float(np.mean(value))
