# SPDX-License-Identifier: GPL-3.0-or-later
"""The preview of a groom in an asset library: its hair and surface in a separate scene with three lights."""

import math
import tempfile
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

from ...core.imaging.pixel_sampling import PictureSettings
from ..data.made import groom_assets
from . import offscreen

SIZE = 256  # pixels
_SAMPLES_PER_SIDE = 3  # along each side of a pixel
_LENS, _SENSOR = 85.0, 36.0  # [mm]
_VIEW = Vector((0.48, -0.87, 0.10))  # from the hair to the camera: shows the left side of a face towards -Y
_MARGIN = 1.1
# Direction from the hair, power [W] for hair with a radius of one meter, size in radii.
_LIGHTS = (
    ((-0.25, -0.85, 0.65), 550.0, 1.5),
    ((-0.60, 0.65, 0.45), 700.0, 2.0),
    ((0.90, -0.70, 0.20), 220.0, 4.0),
)
_LIGHT_DISTANCE = 6.0  # radii
_WORLD = (0.030, 0.033, 0.038, 1.0)


def draw(hair_object: bpy.types.Object, points: np.ndarray) -> np.ndarray:
    """Return (SIZE, SIZE, 4) float32, sRGB, bottom row first: hair, its surface and meshes parented to the surface.

    points: (N, 3) [m] of the hair in the world. Raises `HairError` if nothing can be drawn.
    """
    with _studio(hair_object, points) as studio, tempfile.TemporaryDirectory() as folder:
        with bpy.context.temp_override(scene=studio, view_layer=studio.view_layers[0]):
            studio.view_layers[0].update()
            settings = PictureSettings(width=SIZE, height=SIZE, samples_per_side=_SAMPLES_PER_SIDE, is_transparent=True)
            pixels = offscreen.draw_picture(settings)
        path = Path(folder) / "picture.png"
        offscreen.write_picture(pixels, path, studio)
        image = bpy.data.images.load(str(path))
        try:
            return groom_assets.read_pixels(image)
        finally:
            bpy.data.images.remove(image)


@contextmanager
def _studio(hair_object, points) -> Generator[bpy.types.Scene]:
    """A temporary scene with the hair, its surface, meshes parented to the surface, a camera and lights."""
    low, high = points.min(axis=0), points.max(axis=0)
    middle, radius = Vector((0.5 * (low + high)).tolist()), 0.5 * float(np.linalg.norm(high - low))
    studio = bpy.data.scenes.new("Vellus picture")
    studio.vellus.multiple_scattering = "DUAL"  # fast, as the groom is being saved
    datablocks = []
    try:
        surface = hair_object.data.surface
        for shown in {hair_object, *_seen(surface)}:
            studio.collection.objects.link(shown)
        camera = bpy.data.cameras.new("Vellus picture")
        camera.lens, camera.sensor_width, camera.clip_start = _LENS, _SENSOR, 0.01 * radius
        distance = _MARGIN * radius / math.sin(math.atan(0.5 * _SENSOR / _LENS))
        camera.clip_end = 3.0 * distance
        datablocks.append(camera)
        studio.camera = _placed(studio, camera, middle, distance * _VIEW.normalized())
        for direction, watts, size in _LIGHTS:
            lamp = bpy.data.lights.new("Vellus picture", "AREA")
            datablocks.append(lamp)
            lamp.energy, lamp.size = watts * radius**2, size * radius
            _placed(studio, lamp, middle, _LIGHT_DISTANCE * radius * Vector(direction).normalized())
        studio.world = bpy.data.worlds.new("Vellus picture")
        datablocks.append(studio.world)
        background = next(node for node in studio.world.node_tree.nodes if node.type == "BACKGROUND")
        background.inputs["Color"].default_value = _WORLD
        yield studio
    finally:
        placed = [o for o in studio.collection.objects if o.data in datablocks]
        bpy.data.batch_remove([studio, *placed, *datablocks])


def _seen(surface):
    """Return a surface and the meshes parented to it, those of them that are rendered."""
    return [o for o in (surface, *surface.children_recursive) if o.type == "MESH" and not o.hide_render]


def _placed(studio, data, middle, away):
    placed = bpy.data.objects.new("Vellus picture", data)
    placed.location = middle + away
    placed.rotation_euler = (-away).to_track_quat("-Z", "Y").to_euler()
    studio.collection.objects.link(placed)
    return placed
