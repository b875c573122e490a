# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures of baked guides: how much they stretch, how far they are inside the head, how fast they are at rest."""

from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree

from hair_addon.blender.data.simulation import guide_poses
from hair_addon.blender.groom.dynamics import frame_folders

_ROOTS = 4  # points of a guide that may be nearer to the skin than hair keeps
_EVERY = 5  # frames are looked at: Blender makes the hair in each
_LOWEST = 0.61  # [m] in the head's axes: below, the neck is cut open and has no inside


@dataclass(frozen=True)
class Figures:
    """Of frames of guides: the largest stretch, the least height over the head [m], the speed in the last frame [m/s].

    first_step: [m] that a point moves in the frame after the first, at most.
    """

    stretch: float
    height: float
    speed: float
    first_step: float

    def __str__(self):
        height, speed, step = 1e3 * self.height, 1e3 * self.speed, 1e3 * self.first_step
        return (
            f"stretch {self.stretch:.2%}, at least {height:.2f} mm over the head, {speed:.3f} mm/s at the end,"
            f" {step:.3f} mm in the first frame"
        )


def figures_of(guides, skull, last):
    """`Figures` of baked guides in the frames from 1 to the last."""
    scene = bpy.context.scene
    places = {}
    height = np.inf
    for frame in sorted({2, last - 1, last, *range(1, last, _EVERY)}):
        scene.frame_set(frame)
        places[frame] = guide_points(guides, frame)
        height = min(height, heights(places[frame][:, _ROOTS:].reshape(-1, 3), skull).min())
    lengths = {frame: np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1) for frame, points in places.items()}
    stretch = max(abs(now / lengths[1] - 1.0).max() for now in lengths.values())
    speed = np.linalg.norm(places[last] - places[last - 1], axis=2).max() * scene.render.fps
    return Figures(stretch, height, speed, np.linalg.norm(places[2] - places[1], axis=2).max())


def guide_points(guides, frame):
    """Return (G, P, 3) float64 [m] in the world: baked guides in the scene's frame."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    pose = guide_poses.read(guides.data, depsgraph, 1.0)
    return pose.to_world(frame_folders.frames_of(guides.data).points_at(frame))


def heights(points, skull):
    """Return (N,) [m] of points (N, 3) in the world over the head, negative inside; infinite below its neck."""
    tree = BVHTree.FromObject(skull, bpy.context.evaluated_depsgraph_get())
    back = skull.matrix_world.inverted()
    found = np.full(len(points), np.inf)
    for i, point in enumerate(points):
        local = back @ Vector(point)
        if local.z < _LOWEST:
            continue
        near, normal, _face, distance = tree.find_nearest(local)
        found[i] = distance if (local - near).dot(normal) > 0.0 else -distance
    return found
