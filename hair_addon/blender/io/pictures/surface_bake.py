# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking of the materials of meshes by Cycles: base color, roughness, metallic and normals as pictures."""

import os
from pathlib import Path

import bpy
import numpy as np

from ....core.errors import HairError, cause_of
from ....core.geometry.faces import face_atlas
from ...data import scene as blender_data
from ...data.pictures import surface_bakes, unsaved_images
from ...data.pictures.shader_sockets import nodes_of
from ...host import scene_time

SIDE = 1024  # texels along a side of a picture; more for meshes with many faces
IMAGE_SIDE = 2048  # the same for materials with images
COARSE_SIDE = 256  # the same for the first pictures in viewports
_MARGIN = 2  # texels
_ATLAS = "vellus_atlas"
_LARGEST = 6e4  # of half floats
_OF_NORMALS = {"BUMP", "NORMAL_MAP", "BEVEL"}

# Shaders that reflect → name of the input with their color, and whether they are metals.
_COLORS = {
    "BSDF_PRINCIPLED": ("Base Color", False),
    "BSDF_DIFFUSE": ("Color", False),
    "BSDF_TRANSLUCENT": ("Color", False),
    "BSDF_TOON": ("Color", False),
    "BSDF_SHEEN": ("Color", False),
    "BSDF_RAY_PORTAL": ("Color", False),
    "SUBSURFACE_SCATTERING": ("Color", False),
    "BSDF_GLOSSY": ("Color", True),
    "BSDF_METALLIC": ("Base Color", True),
}
# Shaders through which the surface is seen, or which emit light.
_OTHERS = {"BSDF_TRANSPARENT": 0.0, "BSDF_GLASS": 0.0, "BSDF_REFRACTION": 0.0, "HOLDOUT": 0.0, "EMISSION": 1.0}


def bake(path, sources, frame, for_render, is_coarse, out):
    """Bake the materials of meshes at a frame into .npz files OUT/0.npz, …; OUT/0.txt, … are the reasons why a mesh
    cannot be baked. Raises `HairError` if files cannot be read.

    sources: (path of the library of a linked object, or "" for the .blend at `path`; name of the object) of each mesh;
    is_coarse: bake small pictures in less time. Modifiers that only deform are turned off, so that patterns stay in
    place on posed surfaces. Each file has `uvs` (C, 2) of the mesh's corners; float16 `color` (H, W, 3), `roughness`,
    `metallic` and `weight` (H, W), which is the opaque part; `normal` (H, W, 3) in tangent space, encoded from 0 to 1,
    empty without nodes of normals.
    """
    try:
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        objects = _loaded(path, sources)
        unsaved_images.restore(Path(path).parent)
        scene = bpy.context.scene
        _set_up(scene)
    except (OSError, RuntimeError, TypeError, ValueError) as error:
        raise HairError(f"{path} cannot be baked: {cause_of(error)}.") from error
    for found in filter(None, objects):
        scene.collection.objects.link(found)
        _rest(found, for_render)
    scene_time.go_to_time(scene, frame)
    for index, found in enumerate(objects):
        try:
            if found is None:
                raise HairError("The file of its library does not contain it.")
            baked = _bake_object(scene, found, is_coarse)
        except (HairError, RuntimeError) as error:  # other objects are still baked
            reason = str(error) if isinstance(error, HairError) else cause_of(error)
            (Path(out) / f"{index}.txt").write_text(reason, "utf-8")
            continue
        made = Path(out) / f"{index}.part.npz"
        with made.open("wb") as file:
            np.savez(file, **baked)
        os.replace(made, Path(out) / f"{index}.npz")


def _loaded(path, sources):
    """Return the object of each source, None if its file does not contain it.

    Linked objects are read from their libraries, as a .blend contains only links to them; local objects first, so that
    their images keep their names for `unsaved_images`.
    """
    found = [None] * len(sources)
    for file in sorted({library for library, _name in sources}):
        places = [index for index, (library, _name) in enumerate(sources) if library == file]
        with bpy.data.libraries.load(file or str(path)) as (_names, wanted):
            wanted.objects = [sources[index][1] for index in places]
        for index, one in zip(places, wanted.objects, strict=True):
            found[index] = one
    return found


def _set_up(scene):
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device, cycles.samples = "CPU", 1
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    settings = scene.render.bake
    settings.margin, settings.margin_type, settings.use_selected_to_active = _MARGIN, "EXTEND", False


_DEFORMING = {
    "ARMATURE", "CAST", "CLOTH", "CORRECTIVE_SMOOTH", "CURVE", "DISPLACE", "HOOK", "LAPLACIANDEFORM", "LAPLACIANSMOOTH",
    "LATTICE", "MESH_DEFORM", "SHRINKWRAP", "SIMPLE_DEFORM", "SMOOTH", "SOFT_BODY", "SURFACE_DEFORM", "WARP", "WAVE",
}  # fmt: skip


def _rest(found, for_render):
    """Turn off shape keys and modifiers that only deform, and set the others as for a render or for a viewport."""
    found.hide_viewport = found.hide_render = False
    found.show_only_shape_key, found.active_shape_key_index = True, 0
    for modifier in found.modifiers:
        if for_render:
            modifier.show_viewport = modifier.show_render
            if modifier.type in {"SUBSURF", "MULTIRES"}:
                modifier.levels = modifier.render_levels
        if modifier.type in _DEFORMING:
            modifier.show_viewport = False


