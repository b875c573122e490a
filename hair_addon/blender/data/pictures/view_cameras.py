# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras of the views of a multi-view picture."""


def camera_of_view(blender_scene, camera, view):
    """The camera of a view; also found in a scene's background set, where Blender does not search.

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
