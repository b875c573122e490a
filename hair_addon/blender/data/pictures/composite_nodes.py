# SPDX-License-Identifier: GPL-3.0-or-later
"""Compositor nodes that lay hair of another scene over a scene's render, in the artist's node tree or a new tree.

The nodes stand between a Render Layers node and the targets of its image: they multiply the image by the light that
hair leaves on surfaces, and lay hair over the result. They are identified by their names.
"""

import bpy

from ....core.errors import HairError

_PREFIX = "Vellus "  # of the names of our nodes
_HAIR, _SHADOW, _OVER = "Hair", "Hair Shadow", "Hair Over Surfaces"
_OURS = "is_vellus_composite"  # the custom property of trees created by Vellus

# Type, and location relative to the Render Layers node.
_NODES = {
    _HAIR: ("CompositorNodeRLayers", (0.0, -420.0)),
    _SHADOW: ("ShaderNodeMix", (300.0, 0.0)),
    _OVER: ("CompositorNodeAlphaOver", (500.0, 0.0)),
}


def has_nodes(blender_scene):
    """Whether a scene's compositor has our nodes."""
    tree = blender_scene.compositing_node_group
    return tree is not None and any(_ours(tree))


def have_lost_scene(blender_scene):
    """Whether the hair scene of a scene's compositor was deleted."""
    return any(_is_hair(node) and node.scene is None for node in _ours(blender_scene.compositing_node_group))


def are_of(blender_scene, hair_scene):
    """Whether a scene's node tree composites the render of `hair_scene`, and no other scene uses the tree."""
    tree = blender_scene.compositing_node_group
    return any(_is_hair(node) and node.scene == hair_scene for node in _ours(tree)) and tree.users == 1


def lay_over(blender_scene, hair_scene):
    """Let the nodes of `insert` composite the render of another hair scene."""
    for node in _ours(blender_scene.compositing_node_group):
        if _is_hair(node):
            node.scene = hair_scene


def insert(blender_scene, hair_scene):
    """Composite the render of `hair_scene` over a scene's render. Raises `HairError`."""
    tree = blender_scene.compositing_node_group
    if tree is None:
        tree = blender_scene.compositing_node_group = _new_tree(blender_scene)
    if tree.library is not None:
        raise HairError("The compositor's node tree is linked from another file: make it local.")
    rendered = _rendered(tree, blender_scene)
    targets = [link.to_socket for link in rendered.outputs["Image"].links]
    nodes = {name: _new_node(tree, name, rendered) for name in _NODES}
    nodes[_HAIR].scene = hair_scene
    shadow, over = nodes[_SHADOW], nodes[_OVER]
    shadow.data_type, shadow.blend_type, shadow.clamp_factor = "RGBA", "MULTIPLY", True
    tree.links.new(rendered.outputs["Image"], _input(shadow, "A_Color"))
    tree.links.new(nodes[_HAIR].outputs["Hair Shadow"], _input(shadow, "B_Color"))
    tree.links.new(_output(shadow, "Result_Color"), over.inputs["Background"])
    tree.links.new(nodes[_HAIR].outputs["Image"], over.inputs["Foreground"])
    for target in targets:
        tree.links.new(over.outputs["Image"], target)


def adjust(blender_scene, is_shadowed, is_laid_over):
    """Enable or disable hair's shadow on surfaces, and compositing hair at all, including its render."""
    nodes = {node.name.removeprefix(_PREFIX): node for node in _ours(blender_scene.compositing_node_group)}
    factors = {_SHADOW: ("Factor_Float", is_shadowed and is_laid_over), _OVER: ("Factor", is_laid_over)}
    for name, (socket, is_on) in factors.items():
        if name in nodes and _input(nodes[name], socket).default_value != float(is_on):
            _input(nodes[name], socket).default_value = float(is_on)
    if _HAIR in nodes and nodes[_HAIR].mute == is_laid_over:
        nodes[_HAIR].mute = not is_laid_over


def remove(blender_scene):
    """Remove the nodes of `insert`, and our tree if nothing else was added to it."""
    tree = blender_scene.compositing_node_group
    if tree is None:
        return
    nodes = {node.name.removeprefix(_PREFIX): node for node in _ours(tree)}
    if _OVER in nodes and _SHADOW in nodes:
        for source in [link.from_socket for link in _input(nodes[_SHADOW], "A_Color").links]:
            for target in [link.to_socket for link in nodes[_OVER].outputs["Image"].links]:
                tree.links.new(source, target)
    for node in nodes.values():
        tree.nodes.remove(node)
    kinds = sorted(node.bl_idname for node in tree.nodes)
    if tree.get(_OURS) and kinds == ["CompositorNodeRLayers", "NodeGroupOutput"]:
        blender_scene.compositing_node_group = None
        if not tree.users:
            bpy.data.node_groups.remove(tree)


def _ours(tree):
    return [node for node in tree.nodes if node.name.startswith(_PREFIX)] if tree is not None else []


def _is_hair(node):
    return node.name == _PREFIX + _HAIR


def _rendered(tree, blender_scene):
    """Return the used Render Layers node of a scene; if there are several, the one of `_shown_layer`."""
    layers = [n for n in tree.nodes if n.bl_idname == "CompositorNodeRLayers" and n.scene == blender_scene]
    used = [node for node in layers if node.outputs["Image"].links]
    if not used:
        raise HairError("The compositor does not use the image of this scene's Render Layers: add and link them.")
    return next((node for node in used if node.layer == _shown_layer(blender_scene)), used[0])


def _shown_layer(blender_scene):
    """Return the name of the first view layer that is rendered, or of the first if none is."""
    layers = blender_scene.view_layers
    return next((layer.name for layer in layers if layer.use), layers[0].name)


def _new_tree(blender_scene):
    tree = bpy.data.node_groups.new(f"{blender_scene.name} Hair", "CompositorNodeTree")
    tree[_OURS] = True
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    rendered, output = tree.nodes.new("CompositorNodeRLayers"), tree.nodes.new("NodeGroupOutput")
    rendered.scene, output.location = blender_scene, (700.0, 0.0)
    rendered.layer = _shown_layer(blender_scene)
    tree.links.new(rendered.outputs["Image"], output.inputs["Image"])
    return tree


def _new_node(tree, name, rendered):
    kind, place = _NODES[name]
    node = tree.nodes.new(kind)
    node.name, node.label = _PREFIX + name, name
    node.location = (rendered.location.x + place[0], rendered.location.y + place[1])
    return node


def _input(node, key):
    """Return a socket by its identifier or name: sockets of a Mix node share their names."""
    return next(socket for socket in node.inputs if key in {socket.identifier, socket.name})


def _output(node, key):
    return next(socket for socket in node.outputs if key in {socket.identifier, socket.name})
