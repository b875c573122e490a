# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes of lights and of surfaces' materials that Vellus does not read, for sentences in panels and commands."""

from ...host.caches import Cache
from ...host.notices import name_of
from . import surface_materials
from .shader_sockets import ShaderInput, nodes_of

_MOST = 3  # names in a sentence

sentence_cache = Cache()  # session_uid of a scene → `sentences` of it

_OF_LIGHTS = "Cycles renders the light of these nodes as a pattern on hair and surfaces: {names}."
_OF_FALLOFFS = "Light Falloff nodes have the strength of Quadratic without Smooth, at all distances: {names}."
_OF_MATERIALS = "Nodes of these inputs of surface shaders have no effect, only their values: {names}."
_OF_BAKED = "Cycles bakes these nodes of surface materials: {names}."


def shown_sentences(scene):
    """Return `sentences` for a panel, which are found again only after something has changed."""
    return sentence_cache.get(scene.session_uid, lambda: sentences(scene))


def sentences(scene):
    """Return [(sentence, values)] about lights and materials of objects that a scene renders, at most one of each."""
    objects = [one for one in scene.objects if not one.hide_render]
    lights = {one.data for one in objects if one.type == "LIGHT"}
    materials = {slot.material for one in objects if one.type == "MESH" for slot in one.material_slots}
    found = (
        (_OF_LIGHTS, {light: labels_of_light(light) for light in lights}),
        (_OF_FALLOFFS, {light: _falloffs_of(light) for light in lights}),
        (_OF_BAKED, {one: baked_labels(one) for one in materials if one is not None}),
        (_OF_MATERIALS, {one: _unread_values(one) for one in materials if one is not None}),
    )
    return [(text, {"names": _listed(unread)}) for text, unread in found if any(unread.values())]


_BAKED = {"Base Color", "Color", "Roughness", "Metallic", "Normal"}  # inputs of shaders


def baked_labels(material):
    """Return the labels of the nodes that make Cycles bake a material; empty if no bake is needed."""
    shader = None if material is None else _shown(material.node_tree)
    if shader is None or shader.type in _UNBAKED:
        return []
    names = surface_materials.inputs_read(shader, material)
    if names is None:
        return [shader.node.bl_label]
    names = [name for name in names if name in _BAKED and shader.type != "BSDF_GLASS"]
    return [label for name in names for label in _before(shader[name], _reads_picture)]


_UNBAKED = {"HOLDOUT", "EMISSION", "BSDF_HAIR", "BSDF_HAIR_PRINCIPLED"}


def _unread_values(material):
    """Return the labels of the nodes of a material that are neither read nor baked."""
    shader = _shown(material.node_tree)
    names = None if shader is None else surface_materials.inputs_read(shader, material)
    names = [name for name in names or () if name not in _BAKED or shader.type == "BSDF_GLASS"]
    return [label for name in names for label in _before(shader[name], _reads_picture)]


def _reads_picture(shader_input):
    """Whether an input reads an image, also through a Normal Map node."""
    found = shader_input.source()[0]
    if found is not None and found.type == "NORMAL_MAP" and found.node.space == "TANGENT":
        return surface_materials.reads_image(found["Color"]) or found["Color"].constant() is not None
    return surface_materials.reads_image(shader_input)


def labels_of_light(light):
    """Return the labels of the nodes for which Cycles renders a panorama of a light; empty if it is read without."""
    return _unread_of(light.node_tree, _inputs_of_light)


def _falloffs_of(light):
    """Return the labels of nodes by which a light has another falloff than the square of the distance."""
    if light.node_tree is None or not labels_of_light(light):
        return []
    falloffs = [found for found in nodes_of(light.node_tree) if found.type == "LIGHT_FALLOFF"]
    return [found.node.bl_label for found in falloffs if _is_other_falloff(found)]


def _is_other_falloff(found):
    return found["Smooth"].constant() != 0.0 or any(
        output.is_linked for output in found.node.outputs if output.name != "Quadratic"
    )


def _inputs_of_light(shader):
    return ("Color", "Strength") if shader.type == "EMISSION" else None


def _shown(tree):
    """Return the `ShaderNode` that a tree's output shows, or None."""
    output = None if tree is None else tree.get_output_node("ALL")
    return None if output is None else ShaderInput(output.inputs["Surface"]).source()[0]


def _unread_of(tree, read):
    """Return the labels of the nodes that a light's output depends on and that are not read.

    read: a function that returns the names of the inputs of a `ShaderNode` that are read, None if the node is not read.
    """
    shader = _shown(tree)
    if shader is None:
        return []
    names = read(shader)
    if names is None:
        return [shader.node.bl_label]
    return [label for name in names for label in _before(shader[name])]


def _before(shader_input, is_read=lambda _input: False):
    """Return the label of the node that an input reads, unless it is a constant or `is_read` by others."""
    node = shader_input.source()[0]
    if node is None or is_read(shader_input) or shader_input.constant() is not None:
        return []
    return [node.node.bl_label]


def _listed(unread):
    """Return the names of datablocks with their unread nodes, as text."""
    named = sorted((name_of(one), list(dict.fromkeys(labels))) for one, labels in unread.items() if labels)
    texts = [f'"{name}" ({", ".join(labels)})' for name, labels in named]
    return ", ".join(texts[:_MOST]) + ("…" if len(texts) > _MOST else "")
