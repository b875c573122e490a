# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene of the pictures of dynamics: the head from behind, shoulder-length hair, guides that simulate.

Motion is a function of time [s] that is keyed in every frame; frames are baked by the operator *Bake Dynamics*.
"""

import math

import bpy
import numpy as np

from blend_samples.heads import head
from blend_samples.sheets import picture_files
from hair_addon import api
from hair_addon.blender.data.strands import curves

RATE = 24  # frames per second
FIRST = 1  # frame
GUIDE_COUNT, STRAND_COUNT = 300, 25_000
SIZE = 330, 400  # pixels of a picture
SAMPLE_COUNT = 9  # of a pixel
CAMERA = (0.86, 1.10, 0.78)  # [m]: from behind, where most of the hair is
SEEN = (0.0, 0.015, 0.665)  # [m]: the middle of pictures
LENS = 72.0  # [mm]
LIGHTS = {"Key": ((1.25, 0.95, 1.25), 44.0), "Rim": ((-1.0, -0.75, 1.35), 12.0), "Fill": ((-0.5, 1.5, 0.7), 7.0)}  # [W]
BROWN = (0.22, 0.46, 0.95)  # absorption per fiber radius
LONGER = 1.25  # than the sample's guides, which then end at the shoulders
STIFFNESS = 20.0  # of bending: softer guides of this length that rise at the parting fall over


def build(strand_count=STRAND_COUNT):
    """The head with hair that simulates, seen from behind; returns the objects of head, guides and hair."""
    skull = head.build()
    guides, hair = head.grow(skull, guide_count=GUIDE_COUNT, strand_count=strand_count)
    api.change_guides(guides, "LENGTH", factor=LONGER)
    head.light()
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = RATE, 1.0
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    see_from(CAMERA, SEEN, LENS)
    for name, (location, watts) in LIGHTS.items():
        lamp = bpy.data.objects[name]
        lamp.location, lamp.data.energy = location, watts
        head.point_at(lamp, SEEN)
    look = hair.data.vellus.appearance
    look.mode, look.absorption, look.roughness, look.random_color = "energy", BROWN, 0.3, 0.2
    hair.data.vellus.hair.radius = 1.1e-4
    api.set_styles(hair, [api.Clump(size=0.02, amount=0.55, levels=2, seed=3), api.Frizz(amplitude=0.0012, seed=4)])
    api.set_dynamics(guides, simulates=True, bend_stiffness=STIFFNESS)
    bpy.context.view_layer.update()
    return skull, guides, hair


def see_from(location, target, lens):
    """Put the camera somewhere, turned to a place."""
    camera = bpy.context.scene.camera
    camera.location, camera.data.lens = location, lens
    camera.data.sensor_fit = "VERTICAL"
    head.point_at(camera, target)


def objects():
    """Return the objects of head, guides and hair in the open file."""
    return tuple(bpy.data.objects[name] for name in ("Head", "Guides", "Hair"))


def time_of(frame):
    """Seconds since the first frame."""
    return (frame - FIRST) / RATE


def turn(skull, axis, angle, last):
    """Key the head's turn about an axis (0, 1, 2) to angle(seconds) in each frame up to the last."""
    for frame in range(FIRST, last + 1):
        skull.rotation_euler[axis] = angle(time_of(frame))
        skull.keyframe_insert("rotation_euler", index=axis, frame=frame)
    bpy.context.scene.frame_set(FIRST)


def shaking(degrees=20.0, rate=3.0, seconds=1.0):
    """Return an angle of time: a shake that begins and ends smoothly."""

    def angle(time):
        strength = np.clip(6.0 * min(time, seconds - time), 0.0, 1.0)
        return math.radians(degrees) * strength * math.sin(2.0 * math.pi * rate * time)

    return angle


def bake(guides, last, folder):
    """Simulate guides from the first to the last frame and write the frames to a folder."""
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = FIRST, last
    guides.data.vellus.cache_folder = str(folder)
    bpy.context.view_layer.objects.active = guides
    bpy.ops.vellus.bake_dynamics(starts_over=True)


def drawn(frame):
    """Return (height, width, 3) uint8: the scene in a frame, the top row first."""
    bpy.context.scene.frame_set(frame)
    render = bpy.context.scene.render
    return picture_files.drawn(render.resolution_x, render.resolution_y, sample_count=SAMPLE_COUNT)


def strands_of(guides):
    """Return (G, P, 3) float32: combed guides, local."""
    return curves.read_points(guides.data).reshape(len(guides.data.curves), -1, 3)


def write_strands(guides, strands):
    """Comb guides to points (G, P, 3), local."""
    guides.data.attributes["position"].data.foreach_set("vector", np.float32(strands).ravel())
    guides.data.update_tag()
    bpy.context.view_layer.update()
