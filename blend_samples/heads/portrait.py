# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo's portrait: the head with a face, a bust and shoulder-length waves, under a key, a fill and two rims."""

import math

import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree

from blend_samples.heads import brows, bust, eyes, head, skin
from hair_addon import api
from hair_addon.core.shading.fibre.principled import roughness_from_beta_r

SIZE = 720, 720  # pixels of a picture
CAMERA, LOOK_AT, LENS = (0.42, -1.40, 0.745), Vector((0.0, -0.033, 0.692)), 126.0  # [m], [m], [mm]
NEAR_EYE = Vector((0.032, -0.135, 0.731))  # [m]: in focus
# Absorption per fiber radius at the roots, which a key light from above would else show brighter than the lengths, and
# the part of it at the tips, which the sun has bleached. Light that is scattered once takes little color from hair: the
# classic model shows light brown lengths as olive, and has darker ones.
# Kajiya-Kay's color is that of light scattered many times, which takes much: it has lighter hair.
AUBURN, CHESTNUT, LIGHT_CHESTNUT = (1.05, 2.07, 3.91), (0.50, 1.15, 2.80), (0.175, 0.40, 0.98)
_AUBURN_TIP, _CHESTNUT_TIP = 0.18, 0.40
GAZE, AHEAD = CAMERA, (0.0, -1.50, 0.735)  # [m]: what the eyes look at; straight ahead
FSTOP = 8.0

LENGTH = 0.34  # [m] of guides on the crown
_HAIRLINE_LENGTH = 0.45  # length of guides at the hairline, as a fraction of `LENGTH`
_HAIRLINE_REACH = 0.030  # [m] above the hairline at which guides have their full length
_HAIRLINE_LOWER, _HAIRLINE_WIDTH = 0.006, 0.018  # [m] how far baby hair reaches below the border, and fades
_STEPS = 41  # points of a guide
_EAR = Vector((0.080, -0.042, 0.712)), Vector((0.030, 0.052, 0.054))  # [m]: middle and radii of what hair goes behind


def build(target=GAZE):
    """The dressed head with shoulder-length hair; returns the objects `Head`, `Guides` and `Hair`."""
    head_object = head.build()
    dress(head_object, target)
    return head_object, *grow(head_object)


def dress(head_object, target=GAZE):
    """Give the sample's head eyes that look at a point [m], brows, lashes, skin and a bust."""
    openings = eyes.openings(head_object)
    eyes.build(head_object, target)
    skin.paint(head_object)
    bust.build(head_object)
    brows.build(head_object, openings)


def grow(head_object, guide_count=400, strand_count=30_000, seed=1):
    """Shoulder-length hair with a parting; returns the objects `Guides` and `Hair`, as `head.grow` does."""
    _add_density(head_object)
    bpy.context.view_layer.objects.active = head_object
    bpy.ops.vellus.distribute_guides(
        guide_count=guide_count, seed=seed, density_group="guides", length=LENGTH, length_variation=0.0
    )
    guides = bpy.data.objects["Guides"]
    _comb(guides, [head_object, bpy.data.objects["Bust"]], seed)
    bpy.context.view_layer.objects.active = guides
    bpy.ops.vellus.interpolate_hair(
        strand_count=strand_count, seed=seed, density_group="strands", radius=5.5e-5, point_count=61, tip_taper=0.25
    )
    hair = bpy.data.objects["Hair"]
    set_styles(hair.data)
    look = hair.data.vellus.appearance
    look.mode, look.parametrization, look.absorption = "classic", "ABSORPTION", CHESTNUT
    look.cuticle_angle, look.roughness = math.radians(5.0), roughness_from_beta_r(math.radians(7.5))
    look.random_color = 0.2
    look.tip_absorption, look.gradient_start, look.gradient_end = _CHESTNUT_TIP, 0.05, 0.42
    return guides, hair


def make_chestnut(hair, model):
    """Give hair Curves the look of the pictures of both classic models, by one of them."""
    hair.vellus.model = model
    hair.vellus.appearance.absorption = LIGHT_CHESTNUT if model == "KAJIYA_KAY" else CHESTNUT


