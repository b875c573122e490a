# SPDX-License-Identifier: GPL-3.0-or-later
"""API functions that are called in a driver or during a render, where Blender forbids changes, raise one message
each.
"""

import bpy
import pytest

from hair_addon import api
from hair_addon.blender.settings.style_keys import Rearrangement
from tests.support.pictures.rendering import add_orthographic_camera, configure


@pytest.fixture
def catching():
    """Return a function that calls another and stores what it raises in `errors`."""
    errors = []

    def attempt(call):
        try:
            call()
        except Exception as error:
            errors.append(error)
        return 1.0

    attempt.errors = errors
    return attempt


def test_a_driver_that_reads_points_hears_that_the_scene_is_evaluated(hair, catching):
    bpy.app.driver_namespace["hair_reader"] = lambda: catching(lambda: api.points(hair.data))
    hair.driver_add("location", 0).driver.expression = "hair_reader()"
    try:
        bpy.context.view_layer.update()
    finally:
        hair.driver_remove("location")
        del bpy.app.driver_namespace["hair_reader"]
    assert catching.errors and all(isinstance(error, api.HairError) for error in catching.errors)
    assert "not from a driver" in str(catching.errors[0])


def test_a_handler_of_a_render_that_draws_hears_that_blender_has_the_graphics(hair, scene, catching):
    add_orthographic_camera(scene)
    configure(resolution_x=8, resolution_y=8, sample_count=1)

    def listen(*_args):
        catching(lambda: api.draw(width=8, height=8))

    bpy.app.handlers.render_post.append(listen)
    try:
        assert bpy.ops.render.render() == {"FINISHED"}
    finally:
        bpy.app.handlers.render_post.remove(listen)
    (error,) = catching.errors
    assert isinstance(error, api.HairError) and "Drawing is not possible while Blender renders" in str(error)
    assert api.draw(width=8, height=8).shape == (8, 8, 4)


@pytest.mark.parametrize("digits", [4299, 4301, 5000])
def test_a_key_with_an_index_of_any_length_is_of_no_style(digits):
    """A key with an index of any number of digits is no key of a style, as Python refuses to parse very long
    numbers.
    """
    moved = Rearrangement(["Clump", "Curl"], [1, 0], ["Curl", "Clump"])
    path = f"vellus.styles[{'9' * digits}].curl.radius"
    assert moved.path(path) == moved.path_of_target(path) == path
    assert moved.path("vellus.styles[0].curl.radius") == "vellus.styles[1].curl.radius"
