# SPDX-License-Identifier: GPL-3.0-or-later
"""The head that the samples and the demo grow hair on: mesh, scalp, material, camera and lights."""

import math
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree

from hair_addon.core.shading.fibre.principled import roughness_from_beta_r

HEAD = Path(__file__).resolve().parents[1] / "head.obj"

# The hairline from the side, (y, z) [m], from the forehead over temple and ear to the nape; the face looks to -Y.
_HAIRLINE = np.array(
    [
        (-0.170, 0.820),
        (-0.135, 0.806),
        (-0.105, 0.787),
        (-0.078, 0.755),
        (-0.068, 0.738),
        (-0.060, 0.744),
        (-0.030, 0.744),
        (-0.022, 0.715),
        (0.000, 0.690),
        (0.040, 0.680),
    ]
)
_HAIRLINE_WIDTH = 0.008  # [m] over which hair thins out at its border

PARTING = 0.018  # [m] left of the middle
AUBURN = (0.20, 0.40, 0.85)  # absorption per fiber radius
CHESTNUT = (0.11, 0.27, 0.70)

LOOK_AT = Vector((0.012, -0.04, 0.715))


def load():
    """Load the head into an empty scene without its subdivision; returns the object `Head`."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.obj_import(filepath=str(HEAD))
    head = bpy.context.object
    head.name = head.data.name = "Head"
    # The file is Y up: turn the mesh itself, so that its coordinates are the world's.
    head.data.transform(head.matrix_world)
    head.matrix_world.identity()
    head.data.shade_smooth()
    head.data.materials.clear()
    head.data.materials.append(skin())
    return head


def build():
    """Load the head into an empty scene, with its vertex group `scalp`; returns the object `Head`."""
    head = load()
    _add_scalp(head)
    subdivision = head.modifiers.new("Subdivision", "SUBSURF")
    subdivision.levels = subdivision.render_levels = 1
    # Applied, as strands turn with their roots where a modifier moves these: locks would fan out.
    bpy.ops.object.modifier_apply(modifier=subdivision.name)
    bpy.context.view_layer.update()
    return head


def _add_scalp(head):
    positions = np.empty((len(head.data.vertices), 3), np.float32)
    head.data.vertices.foreach_get("co", positions.ravel())
    weights = np.clip(above_hairline(positions) / _HAIRLINE_WIDTH, 0.0, 1.0)
    group = head.vertex_groups.new(name="scalp")
    for vertex in np.flatnonzero(weights > 0.0):
        group.add([int(vertex)], float(weights[vertex]), "REPLACE")


def above_hairline(positions):
    """Return heights (N,) of places on the head (N, 3) [m] above the hairline as it is seen from the side."""
    return positions[:, 2] - np.interp(positions[:, 1], _HAIRLINE[:, 0], _HAIRLINE[:, 1])


def skin():
    """Return the head's material."""
    material = bpy.data.materials.new("Skin")
    color = (0.52, 0.31, 0.22, 1.0)
    material.diffuse_color = color
    node = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    node.inputs["Base Color"].default_value = color
    node.inputs["Roughness"].default_value = 0.55
    return material


def light():
    """Camera and lights: a key that shows both highlights, a rim that shines through, a dim surrounding."""
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.lens = 78.0
    camera.data.clip_start = 0.01
    camera.location = (0.80, -1.12, 0.80)
    point_at(camera, LOOK_AT)
    scene.collection.objects.link(camera)
    scene.camera = camera
    _add_light("Key", (1.35, -0.80, 1.10), 26.0, (1.0, 0.95, 0.88))
    _add_light("Rim", (-0.35, 1.05, 1.25), 40.0, (1.0, 0.93, 0.85))
    _add_light("Fill", (-0.9, -1.2, 0.9), 4.0, (0.80, 0.88, 1.0))
    scene.view_settings.look = "AgX - Medium High Contrast"
    world = scene.world = bpy.data.worlds.new("World")
    background = next(n for n in world.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.030, 0.033, 0.038, 1.0)
    bpy.context.view_layer.update()


