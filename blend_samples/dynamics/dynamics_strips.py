# SPDX-License-Identifier: GPL-3.0-or-later
"""Strips of hair that moves: moments of one motion, side by side, and the same of other hair below."""

import math
import tempfile
from collections.abc import Callable
from dataclasses import dataclass

import bpy
import imbuf
import numpy as np
from mathutils import Matrix, Vector

from blend_samples.dynamics import dynamics_figures, dynamics_scene
from blend_samples.sheets import picture_files
from hair_addon import api

PAGE_WIDTH = 1540  # pixels of a picture of the documentation
NECK = Vector((0.0, -0.03, 0.65))  # [m]
BALL_RADIUS = 0.02  # [m]
BALL_SPEED = 0.25  # [m/s]
BALL_SEEN = (-0.06, 0.06, 0.69)  # [m]
BALL_COLOR = (0.55, 0.62, 0.70, 1.0)
WIND = 2.0  # [m/s]
SHELTERED_DRAG = 0.2  # of a lone fiber's
NOD_STIFFNESS = 60.0  # with which hair that rises at the parting stays up when it is wet
UPRIGHT_SEEN, UPRIGHT_LENS = (0.0, 0.015, 0.735), 62.0  # [m], [mm]
UPRIGHT_LENGTH, UPRIGHT_STIFFNESS = 0.11, 2.0  # [m]: just stiff enough to stand
SCREEN_RIGHT = np.array([-dynamics_scene.CAMERA[1], dynamics_scene.CAMERA[0], 0.0]) / math.hypot(
    *dynamics_scene.CAMERA[:2]
)

BALL_START = np.array([0.0, 0.03, 0.66]) - 0.06 * SCREEN_RIGHT  # [m]: in the neck


@dataclass(frozen=True)
class Strip:
    """A strip of pictures: functions that prepare the open file for each row, and the frames shown, up to the last."""

    rows: tuple[Callable[[], None], ...]
    frames: tuple[int, ...]
    captions: tuple[str, ...] = ("",)


def draw(name, strip, scene_file, out):
    """Bake and draw a strip, write it, and print its figures."""
    rows, words = [], []
    width, height = dynamics_scene.SIZE
    for row, (prepare, caption) in enumerate(zip(strip.rows, strip.captions, strict=True)):
        bpy.ops.wm.open_mainfile(filepath=str(scene_file))
        prepare()
        skull, guides, _hair = dynamics_scene.objects()
        with tempfile.TemporaryDirectory() as cache:
            dynamics_scene.bake(guides, strip.frames[-1], cache)
            rows.append(np.concatenate([dynamics_scene.drawn(frame) for frame in strip.frames], axis=1))
            print(f"{name} {caption}: {dynamics_figures.figures_of(guides, skull, strip.frames[-1])}", flush=True)
        for column, frame in enumerate(strip.frames):
            label = f"{caption} {dynamics_scene.time_of(frame):.2f} s".strip()
            words.append((label, width * column + 10, height * row + 20))
    path = out / f"{name}.png"
    picture_files.write(np.concatenate(rows), path, words)


def write_page(path, page):
    """Write a strip once more as a picture of the documentation: smaller, in fewer colors."""
    picture = imbuf.load(str(path))
    width, height = picture.size
    picture.resize((PAGE_WIDTH, round(height * PAGE_WIDTH / width)), method="BILINEAR")
    with picture.with_buffer() as buffer:
        pixels = np.array(buffer)[::-1, :, :3]
    picture_files.write(pixels, page, kept_bits=picture_files.FEW_BITS)


def shake():
    """Shake the head at 3 Hz for a second."""
    skull, _guides, _hair = dynamics_scene.objects()
    dynamics_scene.turn(skull, 2, dynamics_scene.shaking(), RESTED)


def blow():
    """Let wind blow from the side, with gusts."""
    across = bpy.data.objects.new("Wind", None)
    across.rotation_euler = (math.radians(90.0), 0.0, math.atan2(SCREEN_RIGHT[0], -SCREEN_RIGHT[1]))
    bpy.context.scene.collection.objects.link(across)
    with bpy.context.temp_override(object=across, active_object=across):
        bpy.ops.object.forcefield_toggle()
    across.field.type = "WIND"
    # A lone fiber would fly level in this wind: nine times its weight. Those of a wisp shelter each other.
    api.set_dynamics(dynamics_scene.objects()[1], air_drag=SHELTERED_DRAG)
    for frame in range(1, RESTED + 1):
        across.field.strength = WIND * gust(dynamics_scene.time_of(frame))
        across.field.keyframe_insert("strength", frame=frame)
    dynamics_scene.see_from(dynamics_scene.CAMERA, dynamics_scene.SEEN + 0.065 * SCREEN_RIGHT, 58.0)


