# SPDX-License-Identifier: GPL-3.0-or-later
"""The material of hair for Cycles and EEVEE, from the same settings as the viewport."""

import bpy

from ...core.shading import appearance, strand_looks
from ..data.maps import strand_maps
from ..data.strands import curves as curve_data
from ..host.notices import name_of
from ..settings import properties, setting_properties, shared_wetness
from . import eevee_nodes, node_values, strand_nodes, wet_nodes

HAIR_NODE = "ShaderNodeBsdfHairPrincipled"

_OURS = "is_vellus_hair"  # the custom property of materials created by Vellus


def write_hair_material(curves, is_soon=False):
    """Give Curves a Principled Hair material of their appearance; an artist's material is left alone.

    Looks from maps are stored in the Curves; is_soon: later, by `strand_maps.write_pending`. Returns [`HairError`]
    about missing sources of maps.

    Linked Curves keep their materials: undo does not restore assignments to linked data, so that they would keep a
    deleted material, which crashes Blender.
    """
    if curves.library is not None:
        return []
    looks, errors = strand_maps.write_looks(curves, is_soon)
    slot = next((slot for slot, m in enumerate(curves.materials) if m is not None), None)
    if slot is None:
        material = bpy.data.materials.new(name_of(curves))
        material[_OURS] = True
        _fill_first_slot(curves, material)
        _hair_node(material.node_tree)
    else:
        material = curves.materials[slot]
        if is_hair_material(material) and (material.library or _shows_another_look(material, curves)):
            material = curves.materials[slot] = material.copy()
    if is_hair_material(material) and material.library is None:
        nodes = (n for n in material.node_tree.nodes if n.bl_idname == HAIR_NODE and not wet_nodes.is_ours(n))
        node = next(nodes, None)
        if node is not None:  # otherwise the user has edited it
            look = properties.look_of(curves.vellus)
            is_mapped, is_radial = looks is not None, looks is not None and looks.radial is not None
            if is_mapped or not appearance.strand_settings(look).is_even:
                curve_data.write_randoms(curves)  # older hair lacks this attribute
            if _has_places(curves):
                _fill(node, material, properties.dry_look_of(curves.vellus), is_mapped, is_radial)
                wettest = wet_nodes.write(material.node_tree, node, shared_wetness.of_hair(curves.vellus))
                _fill(wettest, material, look, is_mapped, is_radial)
            else:
                wet_nodes.remove(material.node_tree, node)
                _fill(node, material, look, is_mapped, is_radial)
            _show_mean(material, look, looks)
    return errors


def _show_mean(material, look, looks):
    """Give a material the mean color of strands, for renderers without hair."""
    color = appearance.mean_color(look) if looks is None else strand_looks.mean_color(look, looks)
    node_values.assign(material, "diffuse_color", (*color, 1.0))


def _has_places(curves):
    """Whether strands differ in wetness."""
    least, most = shared_wetness.of_hair(curves.vellus)
    return least < most and curve_data.has_wetness(curves)


def _fill_first_slot(curves, material):
    """Assign a material to the first slot, which renderers use; a removed material leaves it empty."""
    if len(curves.materials):
        curves.materials[0] = material
    else:
        curves.materials.append(material)


def _shows_another_look(material, curves):
    """Whether other hair with a different look uses the same material, as after a duplication."""
    look = _values(curves)
    others = (c for c in bpy.data.hair_curves if c != curves and c.vellus.kind == "HAIR")
    return any(material in {*c.materials} and _values(c) != look for c in others)


def _values(curves):
    state = curves.vellus
    values = setting_properties.values_of(state.appearance, setting_properties.names_of(appearance.Appearance))
    values["has_looks"] = strand_maps.has(curves), strand_maps.has_radial(curves)
    least, most = shared_wetness.of_hair(state)
    return values | {"wetness": (least if curve_data.has_wetness(curves) else most, most)}


def is_hair_material(material):
    """Whether a material was created by Vellus."""
    return bool(material.get(_OURS))


def _hair_node(tree):
    tree.nodes.clear()
    node = tree.nodes.new(HAIR_NODE)
    node.model = "CHIANG"
    node.parametrization = "ABSORPTION"
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    output.location.x = 300.0
    tree.links.new(node.outputs["BSDF"], output.inputs["Surface"])


def _fill(node, material, look, is_mapped=False, is_radial=False):
    color = (*appearance.mean_color(look), 1.0)
    # By identifier: sockets that the node's parametrization disables cannot be looked up by name.
    sockets = {socket.identifier: socket for socket in node.inputs}
    # The color is for renderers without hair, such as Blender's viewport shading.
    for name, value in {**appearance.principled_sockets(look), "Color": color}.items():
        node_values.assign(sockets[name], "default_value", value)
    variation, varied_color = appearance.strand_settings(look), None
    if variation.is_even and not is_mapped:
        strand_nodes.remove(material.node_tree)
    else:
        falloff = eevee_nodes.falloff_of(look)
        varied_color = strand_nodes.write(material.node_tree, node, variation, falloff, is_mapped, is_radial)
    eevee_nodes.write(material.node_tree, node, look, varied_color)
