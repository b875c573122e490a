# SPDX-License-Identifier: GPL-3.0-or-later
"""Depth of field: Blender's camera settings → `Lens`."""

import numpy as np

from ....core.imaging.thin_lens import Lens

_LEAST = 1e-5  # minimum of an f-stop and of a distance [m], as in Blender


def read_lens(scene, depsgraph, camera=None):
    """The `Lens` of a camera, by default the scene's; None if everything is in focus."""
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
