# SPDX-License-Identifier: GPL-3.0-or-later
"""The shutter curve weighs the light of each part of the exposure."""

import bpy
import numpy as np
import pytest

from tests.support.pairs import share_of
from tests.support.pictures.rendering import rendered


def moving_square(scene):
    """Return a white square that crosses the picture during frames 1 and 2, from left to right."""
    bpy.ops.mesh.primitive_plane_add(size=0.3)
    square = bpy.context.object
    for frame, x in ((1, -1.0), (2, 1.0)):
        square.location.x = x
        square.keyframe_insert("location", frame=frame)
    for curve in square.animation_data.action.layers[0].strips[0].channelbags[0].fcurves:
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    bpy.ops.object.light_add(type="SUN", location=(0.0, 0.0, 3.0))
    bpy.ops.object.camera_add(location=(0.0, 0.0, 5.0))
    scene.camera = bpy.context.object
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 3.0
    scene.frame_set(1)


def columns(picture):
    """Return the distribution of a picture's light over 24 groups of its columns."""
    light = picture[..., 0].sum(axis=0).reshape(24, -1).sum(axis=1)
    return light / light.sum()


@pytest.mark.long
@pytest.mark.parametrize("ends", share_of([(1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]))
def test_light_comes_when_the_shutter_is_open_as_in_cycles(scene, tmp_path, ends):
    moving_square(scene)
    mapping = scene.render.motion_blur_shutter_curve
    points = mapping.curves[0].points
    while len(points) > 2:
        points.remove(points[1])
    for point, x, height in zip(points, (0.0, 1.0), ends, strict=True):
        point.location, point.handle_type = (x, height), "VECTOR"
    mapping.update()
    blur = {"use_motion_blur": True, "motion_blur_shutter": 1.0, "motion_blur_position": "START"}
    ours = rendered(tmp_path, film_transparent=True, sample_count=256, motion_steps=64, **blur)["Combined"]
    scene.cycles.samples, scene.cycles.device, scene.cycles.use_denoising = 256, "CPU", False
    theirs = rendered(tmp_path, engine="CYCLES", motion_steps=64, **blur)["Combined"]
    assert np.abs(columns(ours) - columns(theirs)).max() < 0.01
    lean = columns(ours)[12:].sum() - columns(ours)[:12].sum()
    assert lean == pytest.approx(0.5 * (ends[1] - ends[0]), abs=0.06)
