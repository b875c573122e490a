# SPDX-License-Identifier: GPL-3.0-or-later
"""Eyes for the sample's head: eyeballs with iris and pupil, clear corneas over them, the wet borders of the lids."""

from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree

RADIUS = 0.0150  # [m] of an eyeball
IRIS_RADIUS = 0.0047
PUPIL_RADIUS = 0.0017
_GAP = 0.0007  # [m] between an eyeball and the lids
_BULGE = 0.0010  # [m] of a cornea over the eyeball's sphere

_SEGMENTS = 64
_IMAGE_SIZE = 512  # pixels
_IRIS_PART = 0.8  # of the image's radius: the rest is the sclera

_IRIS_RINGS = np.array([0.0, 0.19, 0.38, 0.41, 0.46, 0.55, 0.7, 0.85, 0.95, 1.0])  # of the iris' radius
_SCLERA_RINGS = 24
_WHITE, _DARK = (0.74, 0.70, 0.67), (0.07, 0.085, 0.075)  # in Solid view, which has no images
_CORNEA_RINGS = np.linspace(0.0, 1.25, 12)


@dataclass(frozen=True)
class Opening:
    """Borders of the hole between two lids: (N, 3) points [m] from the nose outward."""

    upper: np.ndarray
    lower: np.ndarray

    @property
    def center(self):
        """(3,) of the hole."""
        return 0.5 * (self.upper.mean(axis=0) + self.lower.mean(axis=0))


def openings(head_object, step=0.0005):
    """Return the `Opening` on the left (+X) and on the right: where rays from the front fall behind the lids."""
    surface = BVHTree.FromObject(head_object, bpy.context.evaluated_depsgraph_get())
    return tuple(_opening(surface, side, step) for side in (1.0, -1.0))


def _opening(surface, side, step):
    upper, lower = [], []
    heights = np.arange(0.740, 0.716, -0.0002)
    for x in np.arange(0.018, 0.048, step):
        hits = [surface.ray_cast(Vector((side * x, -1.0, z)), Vector((0.0, 1.0, 0.0)))[0] for z in heights]
        depths = np.array([hit.y for hit in hits])
        is_open = depths > -0.122
        if is_open.any():
            first, last = np.flatnonzero(is_open)[[0, -1]]
            upper.append(tuple(hits[first - 1]))
            lower.append(tuple(hits[last + 1]))
    return Opening(np.array(upper), np.array(lower))


def build(head_object, target):
    """Eyes that look at a point [m]; returns the objects `Eyes`, `Corneas` and `Lids`, children of the head."""
    balls, corneas, lids = [], [], []
    for opening in openings(head_object):
        center = _center(opening)
        axes = _axes(np.array(target) - center)
        balls.append(_ball(center, axes))
        corneas.append(_cornea(center, axes))
        lids.append(_lid(opening, center))
    eyes = _object(
        "Eyes", balls, head_object, [_eye_material("Sclera", _WHITE, 0.25, 0.5), _eye_material("Iris", _DARK, 0.6, 0.1)]
    )
    cornea = _object("Corneas", corneas, head_object, [_cornea_material()])
    return eyes, cornea, _object("Lids", lids, head_object, [_lid_material()])


def _center(opening):
    """Return (3,) of an eyeball that nearly touches the lids from behind."""
    middle = opening.center
    border = np.concatenate([opening.upper, opening.lower])
    across = np.hypot(border[:, 0] - middle[0], border[:, 2] - middle[2])
    behind = border[:, 1] + _GAP + np.sqrt(np.maximum(RADIUS**2 - across**2, 0.0))
    return np.array([middle[0], behind.max(), middle[2]])


def _axes(gaze):
    """Return (3, 3): right, up and gaze of an eye, as rows."""
    forward = gaze / np.linalg.norm(gaze)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(right, forward), forward])