def make_auburn(hair):
    """Give hair Curves the look of the picture that README begins with."""
    look = hair.vellus.appearance
    look.mode, look.absorption, look.roughness, look.tip_absorption = "energy", AUBURN, 0.25, _AUBURN_TIP


def set_styles(hair):
    """The portrait's own styles: loose waves in soft locks, uneven tips, some strands that fly away."""
    api.set_styles(
        hair,
        [
            api.Trim(random=0.10, undercoat=0.02, undercoat_length=0.55, seed=1),
            api.Clump(
                size=0.020,
                ratio=0.6,
                amount=0.65,
                fine_amount=0.6,
                thickness=0.40,
                shape=0.25,
                stray=0.06,
                tip_level=1,
                seed=2,
            ),
            api.Curl(
                radius=0.0105,
                pitch=0.085,
                pitch_vary=0.3,
                flatness=0.45,
                coherence=0.92,
                vary=0.3,
                root=0.0,
                tip=1.0,
                seed=3,
            ),
            api.Frizz(amplitude=0.0006, wavelength=0.08, stray=0.07, stray_gain=20.0, shape=0.35, tip=0.8, seed=4),
        ],
    )


def _add_density(head_object):
    """Vertex groups: `guides`, denser at the hairline; `strands`, which fade out at it and cover the parting."""
    positions = np.array([vertex.co for vertex in head_object.data.vertices])
    above = head.above_hairline(positions) + _HAIRLINE_LOWER
    guides = np.where(above > 0.0, 0.45 + 0.55 * np.exp(-above / 0.02), 0.0)
    border = np.clip(above / _HAIRLINE_WIDTH, 0.0, 1.0) ** 1.3
    seen = np.exp(-np.square((positions[:, 0] - head.PARTING) / 0.02)) + np.exp(-np.square(above / 0.03))
    for name, weights in (("guides", guides), ("strands", border * (0.5 + 0.5 * np.minimum(seen, 1.0)))):
        group = head_object.vertex_groups.new(name=name)
        for vertex in np.flatnonzero(weights > 0.0):
            group.add([int(vertex)], float(weights[vertex]), "REPLACE")


