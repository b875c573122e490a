# SPDX-License-Identifier: GPL-3.0-or-later
"""The law of lengths: steps that should keep lengths keep the drawn length of each guide and strand."""

import contextlib

import bpy
import numpy as np

from hair_addon.blender.data import scene
from hair_addon.blender.render import hair_cache
from hair_addon.core.errors import HairError
from hair_addon.core.geometry import strands

# Steps that do not change hair, or deform it: strands move rigidly, in local coordinates, with a bending surface.
_KEEPING = {
    *("apply_preset", "deform_surface", "duplicate", "look", "other_scene", "remove_material", "rename"),
    *("sculpt", "use_button"),
}
# Tools that keep the lengths of guides in the world; lengths of the hair between them change with the guides' shapes.
_KEEPING_TOOLS = {"smooth_guides", "lift_guides", "attract_guides"}

_ROUNDING = 2e-4  # fraction of the distance from the origin: points have seven digits, and errors of segments add up


def law_of(name, values):
    """Return the context for a step of the walk."""
    if name in _KEEPING:
        return are_kept(("GUIDES", "HAIR"))
    is_keeping = values.get("tool") in _KEEPING_TOOLS
    return are_kept(("GUIDES",), is_in_world=True) if is_keeping else contextlib.nullcontext()


@contextlib.contextmanager
def are_kept(kinds, is_in_world=False):
    """Assert that drawn hair that is up to date and without errors, before and after, keeps its lengths."""
    before = _drawn(kinds, is_in_world)
    yield
    bpy.context.view_layer.update()
    after = _drawn(kinds, is_in_world)
    for name in before.keys() & after.keys():
        (lengths, size), (now, _size) = before[name], after[name]
        assert len(now) == len(lengths), f"{name} has {len(now)} strands, {len(lengths)} before"
        away = float(abs(now - lengths).max(initial=0.0))
        assert away <= _ROUNDING * size, f"{name} is up to {away:.3g} longer or shorter, of {size:.3g}"


def _drawn(kinds, is_in_world):
    """Return {object's name: ((S,) lengths, largest distance of a point from the origin)}."""
    found = {}
    for one in bpy.context.view_layer.objects:
        if one.type != "CURVES" or one.data.vellus.kind not in kinds or not len(one.data.curves):
            continue
        guides = one.data if one.data.vellus.kind == "GUIDES" else one.data.vellus.guide_curves
        if one.data.vellus.status or one.data.vellus.is_stale or (guides is not None and guides.vellus.is_stale):
            continue
        if is_in_world and _is_stretched(one.data.surface):
            continue
        with contextlib.suppress(HairError):
            points = hair_cache.strands_on_gpu(one.data).points.astype(np.float64)
            if is_in_world:
                place = np.array(one.matrix_world)
                points = points @ place[:3, :3].T + place[:3, 3]
            found[one.name] = strands.lengths(points), float(abs(points).max())
    return found


def _is_stretched(surface_object):
    """Whether a surface is deformed in stretched coordinates.

    Tools keep the lengths of guides at rest. The pose rotates guides in local coordinates, where a guide that points
    another way is stretched by another factor.
    """
    try:
        surface = scene.read_surface(surface_object, bpy.context.evaluated_depsgraph_get())
    except HairError:
        return False
    return surface.is_deformed and surface.shape is None
