# SPDX-License-Identifier: GPL-3.0-or-later
"""Rendering of a light by Cycles, as a panorama of the light that it sends in all directions."""

import math
import os
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from ...data.pictures import light_panoramas, shader_sockets
from ...host import scene_time
from . import world_panorama

SAMPLES = 2  # per pixel
AREA_SAMPLES = 32  # per pixel, of an area light
_FAR = 1000.0  # radius of the sphere that the light shines on [m], and in sizes of the light
_MARGIN = 0.02  # additional part of the latitudes
_ENERGY = 1e6  # of the light, for pixels of about one

# Settings of a light that Vellus reads beside its nodes, by which Cycles would multiply the panorama.
_PLAIN = {"color": (1.0, 1.0, 1.0), "use_temperature": False, "exposure": 0.0, "energy": _ENERGY, "use_shadow": False}


def render(path, name, matrix, frame, is_coarse, out):
    """Render a light of a .blend, turned and placed by a matrix (4, 4), at a frame into an .npz. Raises `HairError`.

    `lit` (H, W, 3) and `plain` (H, W): radiance of a white sphere around the light with its nodes and without them, in
    directions of the light's own axes, from below to above. A sun lights the sphere through its wall. is_coarse: render
    a small picture in less time.
    """
    light = world_panorama.load(path, "lights", name, Path(out).parent)
    scene, tree = bpy.context.scene, light.node_tree
    for setting, value in _PLAIN.items():
        setattr(light, setting, value)
    world_panorama.replace_light_paths(tree, set())
    _replace_falloffs(tree)
    _add_lamp(scene, light, Matrix(matrix))
    pixels = {"SPOT": light_panoramas.SIZE, "AREA": light_panoramas.AREA_SIZE}.get(
        light.type, light_panoramas.WIDE_SIZE
    )
    pixels = light_panoramas.COARSE_SIZE if is_coarse else pixels
    world_panorama.set_up(scene, AREA_SAMPLES if light.type == "AREA" else SAMPLES, pixels)
    scene.cycles.max_bounces = 0
    # The light shines into the lower latitudes. The others stay black.
    scene.render.use_border, scene.render.use_crop_to_border = True, False
    scene.render.border_min_x, scene.render.border_max_x = 0.0, 1.0
    scene.render.border_min_y, scene.render.border_max_y = 0.0, _lit_part(light)
    scene_time.go_to_time(scene, frame)
    part = Path(out).with_suffix(".part.exr")
    lit = world_panorama.picture(scene, part)
    _replace_nodes(tree)
    plain = world_panorama.picture(scene, part)
    np.savez(part.with_suffix(".npz"), lit=lit, plain=plain.mean(axis=-1))
    part.unlink()
    os.replace(part.with_suffix(".npz"), out)


def _add_lamp(scene, light, matrix):
    """Add a lamp to a scene at a matrix (4, 4), with a camera in the same place and a white sphere around both."""
    lamp = bpy.data.objects.new("Light", light)
    scene.collection.objects.link(lamp)
    lamp.matrix_world = matrix
    camera = world_panorama.add_camera(scene)
    camera.matrix_world = matrix @ camera.rotation_euler.to_matrix().to_4x4()
    size = max(getattr(light, one, 0.0) for one in ("shadow_soft_size", "size", "size_y"))
    camera.data.clip_end = 10.0 * _add_sphere(_FAR * max(1.0, size), matrix.translation)


def _replace_nodes(tree):
    """Replace the nodes of a light with plain emission."""
    emission = tree.nodes.new("ShaderNodeEmission")
    emission.inputs["Strength"].default_value = 1.0
    tree.links.new(emission.outputs[0], tree.get_output_node("ALL").inputs["Surface"])


def _lit_part(light):
    """Return the part of all latitudes, counted from below, that a light can reach."""
    half = {"SPOT": 0.5 * getattr(light, "spot_size", 0.0), "AREA": 0.5 * math.pi}.get(light.type, math.pi)
    return min(half / math.pi + _MARGIN, 1.0)


def _add_sphere(radius, center):
    """Add a white sphere; returns its radius."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=96, ring_count=48, radius=radius, location=center)
    mesh = bpy.context.object.data
    mesh.shade_smooth()
    material = bpy.data.materials.new("White")
    material.node_tree.nodes.clear()
    output = material.node_tree.nodes.new("ShaderNodeOutputMaterial")
    diffuse = material.node_tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = 1.0, 1.0, 1.0, 1.0
    material.node_tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    mesh.materials.append(material)
    return radius


def _replace_falloffs(tree):
    """Let nodes read the strength of Light Falloff nodes: a panorama has no distances."""
    for found in list(shader_sockets.nodes_of(tree)):
        if found.type != "LIGHT_FALLOFF":
            continue
        owner, strength = found.node.id_data, found.node.inputs["Strength"]
        link = next(iter(strength.links), None)
        for target in [one.to_socket for output in found.node.outputs for one in output.links]:
            source = link.from_socket if link else owner.nodes.new("ShaderNodeValue").outputs[0]
            if not link:
                source.default_value = strength.default_value
            owner.links.new(source, target)
