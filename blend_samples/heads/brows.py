# SPDX-License-Identifier: GPL-3.0-or-later
"""Brows and lashes for the sample's head: hair of its own, by the public API, on narrow patches below the skin."""

import math

import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree

from hair_addon import api

BROWN, BLACK = (1.1, 1.8, 2.9), (2.2, 2.9, 3.8)  # absorption per fiber radius: of brows, of lashes
_DEPTH = 0.0003  # [m] of the patches below the skin

# Of the left brow, from the nose outward: place along X and height [m], half width [m], direction of its hair [rad]
# from outward to upward.
_BROW = np.array(
    [
        (0.0125, 0.7436, 0.0024, math.radians(62.0)),
        (0.0200, 0.7462, 0.0036, math.radians(42.0)),
        (0.0280, 0.7488, 0.0034, math.radians(26.0)),
        (0.0360, 0.7505, 0.0029, math.radians(6.0)),
        (0.0430, 0.7495, 0.0021, math.radians(-18.0)),
        (0.0490, 0.7465, 0.0010, math.radians(-34.0)),
    ]
)
_BROW_STEPS, _BROW_ROWS = 28, 5
_BROW_LENGTH = 0.0095  # [m]
_LASH_STEPS = 26
_UPPER_LASH, _LOWER_LASH = 0.0085, 0.0050  # [m]
_POINTS = 8  # of each guide


def build(head_object, openings):
    """Brows and lashes of a head, whose `eyes.openings` are given; returns the Curves of their hair."""
    skin = BVHTree.FromObject(head_object, bpy.context.evaluated_depsgraph_get())
    brows = [_brow(skin, side) for side in (1.0, -1.0)]
    lashes = [lash for opening in openings for lash in _lashes(opening)]
    return (
        _hair(
            "Brows", brows, head_object, strand_count=1500, radius=4.2e-5, tip_taper=0.3, color=BROWN, roughness=0.35
        ),
        _hair(
            "Lashes", lashes, head_object, strand_count=420, radius=1.3e-4, tip_taper=0.1, color=BLACK, roughness=0.7
        ),
    )


def guides_on_skin(head_object):
    """Return (G, P, 3) guides of both brows, whose roots are on the skin."""
    skin = BVHTree.FromObject(head_object, bpy.context.evaluated_depsgraph_get())
    lines = np.concatenate([_brow(skin, side)[1].reshape(-1, _POINTS, 3) for side in (1.0, -1.0)])
    lines[:, 0] += (lines[:, 1] - lines[:, 0]) * (_DEPTH / np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1))[:, None]
    return lines


def _brow(skin, side):
    """Return (grid (R, C, 3) of roots, their (R, C, P, 3) guides) of the brow on a side."""
    roots, guides = [], []
    for row in np.linspace(-1.0, 1.0, _BROW_ROWS):
        # Its inner end is round, and its upper border begins last.
        along = np.linspace(0.06 * row**2 + 0.03 * (1.0 + row), 1.0, _BROW_STEPS)
        x, height, half_width, angle = (np.interp(along, np.linspace(0.0, 1.0, len(_BROW)), part) for part in _BROW.T)
        line = [_on_skin(skin, side * x[i], height[i] + row * half_width[i]) for i in range(_BROW_STEPS)]
        roots.append([point - _DEPTH * normal for point, normal in line])
        # Hair of the upper and of the lower border turns toward the middle.
        turns = angle - 0.35 * row
        lengths = _BROW_LENGTH * (0.75 + 0.45 * np.sin(np.pi * np.clip(along + 0.12, 0.0, 1.0)))
        guides.append(
            [_lying(skin, *line[i], side, turns[i], lengths[i] * (1.0 - 0.25 * abs(row))) for i in range(_BROW_STEPS)]
        )
    return np.array(roots), np.array(guides)


def _on_skin(skin, x, height):
    """Return (point, normal) of the face at a place as seen from the front."""
    point, normal, _face, _distance = skin.ray_cast(Vector((x, -1.0, height)), Vector((0.0, 1.0, 0.0)))
    return np.array(point), np.array(normal)