def _comb(guides, solids, seed):
    """Comb guides to both sides of the parting, back over the ears and down onto the shoulders."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    surfaces = [BVHTree.FromObject(solid, depsgraph) for solid in solids]
    curves = guides.data
    points = np.empty((len(curves.points), 3), np.float32)
    curves.attributes["position"].data.foreach_get("vector", points.ravel())
    strands = points.reshape(len(curves.curves), -1, 3)
    lengths = _lengths(strands[:, 0], np.random.default_rng(seed))
    for strand, length in zip(strands, lengths, strict=True):
        strand[:] = _combed(strand[0].tolist(), float(length), surfaces)
    curves.attributes["position"].data.foreach_set("vector", points.ravel())
    curves.update_tag()
    bpy.context.view_layer.update()


def _lengths(roots, rng):
    """Return (S,) [m]: shorter at the hairline, and none like its neighbors."""
    inside = np.clip(head.above_hairline(roots) / _HAIRLINE_REACH, 0.0, 1.0)
    part = _HAIRLINE_LENGTH + (1.0 - _HAIRLINE_LENGTH) * np.sqrt(inside)
    return LENGTH * part * rng.uniform(0.88, 1.06, len(roots))


def _combed(root, length, surfaces):
    """Return (P, 3) points from a root [m]: off the face, round the head, then down in front of the shoulder or
    behind it.
    """
    step = length / (_STEPS - 1)
    position = Vector(root)
    _near, normal, _face, _distance = surfaces[0].find_nearest(position)
    side = math.copysign(1.0, root[0] - head.PARTING)
    front = _part(-root[1], 0.0, 0.12)
    crown = _part(root[2], 0.79, 0.84)
    # Behind the head, hair falls straight: a parting there would leave the nape bare.
    aside = 1.0 - 0.9 * _part(root[1], -0.04, 0.02)
    sweep = Vector((side * (0.35 * aside + 0.45 * front), 0.15 + 0.16 * front**4, -0.45 + 0.45 * front))
    around = Vector((side * 0.12 * aside, 0.05 + 0.16 * front**4, -0.95))
    fall = Vector((-side * 0.22 * aside, -0.12 * _part(abs(root[0]), 0.02, 0.07), -1.0))
    lift = 0.30 + 0.25 * _part(abs(root[0] - head.PARTING), 0.0, 0.03)
    direction = (lift * normal + sweep.normalized()).normalized()
    volume = 0.007 + 0.003 * crown
    combed = [position.copy()]
    for i in range(1, _STEPS):
        gone = i * step
        aim = sweep.lerp(around, _part(gone, 0.02, 0.08)).lerp(fall, _part(gone, 0.07, 0.16)).normalized()
        direction = (direction + 0.42 * aim).normalized()
        ahead = position + step * direction
        ahead = _clear_of(surfaces[0], ahead, 0.003 + volume * _part(gone, 0.0, 0.05), Vector())
        ahead = _clear_of_ear(ahead)
        # On the shoulders hair slides to the chest or to the back, not along the arms.
        ahead = _clear_of(surfaces[1], ahead, 0.008, Vector((0.0, 0.4 if root[1] > -0.02 else -0.4, 0.0)), sideways=0.5)
        direction = (ahead - position).normalized()
        position = position + step * direction
        combed.append(position.copy())
    return _smoothed(np.array(combed))


def _clear_of(surface, position, clearance, slide, sideways=1.0):
    """Return a place at least this far [m] from a surface: pushed along its normal, sideways by this part, and along
    slide.
    """
    near, normal, _face, _distance = surface.find_nearest(position)
    push = max(0.0, clearance - (position - near).dot(normal))
    return position + push * (Vector((sideways * normal.x, normal.y, normal.z)) + slide)


def _clear_of_ear(position):
    """Return a place behind an ear or above it, where it would be on it."""
    center = Vector((math.copysign(_EAR[0].x, position.x), _EAR[0].y, _EAR[0].z))
    part = Vector((position - center)[axis] / _EAR[1][axis] for axis in range(3))
    inside = 1.0 - part.length
    if inside <= 0.0:
        return position
    return position + inside * Vector((math.copysign(0.3 * _EAR[1].x, position.x), _EAR[1].y, 0.0))


def _smoothed(points, passes=3):
    """Return the same points with softer bends; both ends stay."""
    for _pass in range(passes):
        points[1:-1] = 0.25 * points[:-2] + 0.5 * points[1:-1] + 0.25 * points[2:]
    return points


def _part(value, low, high):
    part = min(1.0, max(0.0, (value - low) / (high - low)))
    return part * part * (3.0 - 2.0 * part)


def light():
    """Camera and lights of the portrait; the scene's own size."""
    head.light()
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    camera = scene.camera
    camera.location, camera.data.lens = CAMERA, LENS
    head.point_at(camera, LOOK_AT)
    lens = camera.data.dof
    lens.use_dof, lens.aperture_fstop, lens.aperture_blades = True, FSTOP, 7
    lens.focus_distance = _distance_to(camera, NEAR_EYE)
    _place("Key", (-0.36, -1.20, 1.38), 28.0, 0.40)
    _place("Rim", (-0.65, 0.95, 1.35), 34.0, 0.4)
    _place("Fill", (1.0, -1.15, 0.85), 8.0, 0.9)
    second = bpy.data.objects.new("Rim 2", bpy.data.objects["Rim"].data.copy())
    scene.collection.objects.link(second)
    _place("Rim 2", (0.90, 0.75, 1.50), 48.0, 0.4)
    bpy.context.view_layer.update()


def _distance_to(camera, place):
    """Return [m] along the view."""
    forward = camera.rotation_euler.to_matrix() @ Vector((0.0, 0.0, -1.0))
    return forward.dot(place - camera.location)


def _place(name, location, watts, size):
    lamp = bpy.data.objects[name]
    lamp.location, lamp.data.energy, lamp.data.size = location, watts, size
    head.point_at(lamp, LOOK_AT)
