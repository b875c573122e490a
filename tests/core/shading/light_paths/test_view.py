# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays lead through a part of a picture, by matrices of a graphics API."""

import numpy as np
import pytest
import warp as wp

from hair_addon.core.shading.light_paths import view

wp.set_module_options({"enable_backward": False})


@wp.kernel
def _look(
    seen_in: view.ViewOnDevice,
    places: wp.array[wp.vec3],
    out_beside: wp.array[float],
    out_depth: wp.array[float],
    out_area: wp.array[float],
    out_start: wp.array[float],
):
    place = places[wp.tid()]
    x, y, area = view.seen_at(seen_in, place)
    near, direction = view.ray_at(seen_in, x, y)
    depth = view.depth_at(seen_in, place, direction)
    out_beside[wp.tid()] = wp.length(wp.cross(place - near, direction))
    out_depth[wp.tid()] = depth
    out_area[wp.tid()] = area
    out_start[wp.tid()] = wp.length(place - depth * direction - near)


def camera(rng, is_perspective, near=0.01, far=1000.0):
    """Return ((4, 4) world to clip in single precision, place, axis) of a camera that looks at the origin from 3 m."""
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    axes[2] *= np.sign(np.linalg.det(axes))  # right, up, back
    to_view = np.eye(4)
    to_view[:3, :3], to_view[:3, 3] = axes, [0.0, 0.0, -3.0]
    to_clip = np.diag([2.2, 2.2, -2.0 / (far - near), 1.0])
    to_clip[2, 3] = -(far + near) / (far - near)
    if is_perspective:
        to_clip[2:] = [0, 0, -(far + near) / (far - near), -2.0 * far * near / (far - near)], [0, 0, -1, 0]
    return (to_clip @ to_view).astype(np.float32), 3.0 * axes[2], axes[2]


@pytest.mark.parametrize("is_perspective", [True, False])
def test_rays_meet_the_places_that_they_are_for(rng, is_perspective):
    """Rays hit the places that they are for, to a hundredth of a strand's radius, a few micrometers at 3 m."""
    matrix, eye, back = camera(rng, is_perspective)
    places = rng.uniform(-0.3, 0.3, (500, 3)).astype(np.float32)
    found = [wp.zeros(500, dtype=float) for _ in range(4)]
    given = [view.on_device(view.View(matrix.astype(np.float64))), wp.array(places, dtype=wp.vec3)]
    wp.launch(_look, 500, inputs=given, outputs=found)
    beside, depth, area, start = (values.numpy() for values in found)
    assert beside.max() < 3e-6 and start.max() < 3e-5
    before = (eye - places) @ back  # from the camera, along its axis
    across = np.linalg.norm(eye - places, axis=1) / before if is_perspective else np.ones(500)
    np.testing.assert_allclose(depth, (before - 0.01) * across, rtol=2e-3 if is_perspective else 1e-5)
    # The picture's area of a square meter that faces the ray.
    expected = 2.2**2 / before**2 * across if is_perspective else np.full(500, 2.2**2)
    np.testing.assert_allclose(area, expected, rtol=1e-4)
