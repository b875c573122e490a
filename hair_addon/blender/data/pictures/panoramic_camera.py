# SPDX-License-Identifier: GPL-3.0-or-later
"""Panoramic cameras: Blender's camera settings → `Panorama`."""

import numpy as np

from ....core import imaging
from ....core.errors import HairError
from ...host.notices import name_of


def is_panoramic(camera):
    """Whether an object is a panoramic camera."""
    return camera.type == "CAMERA" and camera.data.type == "PANO"


def read_panorama(blender_scene, camera, size, shift_x=None):
    """The `Panorama` of an evaluated camera for a picture of this size [pixels]; None if it is not panoramic.

    shift_x: replaces the camera's value. Raises `HairError`.
    """
    if not is_panoramic(camera):
        return None
    data = camera.data
    panorama = imaging.panorama.Panorama(
        data.panorama_type,
        (data.shift_x if shift_x is None else shift_x, data.shift_y),
        _sensor(data, blender_scene.render, size),
        data.fisheye_fov,
        data.fisheye_lens,
        (data.latitude_min, data.latitude_max),
        (data.longitude_min, data.longitude_max),
        tuple(getattr(data, f"fisheye_polynomial_k{power}") for power in range(5)),
        _cylinder(data),
    )
    values = [panorama.shift, panorama.sensor, panorama.latitudes, panorama.longitudes, panorama.polynomial]
    if not np.isfinite(np.concatenate([*values, panorama.cylinder, (panorama.fov, panorama.lens)])).all():
        sentence = 'The camera "{name}" has a non-finite transform or lens: correct its values.'
        raise HairError(sentence, name=name_of(camera))
    return panorama


def _sensor(data, render, size):
    """(width, height) [mm] of the visible part of the sensor, fitted as in Cycles."""
    width, height = size[0] * render.pixel_aspect_x, size[1] * render.pixel_aspect_y
    is_horizontal = data.sensor_fit == "HORIZONTAL" or (data.sensor_fit == "AUTO" and width > height)
    length = data.sensor_height if data.sensor_fit == "VERTICAL" else data.sensor_width
    return (length, length * height / width) if is_horizontal else (length * width / height, length)


def _cylinder(data):
    """(u_min, u_max) angles [rad] and (v_min, v_max) heights divided by the radius."""
    radius = max(data.central_cylindrical_radius, 1e-9)
    heights = data.central_cylindrical_range_v_min / radius, data.central_cylindrical_range_v_max / radius
    return (data.central_cylindrical_range_u_min, data.central_cylindrical_range_u_max, *heights)
