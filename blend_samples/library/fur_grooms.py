# SPDX-License-Identifier: GPL-3.0-or-later
"""Grooms of fur, by code, on Blender's monkey: short and long. `GROOMS` has them by name, as in head_grooms.py."""

import bpy
import numpy as np
from mathutils import Matrix

from blend_samples.heads import head
from blend_samples.library import combing
from blend_samples.library.combing import Solid, columns, march, part, unit
from hair_addon import api

_SCALE = 0.10  # [m]: half the height of the head
_SKIN = (0.16, 0.095, 0.070)
_COVERAGE = 4.5  # [m]: radii of all strands
_NOSE, _EYE = np.array([0.0, -0.90, -0.22]), np.array([0.35, -0.72, 0.25])  # in the monkey's own units


def build():
    """Return the monkey in the place of the sample's head, with dark eyes; its object `Head` has the vertex group
    `fur`.
    """
    monkey = _monkey()
    _give_materials(monkey)
    subdivision = monkey.modifiers.new("Subdivision", "SUBSURF")
    subdivision.levels = subdivision.render_levels = 2
    bpy.ops.object.modifier_apply(modifier=subdivision.name)
    _paint_fur(monkey)
    return _in_place(monkey)


def load():
    """Return the same monkey without its subdivision, materials and vertex group."""
    return _in_place(_monkey())


def _monkey():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_monkey_add(size=2.0)
    monkey = bpy.context.object
    monkey.name = monkey.data.name = "Head"
    return monkey


def _in_place(monkey):
    monkey.data.transform(Matrix.Translation(head.LOOK_AT) @ Matrix.Scale(_SCALE, 4))
    monkey.data.shade_smooth()
    bpy.context.view_layer.update()
    return monkey


def _eye_distances(places):
    """Return (V,) from the middle of the nearer eye, in its radii."""
    away = np.abs(places) * [1.0, 0.0, 0.0] + places * [0.0, 1.0, 1.0] - _EYE
    return np.linalg.norm(away / 0.29, axis=1)


def _paint_fur(monkey):
    """Fur everywhere, but on the eyes, round them and on the nose."""
    places = np.array([vertex.co for vertex in monkey.data.vertices])
    nose = np.linalg.norm((places - [0.0, -0.86, -0.20]) / [0.13, 0.20, 0.10], axis=1)
    weights = part(_eye_distances(places), 0.90, 1.02) * part(nose, 0.9, 1.3)
    for polygon in monkey.data.polygons:
        if polygon.material_index == 1:
            weights[list(polygon.vertices)] = 0.0
    group = monkey.vertex_groups.new(name="fur")
    for vertex in np.flatnonzero(weights > 0.0):
        group.add([int(vertex)], float(weights[vertex]), "REPLACE")


def _eye_vertices(mesh):
    """Return the vertices that no edges join to an ear: eyes are meshes of their own."""
    is_head = np.zeros(len(mesh.vertices), bool)
    is_head[max(range(len(mesh.vertices)), key=lambda vertex: mesh.vertices[vertex].co.x)] = True
    edges = np.array([edge.vertices for edge in mesh.edges])
    count = 0
    while count < is_head.sum():
        count = is_head.sum()
        is_head[edges[is_head[edges].any(axis=1)]] = True
    return set(np.flatnonzero(~is_head).tolist())


def _give_materials(monkey):
    """Skin, and glossy eyes."""
    eyes = _eye_vertices(monkey.data)
    monkey.data.materials.clear()
    for name, color, roughness in (("Skin", _SKIN, 0.6), ("Eye", (0.010, 0.006, 0.004), 0.08)):
        material = bpy.data.materials.new(name)
        material.diffuse_color = (*color, 1.0)
        principled = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
        principled.inputs["Base Color"].default_value = (*color, 1.0)
        principled.inputs["Roughness"].default_value = roughness
        monkey.data.materials.append(material)
    for polygon in monkey.data.polygons:
        polygon.material_index = int(all(vertex in eyes for vertex in polygon.vertices))


