# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes of lights and of surfaces' materials that Vellus does not read, for sentences in panels and commands."""

from ...host.caches import Cache
from ...host.notices import name_of
from . import surface_materials
from .shader_sockets import ShaderInput

_MOST = 3  # names in a sentence

sentence_cache = Cache()  # session_uid of a scene → `sentences` of it

_OF_LIGHTS = (
    "Nodes of lights have no effect in Vellus, except Color and Strength of an Emission node, as values: {names}."
)
_OF_MATERIALS = (
    "Nodes of materials have no effect on surfaces in Vellus, except a shader's values and image textures: {names}."
)


def shown_sentences(scene):
    """Return `sentences` for a panel, which are found again only after something has changed."""
    return sentence_cache.get(scene.session_uid, lambda: sentences(scene))


def sentences(scene):
    """Return [(sentence, values)] about lights and materials of objects that a scene renders, at most one of each."""
    objects = [one for one in scene.objects if not one.hide_render]
    lights = {one.data for one in objects if one.type == "LIGHT"}
    materials = {slot.material for one in objects if one.type == "MESH" for slot in one.material_slots}
    found = (
        (_OF_LIGHTS, {light: _unread_of(light.node_tree, _inputs_of_light, ()) for light in lights}),
        (
            _OF_MATERIALS,
            {one: _unread_of(one.node_tree, _inputs_of(one), _IMAGES) for one in materials if one is not None},
        ),
    )
    return [(text, {"names": _listed(unread)}) for text, unread in found if any(unread.values())]


_IMAGES = ("TEX_IMAGE", "NORMAL_MAP", "SEPARATE_COLOR")


def _inputs_of_light(shader):
    return ("Color", "Strength") if shader.type == "EMISSION" else None


def _inputs_of(material):
    return lambda shader: surface_materials.inputs_read(shader, material)


def _unread_of(tree, read, textures):
    """Return the labels of the nodes that a tree's output depends on and that are not read.

    read: a function that returns the names of the inputs of a `ShaderNode` that are read, None if the node is not read;
    textures: types of other nodes that are read.
    """
    output = None if tree is None else tree.get_output_node("ALL")
    if output is None:
        return []
    shader = ShaderInput(output.inputs["Surface"]).source()[0]
    if shader is None:
        return []
    names = read(shader)
    if names is None:
        return [shader.node.bl_label]
    return [label for name in names for label in _before(shader[name], textures)]


def _before(shader_input, textures):
    """Return the label of the node that an input reads, unless it is a constant or of types that are read."""
    node = shader_input.source()[0]
    if node is None or node.type in textures or shader_input.constant() is not None:
        return []
    return [node.node.bl_label]


def _listed(unread):
    """Return the names of datablocks with their unread nodes, as text."""
    named = sorted((name_of(one), list(dict.fromkeys(labels))) for one, labels in unread.items() if labels)
    texts = [f'"{name}" ({", ".join(labels)})' for name, labels in named]
    return ", ".join(texts[:_MOST]) + ("…" if len(texts) > _MOST else "")
