# SPDX-License-Identifier: GPL-3.0-or-later
"""The law of lengths: what does not change lengths leaves each guide and strand as long as it is drawn."""

import contextlib

import bpy
import numpy as np

from hair_addon.blender.render import hair_cache
from hair_addon.core.errors import HairError
from hair_addon.core.geometry import strands

# Steps that change nothing of hair, or carry it: strands stand rigidly, in local coordinates, on a surface that bends.
_KEEPING = {
    *("apply_preset", "deform_surface", "duplicate", "look", "other_scene", "remove_material", "rename"),
    *("sculpt", "use_button"),
}
# Tools that keep the lengths of guides in the world; those of the hair between them change with their shapes.
_KEEPING_TOOLS = {"smooth_guides", "lift_guides", "attract_guides"}

_ROUNDING = 2e-4  # of how far from the origin hair is: its points have seven digits, and its segments add up


def law_of(name, values):
    """The context in which a step of the walk is taken."""
    if name in _KEEPING:
        return are_kept(("GUIDES", "HAIR"))
    is_keeping = values.get("tool") in _KEEPING_TOOLS
    return are_kept(("GUIDES",), is_in_world=True) if is_keeping else contextlib.nullcontext()


@contextlib.contextmanager
def are_kept(kinds, is_in_world=False):
    """Assert that what is drawn before and after, up to date and without a complaint, is as long as it was."""
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
    """{object's name: ((S,) lengths, how far from the origin the furthest point is)}."""
    found = {}
    for one in bpy.context.view_layer.objects:
        if one.type != "CURVES" or one.data.vellus.kind not in kinds or not len(one.data.curves):
            continue
        if one.data.vellus.status or one.data.vellus.is_stale:
            continue
        with contextlib.suppress(HairError):
            points = hair_cache.strands_on_gpu(one.data).points.astype(np.float64)
            if is_in_world:
                place = np.array(one.matrix_world)
                points = points @ place[:3, :3].T + place[:3, 3]
            found[one.name] = strands.lengths(points), float(abs(points).max())
    return found
