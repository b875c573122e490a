# SPDX-License-Identifier: GPL-3.0-or-later
"""A sitting cat of metaballs, for long fur: its mesh, eyes and nose; it looks to -Y."""

import bpy
import numpy as np
from mathutils import Matrix, Vector

_COLOR = (0.16, 0.075, 0.03)

# Balls: middle [m] and radii [m]; those with x > 0 stand on both sides.
_BODY = (
    ((0.0, 0.075, 0.075), (0.085, 0.10, 0.085)),  # hips
    ((0.0, 0.035, 0.14), (0.068, 0.075, 0.085)),
    ((0.0, -0.015, 0.19), (0.055, 0.058, 0.065)),  # chest
    ((0.0, -0.035, 0.245), (0.040, 0.042, 0.045)),  # neck
    ((0.0, -0.052, 0.297), (0.060, 0.058, 0.053)),  # head
    ((0.0, -0.098, 0.280), (0.023, 0.020, 0.017)),  # muzzle
    ((0.027, -0.074, 0.283), (0.026, 0.024, 0.022)),  # cheeks
    ((0.036, -0.038, 0.338), (0.020, 0.009, 0.026)),  # ears
    ((0.040, -0.036, 0.358), (0.011, 0.006, 0.017)),
    ((0.032, -0.045, 0.13), (0.021, 0.024, 0.055)),  # forelegs
    ((0.032, -0.055, 0.065), (0.018, 0.019, 0.055)),
    ((0.032, -0.070, 0.016), (0.021, 0.030, 0.017)),  # paws
    ((0.070, 0.055, 0.055), (0.036, 0.062, 0.055)),  # thighs
    ((0.075, 0.000, 0.018), (0.022, 0.040, 0.017)),
)
_TAIL = ((0.02, 0.17, 0.035), (0.08, 0.20, 0.028), (0.135, 0.17, 0.026), (0.155, 0.10, 0.025), (0.145, 0.03, 0.024))
_TAIL_RADIUS = 0.017
_EYE, _EYE_RADIUS = Vector((0.0225, -0.0905, 0.307)), 0.0105
_NOSE = Vector((0.0, -0.1190, 0.289))


def build():
    """Return the object `Head`, as the sample's head is named, in an empty scene; fur is painted by `fur`."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    cat = _skin()
    for side in (-1.0, 1.0):
        place = Vector((side * _EYE.x, _EYE.y, _EYE.z))
        _ball(cat, "Eye", place, (_EYE_RADIUS,) * 3, (0.35, 0.30, 0.03), 0.08)
        _ball(
            cat, "Pupil", place + Vector((side * 0.0004, -0.0058, 0.0)), (0.0034, 0.0055, 0.0066), (0.0, 0.0, 0.0), 0.05
        )
    _ball(cat, "Nose", _NOSE, (0.0070, 0.0055, 0.0050), (0.30, 0.10, 0.09), 0.35)
    _add_fur(cat)
    return cat


def _skin():
    data = bpy.data.metaballs.new("Cat")
    data.resolution = data.render_resolution = 0.006
    data.threshold = 0.25
    for middle, radii in _BODY:
        for side in (1.0, -1.0) if middle[0] else (1.0,):
            _add(data, (side * middle[0], *middle[1:]), radii)
    tail = np.array(_TAIL)
    for along in np.linspace(0.0, len(tail) - 1.0, 26):
        first = min(int(along), len(tail) - 2)
        place = tail[first] + (along - first) * (tail[first + 1] - tail[first])
        _add(data, place, (_TAIL_RADIUS,) * 3)
    balls = bpy.data.objects.new("Balls", data)
    bpy.context.scene.collection.objects.link(balls)
    bpy.context.view_layer.update()
    mesh = bpy.data.meshes.new_from_object(balls.evaluated_get(bpy.context.evaluated_depsgraph_get()))
    bpy.data.objects.remove(balls)
    bpy.data.metaballs.remove(data)
    mesh.name = "Head"
    cat = bpy.data.objects.new("Head", mesh)
    bpy.context.scene.collection.objects.link(cat)
    bpy.context.view_layer.objects.active = cat
    cat.select_set(True)
    modifier = cat.modifiers.new("Remesh", "REMESH")
    modifier.mode, modifier.voxel_size = "VOXEL", 0.005
    bpy.ops.object.modifier_apply(modifier=modifier.name)
    modifier = cat.modifiers.new("Smooth", "SMOOTH")
    modifier.iterations = 4
    bpy.ops.object.modifier_apply(modifier=modifier.name)
    cat.data.shade_smooth()
    cat.data.materials.clear()
    cat.data.materials.append(_material("Skin", _COLOR, 0.7))
    return cat


def _add(data, place, radii):
    element = data.elements.new(type="ELLIPSOID")
    largest = max(radii)
    element.co, element.radius, element.stiffness = place, 1.15 * largest, 2.0
    element.size_x, element.size_y, element.size_z = (radius / largest for radius in radii)


def _ball(cat, name, place, radii, color, roughness):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16, radius=1.0)
    made = bpy.context.object
    made.name = name
    made.data.transform(Matrix.LocRotScale(place, None, Vector(radii)))
    made.data.shade_smooth()
    made.data.materials.append(_material(name, color, roughness))
    made.parent = cat


def _material(name, color, roughness):
    material = bpy.data.materials.new(name)
    material.diffuse_color = (*color, 1.0)
    principled = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    principled.inputs["Base Color"].default_value = (*color, 1.0)
    principled.inputs["Roughness"].default_value = roughness
    return material


def _add_fur(cat):
    """The vertex group `fur`: everywhere but around the eyes and on the nose."""
    places = np.array([vertex.co for vertex in cat.data.vertices])
    across = np.abs(places[:, 0])
    eyes = np.linalg.norm(np.c_[across, places[:, 1:]] - np.array(_EYE), axis=1) / _EYE_RADIUS
    nose = np.linalg.norm((places - np.array(_NOSE)) / (0.009, 0.009, 0.007), axis=1)
    weights = np.clip(np.minimum(eyes - 1.05, nose - 0.9) / 0.25, 0.0, 1.0)
    group = cat.vertex_groups.new(name="fur")
    for vertex in np.flatnonzero(weights > 0.0):
        group.add([int(vertex)], float(weights[vertex]), "REPLACE")
