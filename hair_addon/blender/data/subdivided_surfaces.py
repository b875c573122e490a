# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that modifiers subdivide: the size of the cage, and the smooth surface at rest.

Blender's rest positions of a subdivided mesh lie on the flat faces of its cage; smooth_surface.py estimates the rest.
"""

import hashlib

import numpy as np

from ...core import geometry
from ..host import scene_time
from ..host.caches import Cache

smooth_cache = Cache(capacity=8)  # digest of all inputs → (V, 3) smooth positions


def cage_corners(surface_object, depsgraph, faces):
    """Number of corners of the cage that an object's modifiers subdivide smoothly; 0 without such modifiers.

    faces: `Faces` of the evaluated mesh. Faces that other modifiers add count as part of the cage.
    """
    smoothing = [modifier for modifier in surface_object.modifiers if _is_smoothing(modifier)]
    if not smoothing:
        return 0
    return _corners_before(smoothing, depsgraph, faces) or len(faces.corner_vertices)


def undivided_corners(surface_object, depsgraph, faces):
    """Return `cage_corners` for modifiers that subdivide in any way; 0 if none does in this depsgraph."""
    return _corners_before(filter(_is_dividing, surface_object.modifiers), depsgraph, faces)


def is_divided(surface_object):
    """Whether an object's modifiers subdivide its mesh, at the current level or at another."""
    return any(map(_is_dividing, surface_object.modifiers))


def moves_uvs(surface_object):
    """Whether modifiers may change UV coordinates other than by subdivision."""
    return any(modifier.type in {"NODES", "UV_PROJECT", "UV_WARP"} for modifier in surface_object.modifiers)


def _corners_before(modifiers, depsgraph, faces):
    levels = sum(_levels(modifier, depsgraph) for modifier in modifiers)
    # The first level makes a quad of each corner, the others make four quads of each quad.
    return 0 if levels == 0 else (len(faces.starts) - 1) // 4 ** (levels - 1)


def _is_smoothing(modifier):
    return _is_dividing(modifier) and getattr(modifier, "subdivision_type", "CATMULL_CLARK") == "CATMULL_CLARK"


def _is_dividing(modifier):
    return modifier.type in {"MULTIRES", "SUBSURF"} and (modifier.show_viewport or modifier.show_render)


def _levels(modifier, depsgraph):
    is_render = scene_time.is_rendered(depsgraph)
    if not (modifier.show_render if is_render else modifier.show_viewport):
        return 0
    levels = modifier.render_levels if is_render else modifier.levels
    render = depsgraph.scene.render
    if not render.use_simplify:
        return levels
    return min(levels, render.simplify_subdivision_render if is_render else render.simplify_subdivision)


def smooth_positions(rest, faces, corners):
    """Return (V, 3) float32 positions of vertices on the smooth surface at rest; `rest` itself if `corners` is 0."""
    if corners == 0:
        return rest
    key = hashlib.blake2b(rest.tobytes(), digest_size=16)
    for array in (faces.corner_vertices, faces.starts, np.int64(corners)):
        key.update(array.tobytes())
    return smooth_cache.get(key.digest(), lambda: geometry.smooth_surface.smoothed(rest, faces, corners))