def _ball(center, axes):
    """Return (rings of (3,) local points as radius and height, ...) of an eyeball: vertices, faces, UVs, slots."""
    limbus = np.sqrt(RADIUS**2 - IRIS_RADIUS**2)
    radii = IRIS_RADIUS * _IRIS_RINGS
    is_pupil = radii < PUPIL_RADIUS
    # The iris is a shallow cone behind the cornea; the pupil a hole in it.
    depth = np.where(is_pupil, 0.0016, 0.0008 - 0.0006 * _IRIS_RINGS)
    angles = np.linspace(np.arcsin(IRIS_RADIUS / RADIUS), np.pi, _SCLERA_RINGS + 1)[1:]
    profile = np.concatenate(
        [
            np.stack([radii, limbus - depth], axis=1),
            RADIUS * np.stack([np.sin(angles), np.cos(angles)], axis=1),
        ]
    )
    places = np.concatenate([_IRIS_PART * _IRIS_RINGS, np.linspace(_IRIS_PART, 1.0, _SCLERA_RINGS + 1)[1:]])
    return _revolved(center, axes, profile, places, slots=(len(_IRIS_RINGS) - 1, 1, 0))


def _cornea(center, axes):
    """Return the same of the clear cap over the iris."""
    radii = IRIS_RADIUS * _CORNEA_RINGS
    sphere = np.sqrt(RADIUS**2 - radii**2)
    # A bump that leaves the eyeball's sphere smoothly.
    bump = _BULGE * np.square(np.cos(0.5 * np.pi * np.minimum(_CORNEA_RINGS / _CORNEA_RINGS[-1], 1.0)))
    lift = np.where(_CORNEA_RINGS < _CORNEA_RINGS[-1], 2e-5, -1e-4)
    return _revolved(center, axes, np.stack([radii, sphere + bump + lift], axis=1), _CORNEA_RINGS, slots=(0, 0, 0))


def _lid(opening, center):
    """Return the same of the lids' inner border, a strip from their edge to the eyeball: no gap is dark."""
    edge = np.concatenate([opening.upper, opening.lower[::-1]])
    edge = (np.roll(edge, 1, axis=0) + edge + np.roll(edge, -1, axis=0)) / 3.0
    outward = edge - edge.mean(axis=0)
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    ball = center + (RADIUS - 0.0003) * (edge - center) / np.linalg.norm(edge - center, axis=1)[:, None]
    # It begins below the skin.
    rings = np.stack([edge + 0.0012 * outward + (0.0, 0.0006, 0.0), 0.5 * (edge + ball), ball])
    count = len(edge)
    ring, place = np.meshgrid(np.arange(2), np.arange(count), indexing="ij")
    after, first = (place + 1) % count, ring * count
    faces = np.stack([first + place, first + after, first + count + after, first + count + place], axis=-1)
    faces = faces.reshape(-1, 4)[:, :: 1 if center[0] > 0.0 else -1]
    return rings.reshape(-1, 3), faces, np.zeros((3 * count, 2)), np.zeros(len(faces), int)


def _revolved(center, axes, profile, places, slots):
    """Return (vertices, faces, UVs of vertices, slots of faces) of a profile of (radius, height) [m] about the gaze.

    places: radius of each ring in the image; slots: (number of rings, slot before, slot after it).
    """
    turn = 2.0 * np.pi * np.arange(_SEGMENTS) / _SEGMENTS
    round_about = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    across = profile[:, None, :1] * round_about
    local = np.concatenate([across, np.broadcast_to(profile[:, None, 1:], (*across.shape[:2], 1))], axis=2)
    vertices = (local @ axes + center).reshape(-1, 3)
    uvs = (0.5 + 0.5 * np.asarray(places)[:, None, None] * round_about).reshape(-1, 2)
    ring, segment = np.meshgrid(np.arange(len(profile) - 1), np.arange(_SEGMENTS), indexing="ij")
    after = (segment + 1) % _SEGMENTS
    first, second = ring * _SEGMENTS, (ring + 1) * _SEGMENTS
    faces = np.stack([first + segment, second + segment, second + after, first + after], axis=-1).reshape(-1, 4)
    count, inner, outer = slots
    return vertices, faces, uvs, np.where(ring.ravel() < count, inner, outer)