def _bake_object(scene, found, is_coarse):
    """Return {name: array} of the baked materials of an object."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    evaluated = found.evaluated_get(depsgraph)
    mesh = bpy.data.meshes.new_from_object(evaluated, preserve_all_data_layers=True, depsgraph=depsgraph)
    placed = _like(found, mesh, evaluated.matrix_world)
    scene.collection.objects.link(placed)
    for index, slot in enumerate(evaluated.material_slots):
        if index == len(mesh.materials):
            mesh.materials.append(None)
        # Removed and added slots would change the material indices of faces.
        mesh.materials[index] = None if slot.material is None else slot.material.original.copy()
    materials = [material for material in mesh.materials if material is not None]
    has_images = any(node.type == "TEX_IMAGE" for one in materials for node in nodes_of(one.node_tree))
    side = COARSE_SIDE if is_coarse else IMAGE_SIDE if has_images else SIDE
    uvs, side = face_atlas.face_atlas(blender_data.faces_of(mesh), blender_data.vertex_positions(mesh), side)
    if surface_bakes.add_uv_map(mesh, _ATLAS, uvs) is None:
        raise HairError("It has the maximum number of UV maps: remove one.")
    target = bpy.data.images.new("Baked", side, side, float_buffer=True, is_data=True)
    for material in materials:
        texture = material.node_tree.nodes.new("ShaderNodeTexImage")
        texture.image, material.node_tree.nodes.active = target, texture
    baked = {"uvs": uvs, "normal": np.zeros((0, 0, 3), np.float16)}
    with bpy.context.temp_override(active_object=placed, object=placed, selected_objects=[placed]):
        if any(node.type in _OF_NORMALS for one in materials for node in nodes_of(one.node_tree)):
            baked["normal"] = _picture(target, "NORMAL")
        switches, known = [], set()
        for material in materials:
            _emit(material.node_tree, switches, known)
        color = _picture(target, "EMIT").astype(np.float32)
        for switch in switches:
            switch.outputs[0].default_value = 1.0
        measured = _picture(target, "EMIT").astype(np.float32)
    weight = measured[..., 2:]
    measured = measured / np.maximum(weight, 1e-3)
    color = color / np.clip(weight, 1e-3, 1.0)
    surface = {"color": color, "roughness": measured[..., 0], "metallic": measured[..., 1], "weight": weight[..., 0]}
    return baked | {name: values.astype(np.float16) for name, values in surface.items()}


def _like(found, mesh, matrix):
    """Return an object with a mesh and all that Object Info and Attribute nodes read of another object."""
    name, found.name = found.name, "Original"  # Random is a number of the name
    placed = bpy.data.objects.new(name, mesh)
    placed.matrix_world, placed.color, placed.pass_index = matrix, found.color, found.pass_index
    for key, value in found.items():
        placed[key] = value
    return placed


def _picture(target, kind):
    """Return (H, W, 3) float16, the lowest row first, of a bake of the active object into an image."""
    bpy.ops.object.bake(type=kind, margin=_MARGIN, margin_type="EXTEND", use_clear=True, normal_space="TANGENT")
    pixels = np.empty((*target.size[::-1], 4), np.float32)
    target.pixels.foreach_get(pixels.ravel())
    return np.clip(pixels[..., :3], -_LARGEST, _LARGEST).astype(np.float16)


def _emit(tree, switches, known):
    """Replace the shaders of a tree and of its groups by Emission nodes with their color, or with (roughness, metallic,
    1) if the Value nodes that are added to `switches` are 1.
    """
    if tree is None or tree.as_pointer() in known:  # the trees of all materials have the same name
        return
    known.add(tree.as_pointer())
    for node in list(tree.nodes):
        if node.type == "GROUP":
            _emit(node.node_tree, switches, known)
        elif node.type in _COLORS:
            switches.append(_replace(tree, node, *_COLORS[node.type]))
        elif node.type in _OTHERS:
            switches.append(_replace(tree, node, None, False, _OTHERS[node.type]))


def _replace(tree, shader, color, is_metal, weight=1.0):
    """Replace a shader by an Emission node; returns its Value node, which is 0 for the color."""
    new = tree.nodes.new
    emission, mix, measures, switch = map(
        new, ("ShaderNodeEmission", "ShaderNodeMix", "ShaderNodeCombineColor", "ShaderNodeValue")
    )
    mix.data_type = "RGBA"
    sockets = {socket.identifier: socket for socket in (*mix.inputs, *mix.outputs)}
    switch.outputs[0].default_value = 0.0
    _pass_on(tree, shader.inputs.get(color or ""), (0.0, 0.0, 0.0, 1.0), sockets["A_Color"])
    _pass_on(tree, shader.inputs.get("Roughness") if weight and color else None, weight, measures.inputs["Red"])
    _pass_on(tree, shader.inputs.get("Metallic"), float(is_metal), measures.inputs["Green"])
    measures.inputs["Blue"].default_value = weight
    tree.links.new(measures.outputs[0], sockets["B_Color"])
    tree.links.new(switch.outputs[0], sockets["Factor_Float"])
    tree.links.new(sockets["Result_Color"], emission.inputs["Color"])
    for link in list(shader.outputs[0].links):
        tree.links.new(emission.outputs[0], link.to_socket)
    return switch


def _pass_on(tree, source, default, target):
    """Link a socket to what an input is linked to, or copy its value; default: the value without an input."""
    if source is None:
        target.default_value = default
    elif source.is_linked and not source.links[0].is_muted:
        tree.links.new(source.links[0].from_socket, target)
    else:
        target.default_value = source.default_value