def _lying(skin, root, normal, side, turn, length):
    """Return (P, 3): a hair that leaves the skin and lies down along it."""
    points = [root - _DEPTH * normal]
    for step in range(1, _POINTS):
        part = step / (_POINTS - 1)
        bend = turn - 0.35 * part
        aim = np.array([side * math.cos(bend), 0.0, math.sin(bend)])
        ahead = Vector(root + part * length * (aim - (aim @ normal) * normal))
        near, near_normal, _face, _distance = skin.find_nearest(ahead)
        points.append(np.array(near) + (0.0004 + 0.0009 * math.sin(0.75 * math.pi * part)) * np.array(near_normal))
    return np.array(points)


def _lashes(opening):
    """Yield the same of the lashes of an eye's upper and lower lid."""
    center = opening.center
    for border, length, lift in ((opening.upper, _UPPER_LASH, 1.0), (opening.lower, _LOWER_LASH, -0.55)):
        place = np.linspace(0.10, 0.97, _LASH_STEPS) * (len(border) - 1)
        index = np.arange(len(border))
        line = np.stack([np.interp(place, index, _smooth(border[:, axis])) for axis in range(3)], axis=1)
        part = np.linspace(0.0, 1.0, _LASH_STEPS)
        lengths = length * (0.55 + 0.45 * np.sin(np.pi * (0.15 + 0.65 * part)))
        fan = (line[:, 0] - center[0]) / np.ptp(line[:, 0])
        guides = [_lash(line[i], lengths[i], fan[i], lift) for i in range(_LASH_STEPS)]
        behind = np.array([0.0, 0.0005, 0.0002 * lift])
        roots = np.stack([line + 0.5 * behind, line - 0.5 * behind])
        yield roots, np.stack([np.array(guides) + 0.5 * behind, np.array(guides) - 0.5 * behind])


def _lash(root, length, fan, lift):
    """Return (P, 3): a lash that leaves its lid forward and curls away from the eye; fan: to the side, from -½ to ½."""
    points = [root]
    for step in range(1, _POINTS):
        part = step / (_POINTS - 1)
        rise = lift * (-0.25 + 1.35 * part)
        way = np.array([0.9 * fan, -1.0 + 0.35 * part, rise])
        points.append(points[-1] + length / (_POINTS - 1) * way / np.linalg.norm(way))
    return np.array(points)


def _smooth(values, width=5):
    padded = np.pad(values, width // 2, mode="edge")
    return np.convolve(padded, np.ones(width) / width, mode="valid")


def _hair(name, parts, head_object, color, roughness, **settings):
    """Hair between guides on the patches of parts (roots (R, C, 3), guides (R, C, P, 3))."""
    patch = _patch(f"{name} patch", [roots for roots, _guides in parts], head_object)
    lines = np.concatenate([guides.reshape(-1, _POINTS, 3) for _roots, guides in parts])
    curves = bpy.data.hair_curves.new(f"{name} guides")
    curves.add_curves([_POINTS] * len(lines))
    curves.attributes["position"].data.foreach_set("vector", lines.astype(np.float32).ravel())
    drawn = bpy.data.objects.new(curves.name, curves)
    bpy.context.scene.collection.objects.link(drawn)
    guides = api.use_as_guides(drawn, patch)
    hair = api.interpolate_hair(guides, seed=3, point_count=12, **settings)
    api.shade(hair, mode="energy", parametrization="ABSORPTION", absorption=color, roughness=roughness)
    drawn.hide_render = True
    api.add_style(hair, api.Frizz(amplitude=0.00025, wavelength=0.006, seed=5))
    holder = next(o for o in bpy.context.scene.objects if o.data == hair)
    holder.name = hair.name = name
    return hair


def _patch(name, grids, head_object):
    """Return a mesh of the grids of roots: hair grows on it, and no picture shows it."""
    vertices, faces = [], []
    for grid in grids:
        rows, columns, _xyz = grid.shape
        first = len(vertices)
        vertices += grid.reshape(-1, 3).tolist()
        for row in range(rows - 1):
            for i in range(first + row * columns, first + (row + 1) * columns - 1):
                faces.append((i, i + 1, i + columns + 1, i + columns))
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    patch = bpy.data.objects.new(name, mesh)
    patch.parent = head_object
    patch.hide_render = True
    bpy.context.scene.collection.objects.link(patch)
    bpy.context.view_layer.update()
    return patch