def _object(name, parts, head_object, materials):
    """Return a child of the head, of parts as `_revolved` returns them."""
    starts = np.cumsum([0] + [len(vertices) for vertices, *_ in parts])
    vertices = np.concatenate([part[0] for part in parts])
    faces = np.concatenate([part[1] + start for part, start in zip(parts, starts[:-1], strict=True)])
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices.tolist(), [], faces.tolist())
    uvs = np.concatenate([part[2] for part in parts])[faces.ravel()]
    mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", uvs.astype(np.float32).ravel())
    mesh.polygons.foreach_set("material_index", np.concatenate([part[3] for part in parts]).astype(np.int32))
    for material in materials:
        mesh.materials.append(material)
    mesh.shade_smooth()
    placed = bpy.data.objects.new(name, mesh)
    placed.parent = head_object
    bpy.context.scene.collection.objects.link(placed)
    return placed


def _eye_material(name, solid_color, roughness, specular):
    material = bpy.data.materials.new(name)
    material.diffuse_color = *solid_color, 1.0
    tree = material.node_tree
    principled = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    principled.inputs["Roughness"].default_value = roughness
    principled.inputs["Specular IOR Level"].default_value = specular
    image = tree.nodes.new("ShaderNodeTexImage")
    image.image = bpy.data.images.get("Eye") or eye_image()
    tree.links.new(image.outputs["Color"], principled.inputs["Base Color"])
    return material


def _cornea_material():
    material = bpy.data.materials.new("Cornea")
    principled = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    principled.inputs["Roughness"].default_value = 0.04
    principled.inputs["IOR"].default_value = 1.376
    principled.inputs["Transmission Weight"].default_value = 1.0
    return material


def _lid_material():
    material = bpy.data.materials.new("Lid")
    principled = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    material.diffuse_color = (0.50, 0.22, 0.18, 1.0)
    principled.inputs["Base Color"].default_value = material.diffuse_color
    principled.inputs["Roughness"].default_value = 0.3
    return material


def eye_image():
    """Return an image of an eye by distance and azimuth from its pupil: iris with its fibers, sclera, shadow of the
    lid.
    """
    x, y = np.meshgrid(*[2.0 * (np.arange(_IMAGE_SIZE) + 0.5) / _IMAGE_SIZE - 1.0] * 2)
    distance, azimuth = np.hypot(x, y), np.arctan2(y, x)
    iris = distance / _IRIS_PART
    fibres = _fibres(azimuth, iris)
    near_pupil = np.exp(-(((iris - 0.42) / 0.14) ** 2))[..., None]
    color = np.array([0.29, 0.355, 0.30]) * (0.55 + 0.75 * fibres[..., None])
    color = color * (1.0 - 0.75 * near_pupil) + 0.75 * near_pupil * np.array([0.42, 0.30, 0.16])
    color *= (1.0 - 0.75 * _step(iris, 0.80, 1.0))[..., None]  # the dark ring at the border
    color *= _step(iris, PUPIL_RADIUS / IRIS_RADIUS - 0.03, PUPIL_RADIUS / IRIS_RADIUS + 0.03)[..., None]
    white = np.array([0.74, 0.70, 0.67]) - _step(distance, 0.82, 0.92)[..., None] * np.array([0.05, 0.20, 0.20])
    border = _step(iris, 0.94, 1.06)[..., None]
    color = (1.0 - border) * color + border * white
    # Lids shade the eyeball more finely than a light's shadow map resolves.
    lid = 1.0 - 0.55 * _step(y, 0.25, 0.85)
    color *= lid[..., None]
    image = bpy.data.images.new("Eye", _IMAGE_SIZE, _IMAGE_SIZE)
    image.pixels.foreach_set(np.dstack([color, np.ones_like(x)]).astype(np.float32).ravel())
    image.update()
    image.pack()
    return image


def _fibres(azimuth, iris):
    """Brightness from 0 to 1 of an iris' fibers, which run from the pupil outward."""
    rng = np.random.default_rng(4)
    waves = np.zeros_like(azimuth)
    for count, strength in ((23, 0.5), (41, 0.6), (67, 0.6), (109, 0.5), (173, 0.35)):
        phase, bend = rng.uniform(0.0, 2.0 * np.pi), rng.normal(0.0, 2.0)
        waves += strength * np.sin(count * azimuth + phase + bend * iris)
    return 1.0 / (1.0 + np.exp(-1.6 * waves))


def _step(values, low, high):
    part = np.clip((values - low) / (high - low), 0.0, 1.0)
    return part * part * (3.0 - 2.0 * part)
