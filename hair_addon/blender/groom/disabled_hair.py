# SPDX-License-Identifier: GPL-3.0-or-later
"""Disabling of hair and guides while frames are baked without a window, to skip their evaluation."""

import contextlib
from collections.abc import Generator, Sequence

import bpy
from bpy.types import Curves, Object, Scene

from ..data.simulation import simulated_world
from ..settings import properties


@contextlib.contextmanager
def disabled_in_viewports(guides_list: Sequence[Curves], scene: Scene) -> Generator[None]:
    """Disable hair and guides in viewports, and enable them again on exit.

    Only without a window, and if the meshes that the guides need are visible: hidden meshes may be evaluated only
    because hair follows them. Curves with keyframes or drivers stay enabled: Blender does not animate the settings of
    disabled objects.
    """
    if not bpy.app.background or not all(needed.visible_get() for needed in _needed(guides_list)):
        yield
        return
    hidden = [curves_object for curves_object in scene.objects if _may_hide(curves_object)]
    uids = {curves_object.session_uid for curves_object in hidden}
    try:
        for curves_object in hidden:
            curves_object.hide_viewport = True
        yield
    finally:
        for curves_object in bpy.data.objects:  # excludes objects deleted in the meantime
            if curves_object.session_uid in uids:
                curves_object.hide_viewport = False


def _may_hide(curves_object):
    if curves_object.type != "CURVES" or curves_object.hide_viewport:
        return False
    return curves_object.data.vellus.kind != "NONE" and curves_object.data.animation_data is None


def _needed(guides_list: Sequence[Curves]) -> list[Object]:
    """Return the meshes that guides grow on and collide with."""
    needed = [guides.surface for guides in guides_list if guides.surface is not None]
    for guides in guides_list:
        needed += simulated_world.colliders(properties.dynamics_of(guides.vellus).colliders)
    return needed