def gust(time):
    """Return the wind at a time as a part of its mean: it begins in half a second, swells and abates, and ends after
    two.
    """
    swell = 1.0 + 0.5 * math.sin(2.0 * math.pi * 0.9 * time) + 0.2 * math.sin(2.0 * math.pi * 2.3 * time)
    return swell * float(np.clip(2.0 * time, 0.0, 1.0) * np.clip(3.0 * (2.0 - time), 0.0, 1.0))


def push_ball():
    """Push a ball from beside the neck out through the hair, which is seen from nearby."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=BALL_RADIUS)
    ball = bpy.context.object
    ball.name = "Ball"
    bpy.ops.object.shade_smooth()
    material = bpy.data.materials.new("Ball")
    shader = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = BALL_COLOR
    ball.data.materials.append(material)
    for frame in range(1, RESTED + 1):
        ball.location = BALL_START + BALL_SPEED * dynamics_scene.time_of(frame) * SCREEN_RIGHT
        ball.keyframe_insert("location", frame=frame)
    colliders = bpy.data.collections.new("Colliders")
    bpy.context.scene.collection.children.link(colliders)
    colliders.objects.link(ball)
    api.set_dynamics(dynamics_scene.objects()[1], colliders="Colliders")
    dynamics_scene.see_from(dynamics_scene.CAMERA, BALL_SEEN, 120.0)


def nod():
    """Nod twice, about the neck."""
    skull, guides, _hair = dynamics_scene.objects()
    api.set_dynamics(guides, bend_stiffness=NOD_STIFFNESS)
    angle = dynamics_scene.shaking(16.0, 1.5, 1.4)
    dynamics_scene.turn(skull, 0, angle, SETTLED)
    for frame in range(1, SETTLED + 1):
        turn = Matrix.Rotation(angle(dynamics_scene.time_of(frame)), 3, "X")
        skull.location = NECK - turn @ NECK
        skull.keyframe_insert("location", frame=frame)


def wet():
    """Make the hair wet: heavier and softer, in locks, and darker."""
    _skull, guides, hair = dynamics_scene.objects()
    api.set_dynamics(guides, wetness=1.0)
    api.set_styles(hair, [*api.styles_of(hair), api.Wet(amount=1.0, lock=0.018, seed=5)])
    api.shade(hair, wetness=1.0)


def wet_nod():
    """Nod twice with wet hair."""
    wet()
    nod()


def stand(is_sag_free=True):
    """Comb short hair that stands on end."""
    _skull, guides, hair = dynamics_scene.objects()
    strands = dynamics_scene.strands_of(guides)
    out = strands[:, :1] - np.array([0.0, -0.01, 0.70])
    out /= np.linalg.norm(out, axis=2, keepdims=True)
    along = np.linspace(0.0, 1.0, strands.shape[1])[:, None]
    dynamics_scene.write_strands(guides, strands[:, :1] + UPRIGHT_LENGTH * along * out)
    api.set_styles(hair, [api.Clump(size=0.012, amount=0.8, seed=3)])
    api.set_dynamics(guides, sag_free=is_sag_free, bend_stiffness=UPRIGHT_STIFFNESS)
    dynamics_scene.see_from(dynamics_scene.CAMERA, UPRIGHT_SEEN, UPRIGHT_LENS)


def sag():
    """The same hair, which gravity bends."""
    stand(is_sag_free=False)


SETTLED, RESTED = 24 * 3 + 1, 24 * 5 + 1  # frames
STRIPS = {
    "shaking": Strip((shake,), (1, 10, 12, 14, 16, RESTED)),
    "wind": Strip((blow,), (1, 13, 22, 34, 44, RESTED)),
    "ball": Strip((push_ball,), (1, 16, 20, 24, 29, RESTED)),
    "wet": Strip((nod, wet_nod), (1, 9, 17, 25, SETTLED), ("dry", "wet")),
    "upright": Strip((stand, sag), (1, 5, 9, SETTLED), ("sag-free", "sagging")),
}
