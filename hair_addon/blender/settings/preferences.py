# SPDX-License-Identifier: GPL-3.0-or-later
"""Preferences: the compute device."""

import bpy

from ...core import kernels
from .translations import CONTEXT

# The add-on's module: the extension's package, or hair_addon itself where it runs from a checkout.
ADDON_MODULE = __package__.removesuffix(".blender.settings").removesuffix(".hair_addon")


class VellusPreferences(bpy.types.AddonPreferences):
    """Preferences of the extension"""

    bl_idname = ADDON_MODULE

    device: bpy.props.EnumProperty(
        name="Compute Device",
        description="Device that computes hair",
        translation_context=CONTEXT,
        items=[("cpu", "CPU", "Processor"), ("cuda", "NVIDIA GPU", "First CUDA device")],
        default="cpu",
    )


def is_extension():
    """Whether this is an installed extension, with its own folders, and not a checkout."""
    return ADDON_MODULE.startswith("bl_ext.")


def device():
    """Name of the Warp device that the user chose; the processor where there is no choice, or no such device."""
    addon = bpy.context.preferences.addons.get(ADDON_MODULE)
    if addon is None or addon.preferences is None or addon.preferences.device == "cpu":
        return "cpu"

    return "cuda" if kernels.kernel_cache.wp.is_cuda_available() else "cpu"
