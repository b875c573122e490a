# SPDX-License-Identifier: GPL-3.0-or-later
"""Rendering of a world by Cycles, as a panorama of all directions."""

import math
import os
from pathlib import Path

import bpy
import numpy as np

from ....core.errors import HairError, cause_of
from ....core.files import light_images
from ...data.pictures import shader_sockets, unsaved_images
from ...host import scene_time

SIZE = 1024, 512  # pixels of a third of a degree: the sun's disk is half a degree wide
COARSE_SIZE = 256, 128  # pixels of the first picture in viewports
SAMPLES = 4  # per pixel
SUN_SAMPLES = 256  # per pixel around the sun of a Sky Texture, whose disk covers two pixels
_AROUND_SUN = 3  # pixels

_NODES = "vellus_nodes"  # property of a scene: digest of the nodes of its world, and the frame

# Values of the Light Path node for light that hair scatters.
_LIGHT_PATH = {"Is Camera Ray": 0.0, "Is Diffuse Ray": 1.0, "Is Reflection Ray": 1.0, "Ray Depth": 1.0}


def render(path, name, digest, frame, is_coarse, out):
    """Render a world of a .blend at a frame into an .exr. Raises `HairError`.

    The picture is the radiance from all directions, in the projection of the Environment Texture node. digest: of the
    world's nodes, as the name may be that of another world in the next job; is_coarse: render a picture of fewer pixels
    or samples in less time.
    """
    out = Path(out)
    scene = bpy.context.scene
    if scene.get(_NODES) != [digest, str(frame)]:
        scene = _opened(path, name, digest, frame, out.parent)
    sun = _size_of_sun(scene.world.node_tree)
    # Few samples of large pixels would miss the sun.
    set_up(scene, 1 if is_coarse else SAMPLES, COARSE_SIZE if is_coarse and sun is None else SIZE)
    part = out.with_suffix(".part.exr")
    colors = picture(scene, part)
    if sun is not None:
        _render_sun(scene, colors, sun, part)
    if not is_coarse:
        scene.render.use_persistent_data = False  # frees the memory of Cycles
        del scene[_NODES]
    light_images.write_colors(part, colors, is_compressed=not is_coarse)
    os.replace(part, out)


def _opened(path, name, digest, frame, folder):
    """Return a new scene with a world of a .blend at a frame, and a camera of all directions.

    Cycles keeps the data of the world for the next picture of the same scene. The table of a Sky Texture takes most of
    the time of a coarse picture.
    """
    world, scene = load(path, "worlds", name, folder), bpy.context.scene
    scene.world = world
    replace_light_paths(scene.world.node_tree, set())
    scene.world.cycles.sampling_method = "NONE"  # the importance map would take most of the time
    add_camera(scene)
    scene_time.go_to_time(scene, frame)
    scene.render.use_persistent_data = True
    scene[_NODES] = [digest, str(frame)]
    return scene


def load(path, kind, name, folder):
    """Open an empty file for Cycles, and return a datablock of a .blend that is loaded into it. Raises `HairError`.

    kind: "worlds" or "lights"; folder: contains unsaved images.
    """
    try:
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        with bpy.data.libraries.load(str(path)) as (_found, wanted):
            setattr(wanted, kind, [name])
        unsaved_images.restore(folder)
        bpy.context.scene.render.engine = "CYCLES"
        (datablock,) = filter(None, getattr(wanted, kind))
        return datablock
    except (OSError, RuntimeError, TypeError, ValueError) as error:
        raise HairError(f"{path} cannot be rendered: {cause_of(error)}.") from error


def picture(scene, path):
    """Render a picture (H, W, 3) float32, bottom row first; path: of the file that is written and read."""
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    return light_images.read_layers(path)[""]


def _render_sun(scene, colors, sun, part):
    """Render the pixels around the brightest one of a picture again with many samples; sun: its diameter [rad]."""
    height, width = colors.shape[:2]
    row, column = np.unravel_index(colors.sum(axis=-1).argmax(), (height, width))
    reach = math.ceil(0.5 * sun * height / math.pi) + _AROUND_SUN
    latitude = math.pi * abs((row + 0.5) / height - 0.5) + reach * math.pi / height
    across = min(math.ceil(reach / max(math.cos(latitude), 1e-3)), width)
    rows = max(row - reach, 0), min(row + reach + 1, height)
    columns = max(column - across, 0), min(column + across + 1, width)
    scene.render.use_border = scene.render.use_crop_to_border = True
    scene.render.border_min_x, scene.render.border_max_x = (edge / width for edge in columns)
    scene.render.border_min_y, scene.render.border_max_y = (edge / height for edge in rows)
    scene.cycles.samples = SUN_SAMPLES
    colors[rows[0] : rows[1], columns[0] : columns[1]] = picture(scene, part)


def add_camera(scene):
    """Add a camera of all directions at the origin, looking along +x, and return its object."""
    camera = bpy.data.cameras.new("Panorama")
    camera.type, camera.panorama_type = "PANO", "EQUIRECTANGULAR"
    scene.camera = bpy.data.objects.new("Panorama", camera)
    scene.camera.rotation_euler = 0.5 * math.pi, 0.0, -0.5 * math.pi  # z up
    scene.collection.objects.link(scene.camera)
    return scene.camera


def _size_of_sun(tree):
    """Return the largest diameter [rad] of the sun disks of Sky Textures; None without a disk."""
    skies = [one.node for one in shader_sockets.nodes_of(tree) if one.type == "TEX_SKY"]
    sizes = [sky.sun_size for sky in skies if sky.sun_disc and sky.sky_type.endswith("SCATTERING")]
    return max(sizes, default=None)


def set_up(scene, samples, size):
    """Set a scene's picture: linear EXR of all light, with `samples` and without filters."""
    cycles, render = scene.cycles, scene.render
    cycles.device, cycles.samples = "CPU", samples
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"  # so that pixels receive all light of the sun
    (render.resolution_x, render.resolution_y), render.resolution_percentage = size, 100
    render.use_border = False
    render.film_transparent = render.use_motion_blur = render.use_compositing = render.use_sequencer = False
    picture = render.image_settings
    picture.file_format, picture.color_depth, picture.exr_codec = "OPEN_EXR", "32", "NONE"


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
