# SPDX-License-Identifier: GPL-3.0-or-later
"""Handlers of another add-on that delete reported objects, before or after our handlers: a program, as it may crash."""

import itertools

import bpy
import numpy as np

import hair_addon
from hair_addon import api
from tests.conftest import pytest_configure as use_compiled_kernels

SYSTEM = ("Ball", "Hair", "Guides")


def delete(names):
    """Delete objects and their data."""
    objects = [bpy.data.objects[name] for name in names]
    bpy.data.batch_remove([*objects, *(one.data for one in objects)])


DELETED = ((("Hair",), True), (("Hair", "Guides"), True), (SYSTEM, True), (SYSTEM, False))  # and whether before ours
EVENTS = ("depsgraph_update_post", "frame_change_post")


def walk(event, names, is_before):
    """Delete one of two hair systems in a scene, and check that the other one still works."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    systems = []
    for place in (0.0, 3.0):
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, location=(place, 0.0, 0.0))
        ball = bpy.context.object
        ball.name = "Ball"
        counts = api.GuideSettings(guide_count=6, relax_iterations=0), api.HairSettings(strand_count=20)
        systems.append((ball, *api.add_hair(ball, api.GroomSettings(*counts))))
    bend = systems[1][0].modifiers.new("Bend", "SIMPLE_DEFORM")
    for frame in (1, 2):
        bend.angle = 0.1 * frame
        bend.keyframe_insert("angle", frame=frame)
    bpy.context.view_layer.update()

    def other(_scene, _depsgraph):
        if names and all(name in bpy.data.objects for name in names):
            delete(names)

    handlers = getattr(bpy.app.handlers, event)
    handlers.insert(0, other) if is_before else handlers.append(other)
    try:
        for ball, guides, hair in systems:
            for changed in (ball.data, guides, hair):
                changed.update_tag()
        if event == EVENTS[0]:
            bpy.context.view_layer.update()
        else:
            bpy.context.scene.frame_set(2)
        _memory = [np.ones(1000) for _one in range(100)]  # where what was deleted has been
    finally:
        handlers.remove(other)
    guides, hair = systems[1][1:]
    before = api.points(hair)
    positions = np.empty(3 * len(guides.points), np.float32)
    guides.position_data.foreach_get("vector", positions)
    guides.position_data.foreach_set("vector", positions + np.float32(0.01))
    guides.update_tag()
    bpy.context.view_layer.update()
    assert np.abs(api.points(hair) - before).max() > 1e-3, (event, names, is_before)


def main():
    """Run all deletions at both events."""
    use_compiled_kernels()
    hair_addon.register()
    for event, (names, is_before) in itertools.product(EVENTS, DELETED):
        walk(event, names, is_before)
    print("all went on")


if __name__ == "__main__":
    main()
