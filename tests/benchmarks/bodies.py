# SPDX-License-Identifier: GPL-3.0-or-later
"""Models of whole bodies, for measurements on surfaces with thin parts: a person, a hand, an animal, a folded cloth.

Limbs and balls are joined, remeshed by voxels, smoothed and decimated like a scan. The shapes are not adapted to guide
placement.
"""

import bmesh
import bpy
import numpy as np
from mathutils import Euler, Matrix, Vector

from tests.support.pictures.render_probe import read_mesh

_SMOOTHINGS = 4
_FINGERS = 0.075, 0.085, 0.08, 0.06  # lengths [m]


def body(name):
    """Return the `TriMesh` of "person", "hand", "animal" or "cloth"; empties Blender's file."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    makers = {"person": _person, "hand": _lone_hand, "animal": _animal, "cloth": _cloth}
    shown = makers[name]()
    return read_mesh(shown.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh())


def _person():
    parts = bmesh.new()
    _limbs(parts, [(0, 0, 0.95), (0, 0.01, 1.1), (0, 0, 1.3), (0, 0.01, 1.42)], [0.15, 0.125, 0.145, 0.09])
    _limbs(parts, [(0, 0.01, 1.4), (0, 0, 1.52)], [0.06, 0.055])
    _ball(parts, (0, -0.01, 1.63), (0.078, 0.098, 0.115))
    _ball(parts, (0, -0.05, 1.56), (0.055, 0.055, 0.05))
    _ball(parts, (0, -0.115, 1.61), (0.014, 0.022, 0.022))
    for height, radius in ((1.568, 0.0065), (1.555, 0.0075)):
        lip = [(-0.024, -0.094, 1.562), (0, -0.104, height), (0.024, -0.094, 1.562)]
        _limbs(parts, lip, [0.003, radius, 0.003])
    for side in (-1, 1):
        _half_of_person(parts, side)
    return _solid(parts, 0.0035, 60_000)


def _half_of_person(parts, side):
    turns = np.linspace(-1.8, 3.6, 14)
    rim = [(side * (0.083 + 0.012 * np.sin(t)), 0.015 + 0.02 * np.cos(t), 1.62 + 0.032 * np.sin(t)) for t in turns]
    _limbs(parts, rim, [0.0035] * len(rim))
    _ball(parts, (side * 0.083, 0.013, 1.618), (0.003, 0.02, 0.03), (0, 0, side * 0.3))
    _limbs(parts, [(side * 0.07, 0, 1.0), (side * 0.07, 0, 1.2), (side * 0.1, 0, 1.38)], [0.1, 0.09, 0.07])
    arm = [(side * 0.1, 0, 1.36), (side * 0.17, 0, 1.38), (side * 0.3, 0.02, 1.2), (side * 0.42, -0.02, 1.02)]
    _limbs(parts, arm, [0.07, 0.062, 0.046, 0.03])
    along = Vector((side * 0.12, -0.04, -0.18)).normalized()
    across = Vector((0, -1, 0))
    across = (across - across.dot(along) * along).normalized()
    axes = Matrix((along, across, along.cross(across))).transposed().to_4x4()
    _hand(parts, Matrix.Translation((side * 0.425, -0.022, 1.005)) @ axes)
    _limbs(parts, [(side * 0.09, 0, 0.93), (side * 0.1, -0.01, 0.52), (side * 0.11, 0.02, 0.09)], [0.088, 0.056, 0.038])
    foot = [(side * 0.11, 0.03, 0.045), (side * 0.12, -0.06, 0.04), (side * 0.13, -0.12, 0.025)]
    _limbs(parts, foot, [0.042, 0.037, 0.03])
    for toe in range(5):
        x = side * (0.1 + 0.0145 * toe)
        end = x + side * 0.003, -0.165 + 0.006 * toe, 0.013
        _limbs(parts, [(x, -0.12, 0.02), end], [0.0105, 0.0072 if toe else 0.011])


def _hand(parts, frame):
    """Build a hand from its wrist along X, palm down."""
    for number, length in enumerate(_FINGERS):
        x, y = 0.085 - 0.004 * abs(number - 1), 0.03 - 0.02 * number
        _limbs(parts, [(0, 0.6 * y, 0), (x, y, 0)], [0.015, 0.0115], frame)
        if number < 3:
            _limbs(parts, [(0.02, 0.6 * y - 0.006, 0), (0.08, y - 0.01, 0)], [0.013, 0.0105], frame)
        slant, bend = 0.084 * (1.5 - number) * length, -0.022 * (1 + 0.3 * number)
        shares = (0.0, 0.45, 0.75, 1.0)
        joints = [(x + t * length * (1 - 0.08 * t * (number + 1)), y + slant * t, bend * t * t) for t in shares]
        _limbs(parts, joints, [0.0098, 0.0088, 0.008, 0.0066], frame)
    thumb = [(0.015, 0.02, -0.005), (0.045, 0.05, -0.012), (0.07, 0.065, -0.016), (0.088, 0.07, -0.018)]
    _limbs(parts, thumb, [0.016, 0.0125, 0.0105, 0.0085], frame)


def _lone_hand():
    parts = bmesh.new()
    _limbs(parts, [(-0.12, 0, 0), (-0.03, 0, 0), (0.01, 0, 0)], [0.033, 0.026, 0.024])
    _hand(parts, Matrix.Identity(4))
    return _solid(parts, 0.0012, 24_000)


def _animal():
    parts = bmesh.new()
    _limbs(parts, [(0, 0, 0.5), (0, 0.3, 0.53), (0, 0.62, 0.5)], [0.15, 0.16, 0.13])
    _limbs(parts, [(0, 0, 0.52), (0, -0.15, 0.68)], [0.11, 0.08])
    _ball(parts, (0, -0.2, 0.74), (0.075, 0.095, 0.075))
    _limbs(parts, [(0, -0.25, 0.72), (0, -0.35, 0.69)], [0.048, 0.03])
    _limbs(parts, [(0, -0.25, 0.69), (0, -0.33, 0.655)], [0.03, 0.02])
    tail = [(0, 0.68, 0.54), (0.03, 0.8, 0.66), (0.02, 0.85, 0.82), (0, 0.8, 0.95)]
    _limbs(parts, tail, [0.035, 0.026, 0.02, 0.01])
    for side in (-1, 1):
        _ball(parts, (side * 0.055, -0.16, 0.845), (0.032, 0.0045, 0.075), (0.15, side * 0.35, side * 0.4))
        _ball(parts, (side * 0.05, -0.165, 0.8), (0.03, 0.012, 0.03))
        for y, way in ((0.03, 1), (0.58, -1)):
            leg = [(side * 0.085, y, 0.45), (side * 0.09, y - 0.03 * way, 0.25), (side * 0.09, y + 0.02 * way, 0.06)]
            _limbs(parts, leg, [0.075, 0.042, 0.028])
            for toe in range(4):
                x = side * 0.09 + 0.017 * (toe - 1.5)
                _limbs(parts, [(x, y, 0.03), (1.02 * x, y - 0.055, 0.018)], [0.017, 0.0105])
    return _solid(parts, 0.004, 40_000)


def _cloth():
    """Build a folded skirt, two millimeters thick."""
    around, down = np.meshgrid(np.linspace(0, 2 * np.pi, 240, endpoint=False), np.linspace(0, 1, 60))
    radius = 0.19 + 0.14 * down + (0.004 + 0.045 * down) * np.sin(16 * around + 2 * down)
    radius += 0.01 * down * np.sin(5 * around)
    height = 1.02 - 0.45 * down + 0.01 * np.sin(3 * around)
    vertices = np.stack([radius * np.cos(around), radius * np.sin(around), height], axis=-1).reshape(-1, 3)
    row, column = np.arange(59)[:, None] * 240, np.arange(240)
    following = (column + 1) % 240
    faces = np.stack([row + column, row + following, row + 240 + following, row + 240 + column], axis=-1)
    mesh = bpy.data.meshes.new("Cloth")
    mesh.from_pydata(vertices.tolist(), [], faces.reshape(-1, 4).tolist())
    shown = bpy.data.objects.new("Cloth", mesh)
    bpy.context.scene.collection.objects.link(shown)
    shown.modifiers.new("Thickness", "SOLIDIFY").thickness = 0.002
    return shown


def _limbs(parts, joints, radii, frame=None):
    """Add cones from joint to joint [m], rounded at each joint."""
    joints = [Vector(joint) if frame is None else frame @ Vector(joint) for joint in joints]
    for start, end, first, last in zip(joints, joints[1:], radii, radii[1:], strict=False):
        axis = end - start
        there = Matrix.Translation(0.5 * (start + end)) @ axis.to_track_quat("Z", "Y").to_matrix().to_4x4()
        sizes = {"radius1": first, "radius2": last, "depth": axis.length}
        bmesh.ops.create_cone(parts, cap_ends=True, segments=24, matrix=there, **sizes)
    for joint, radius in zip(joints, radii, strict=True):
        _ball(parts, joint, (radius, radius, radius))


def _ball(parts, place, radii, turn=(0, 0, 0)):
    there = Matrix.Translation(place) @ Euler(turn).to_matrix().to_4x4() @ Matrix.Diagonal((*radii, 1))
    bmesh.ops.create_icosphere(parts, subdivisions=3, radius=1.0, matrix=there)


def _solid(parts, voxel_size, face_count):
    """Return an object of one closed surface around all parts, with `face_count` triangles."""
    mesh = bpy.data.meshes.new("Body")
    parts.to_mesh(mesh)
    parts.free()
    shown = bpy.data.objects.new("Body", mesh)
    bpy.context.scene.collection.objects.link(shown)
    remesh = shown.modifiers.new("Remesh", "REMESH")
    remesh.mode, remesh.voxel_size = "VOXEL", voxel_size
    shown.modifiers.new("Smooth", "SMOOTH").iterations = _SMOOTHINGS
    evaluated = shown.evaluated_get(bpy.context.evaluated_depsgraph_get())
    triangle_count = sum(len(polygon.vertices) - 2 for polygon in evaluated.to_mesh().polygons)
    shown.modifiers.new("Decimate", "DECIMATE").ratio = face_count / triangle_count
    return shown