def _add_light(name, location, watts, color):
    lamp = bpy.data.lights.new(name, "AREA")
    lamp.energy, lamp.color, lamp.size = watts, color, 0.4
    lamp_object = bpy.data.objects.new(name, lamp)
    lamp_object.location = location
    point_at(lamp_object, LOOK_AT)
    bpy.context.scene.collection.objects.link(lamp_object)


def point_at(turned, target):
    """Turn a camera or a light towards a place [m]."""
    turned.rotation_euler = (Vector(target) - turned.location).to_track_quat("-Z", "Y").to_euler()


def grow(head, guide_count=200, strand_count=30_000, seed=1):
    """Guides on the scalp, combed, and hair between them; returns the objects `Guides` and `Hair`."""
    bpy.context.view_layer.objects.active = head
    bpy.ops.vellus.distribute_guides(
        guide_count=guide_count,
        seed=seed,
        density_group="scalp",
        length=0.22,
        length_variation=0.10,
        tilt=math.radians(8.0),
        gravity=0.85,
    )
    guides = bpy.data.objects["Guides"]
    comb(guides, head)
    bpy.context.view_layer.objects.active = guides
    bpy.ops.vellus.interpolate_hair(strand_count=strand_count, seed=seed, density_group="scalp", radius=6e-5)
    hair = bpy.data.objects["Hair"]
    look = hair.data.vellus.appearance
    look.mode, look.parametrization, look.absorption = "classic", "ABSORPTION", CHESTNUT
    # As in [Marschner03]: scales that tilt by 5 degrees, a first highlight 7.5 degrees wide.
    look.cuticle_angle, look.roughness = math.radians(5.0), roughness_from_beta_r(math.radians(7.5))
    return guides, hair


def comb(guides, head):
    """Comb guides off the face, to both sides of a parting: what an artist does with a brush in sculpt mode."""
    curves = guides.data
    points = np.empty((len(curves.points), 3), np.float32)
    curves.attributes["position"].data.foreach_get("vector", points.ravel())
    strands = points.reshape(len(curves.curves), -1, 3)
    surface = BVHTree.FromObject(head, bpy.context.evaluated_depsgraph_get())
    for strand in strands:
        strand[:] = _combed(strand, surface)
    curves.attributes["position"].data.foreach_set("vector", points.ravel())
    curves.update_tag()
    bpy.context.view_layer.update()


def _combed(strand, surface):
    """Return (P, 3) points of the same length as before: from the root sideways and back, then down, clear of the
    skin.
    """
    step = float(np.linalg.norm(np.diff(strand, axis=0), axis=1).mean())
    position = Vector(strand[0])
    _near, normal, _face, _distance = surface.find_nearest(position)
    side = math.copysign(1.0, position.x - PARTING)
    in_front = max(0.0, min(1.0, (-0.02 - position.y) / 0.10))
    sweep = Vector((side * (0.30 + 0.55 * in_front), 0.30 + 0.75 * in_front, -0.45 + 0.30 * in_front)).normalized()
    combed = [position.copy()]
    direction = (0.7 * normal + 1.2 * sweep).normalized()
    for i in range(1, len(strand)):
        t = i / (len(strand) - 1)
        fall = min(1.0, max(0.0, (t - 0.12) / 0.5))
        aim = sweep.lerp(Vector((-side * 0.04, -0.02, -1.0)), fall)
        direction = (direction + 0.28 * aim).normalized()
        ahead = position + step * direction
        near, normal, _face, _distance = surface.find_nearest(ahead)
        clearance = 0.004 + 0.016 * min(1.0, 3.0 * t)
        height = (ahead - near).dot(normal)
        if height < clearance:
            ahead += (clearance - height) * normal
            direction = (ahead - position).normalized()
        position = position + step * direction
        combed.append(position.copy())
    return np.array(combed, np.float32)
