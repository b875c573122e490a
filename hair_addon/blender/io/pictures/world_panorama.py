# SPDX-License-Identifier: GPL-3.0-or-later
"""Rendering of a world by Cycles, as a panorama of all directions."""

import math
import os
from pathlib import Path

import bpy

from ....core.errors import HairError, cause_of
from ...data.pictures import shader_sockets, unsaved_images
from ...host import scene_time

SIZE = 1024, 512  # pixels of a third of a degree: the sun's disk is half a degree wide
SAMPLES = 4  # per pixel
SUN_SAMPLES = 16  # per pixel, if a Sky Texture shows the sun: its disk covers two pixels

# Values of the Light Path node for light that hair scatters.
_LIGHT_PATH = {"Is Camera Ray": 0.0, "Is Diffuse Ray": 1.0, "Is Reflection Ray": 1.0, "Ray Depth": 1.0}


def render(path, name, frame, out):
    """Render a world of a .blend at a frame into an .exr. Raises `HairError`.

    The picture is the radiance from all directions, in the projection of the Environment Texture node.
    """
    try:
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        with bpy.data.libraries.load(str(path)) as (_found, wanted):
            wanted.worlds = [name]
        unsaved_images.restore(Path(out).parent)
        scene = bpy.context.scene
        (scene.world,) = filter(None, wanted.worlds)
        scene.render.engine = "CYCLES"
    except (OSError, RuntimeError, TypeError, ValueError) as error:
        raise HairError(f"{path} cannot be rendered: {cause_of(error)}.") from error
    replace_light_paths(scene.world.node_tree, set())
    add_camera(scene)
    set_up(scene, SUN_SAMPLES if _has_sun(scene.world.node_tree) else SAMPLES)
    scene_time.go_to_time(scene, frame)
    out = Path(out)
    scene.render.filepath = str(out.with_suffix(".part.exr"))
    bpy.ops.render.render(write_still=True)
    os.replace(scene.render.filepath, out)


def add_camera(scene):
    """Add a camera of all directions at the origin, looking along +x, and return its object."""
    camera = bpy.data.cameras.new("Panorama")
    camera.type, camera.panorama_type = "PANO", "EQUIRECTANGULAR"
    scene.camera = bpy.data.objects.new("Panorama", camera)
    scene.camera.rotation_euler = 0.5 * math.pi, 0.0, -0.5 * math.pi  # z up
    scene.collection.objects.link(scene.camera)
    return scene.camera


def _has_sun(tree):
    """Return whether a Sky Texture shows the disk of its sun."""
    skies = [one.node for one in shader_sockets.nodes_of(tree) if one.type == "TEX_SKY"]
    return any(sky.sun_disc and sky.sky_type.endswith("SCATTERING") for sky in skies)


def set_up(scene, samples, size=SIZE):
    """Set a scene's picture: linear EXR of all light, with `samples` and without filters."""
    cycles, render = scene.cycles, scene.render
    cycles.device, cycles.samples = "CPU", samples
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"  # so that pixels receive all light of the sun
    (render.resolution_x, render.resolution_y), render.resolution_percentage = size, 100
    render.film_transparent = render.use_motion_blur = render.use_compositing = render.use_sequencer = False
    picture = render.image_settings
    picture.file_format, picture.color_depth, picture.exr_codec = "OPEN_EXR", "32", "ZIP"


def replace_light_paths(tree, known):
    """Let nodes read constants in place of Light Path nodes; known: trees that are done."""
    if tree is None or tree.name in known:
        return
    known.add(tree.name)
    for node in list(tree.nodes):
        if node.type == "GROUP":
            replace_light_paths(node.node_tree, known)
        if node.type != "LIGHT_PATH":
            continue
        for output in node.outputs:
            value = tree.nodes.new("ShaderNodeValue")
            value.outputs[0].default_value = _LIGHT_PATH.get(output.name, 0.0)
            for link in list(output.links):
                tree.links.new(value.outputs[0], link.to_socket)
