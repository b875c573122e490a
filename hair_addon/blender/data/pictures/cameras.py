# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras of the views of a multi-view picture."""

import numpy as np

from ....core import imaging
from ....core.errors import HairError
from ....core.imaging.thin_lens import Lens
from ...host.notices import name_of

_LEAST = 1e-5  # minimum of an f-stop and of a distance [m], as in Blender


def read_lens(scene, depsgraph, camera=None):
    """Return the `Lens` of a camera, by default the scene's; None if everything is in focus."""
    camera = camera or scene.camera
    if camera is None or camera.type != "CAMERA" or not camera.data.dof.use_dof or camera.data.type == "PANO":
        return None
    camera = camera.evaluated_get(depsgraph)
    depth_of_field = camera.data.dof
    # As in Cycles: with a parallel projection the aperture follows from the f-stop and a focal length of one meter.
    focal_length = 1.0 if camera.data.type == "ORTHO" else 1e-3 * camera.data.lens
    lens = Lens(
        0.5 * focal_length / max(depth_of_field.aperture_fstop, _LEAST),
        max(_focus_distance(camera, depth_of_field), _LEAST),
        depth_of_field.aperture_blades,
        depth_of_field.aperture_rotation,
        depth_of_field.aperture_ratio,
    )
    return lens if np.isfinite([lens.radius, lens.focus_distance]).all() else None


def _focus_distance(camera, depth_of_field):
    """Distance [m] along the view; to the focus object or its bone, if set."""
    focused = depth_of_field.focus_object
    if focused is None:
        return depth_of_field.focus_distance
    place = focused.matrix_world
    bone = focused.pose.bones.get(depth_of_field.focus_subtarget) if focused.pose else None
    if bone is not None:
        place = place @ bone.matrix
    forward = camera.matrix_world.col[2].xyz.normalized()
    return abs(forward.dot(camera.matrix_world.translation - place.translation))


def is_panoramic(camera):
    """Whether an object is a panoramic camera."""
    return camera.type == "CAMERA" and camera.data.type == "PANO"


def read_panorama(blender_scene, camera, size, shift_x=None):
    """Return the `Panorama` of an evaluated camera for a picture of this size [pixels]; None if it is not panoramic.

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
    """Return (width, height) [mm] of the visible part of the sensor, fitted as in Cycles."""
    width, height = size[0] * render.pixel_aspect_x, size[1] * render.pixel_aspect_y
    is_horizontal = data.sensor_fit == "HORIZONTAL" or (data.sensor_fit == "AUTO" and width > height)
    length = data.sensor_height if data.sensor_fit == "VERTICAL" else data.sensor_width
    return (length, length * height / width) if is_horizontal else (length * width / height, length)


def _cylinder(data):
    """Return (u_min, u_max) angles [rad] and (v_min, v_max) heights divided by the radius."""
    radius = max(data.central_cylindrical_radius, 1e-9)
    heights = data.central_cylindrical_range_v_min / radius, data.central_cylindrical_range_v_max / radius
    return (data.central_cylindrical_range_u_min, data.central_cylindrical_range_u_max, *heights)


def camera_of_view(blender_scene, camera, view):
    """Return the camera of a view; also found in a scene's background set, where Blender does not search.

    camera: the camera found by Blender.
    """
    render, background = blender_scene.render, blender_scene.background_set
    if not view or render.views_format != "MULTIVIEW" or background is None:
        return camera
    suffixes = [other.camera_suffix for other in render.views if other.use and other.camera_suffix]
    own = next((suffix for suffix in suffixes if camera.name.endswith(suffix)), None)
    if own is None:
        return camera
    return background.objects.get(camera.name.removesuffix(own) + render.views[view].camera_suffix, camera)