def short_fur(monkey, strand_count):
    """Sleek fur of a centimeter that lies along the body."""
    guides, roots, normals, rng = _placed(monkey, 700)
    near_face = _near_face(roots)
    lengths = (0.007 + 0.008 * near_face) * rng.uniform(0.9, 1.1, len(roots))
    combing.write(guides, _flowing(monkey, roots, normals, lengths, lift=0.45, fall=0.35))
    styles = [
        api.Trim(random=0.25, undercoat=0.4, undercoat_length=0.6, seed=1),
        api.Clump(size=0.0045, levels=1, amount=0.45, thickness=0.35, shape=0.5, seed=2),
        api.Frizz(amplitude=0.0003, wavelength=0.01, seed=3),
    ]
    look = {"melanin": 0.30, "redness": 0.75, "random_color": 0.2, "tip_absorption": 0.4, "roughness": 0.32}
    return _hair(guides, styles, strand_count, look, point_count=13, tip_taper=0.6)


def long_fur(monkey, strand_count):
    """Return a shaggy coat in locks, over a dense undercoat."""
    guides, roots, normals, rng = _placed(monkey, 700)
    near_face = _near_face(roots)
    lengths = (0.010 + 0.052 * near_face) * rng.uniform(0.8, 1.15, len(roots))
    combing.write(guides, _flowing(monkey, roots, normals, lengths, lift=0.8, fall=0.9))
    styles = [
        api.Trim(random=0.3, undercoat=0.45, undercoat_length=0.5, seed=1),
        api.Clump(size=0.013, levels=2, amount=0.85, fine_amount=0.7, thickness=0.15, shape=0.4, stray=0.05, seed=2),
        api.Curl(radius=0.0022, pitch=0.035, flatness=0.4, coherence=0.9, root=0.0, seed=3),
        api.Frizz(amplitude=0.0007, wavelength=0.025, stray=0.04, seed=4),
    ]
    look = {"melanin": 0.12, "redness": 0.4, "random_color": 0.2, "tip_absorption": 0.5, "roughness": 0.35}
    return _hair(guides, styles, strand_count, look, point_count=41, tip_taper=0.7)


def _placed(monkey, guide_count):
    """Return (guide Curves, their roots (G, 3), normals (G, 3), random numbers)."""
    guides = api.distribute_guides(monkey, guide_count=guide_count, density_group="fur", length=0.02, symmetric=True)
    roots = combing.read(guides)[:, 0].astype(np.float64)
    _near, normals = Solid(monkey).nearest(roots)
    return guides, roots, normals, np.random.default_rng(1)


def _near_face(roots):
    """Return (G,): 0 at the eyes and on the muzzle, 1 away from the face."""
    own = (roots - np.array(head.LOOK_AT)) / _SCALE
    eyes = part(_eye_distances(own), 1.0, 2.6)
    muzzle = part(np.linalg.norm(own - _NOSE, axis=1), 0.15, 0.75)
    return eyes * muzzle


def _flowing(monkey, roots, normals, lengths, lift, fall):
    """Guides that lie back from the nose, and hang from lift (the part of the normal at their roots)."""
    body = Solid(monkey)
    nose = np.array(head.LOOK_AT) + _SCALE * _NOSE

    def aim(place, gone):
        _near, normal = body.nearest(place)
        away = unit(place - nose)
        flow = unit(away - np.einsum("ni,ni->n", away, normal)[:, None] * normal + 0.05 * normal)
        return flow + columns(0.0, 0.0, -fall * (0.3 + gone))

    def clear(place, gone):
        return body.clear(place, 0.0004 + 0.10 * gone * lengths)

    return march(roots, lift * normals + aim(roots, 0.0), lengths, aim, clear, turn=0.25)


def _hair(guides, styles, strand_count, look, **settings):
    """Hair between guides all over the fur."""
    hair = api.interpolate_hair(
        guides,
        strand_count=strand_count,
        density_group="fur",
        radius=_COVERAGE / strand_count,
        styles=styles,
        **settings,
    )
    api.shade(hair, mode="energy", parametrization="MELANIN", **look)
    return hair


GROOMS = {"Short Fur": short_fur, "Long Fur": long_fur}
