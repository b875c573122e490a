# SPDX-License-Identifier: GPL-3.0-or-later
"""What holds for every file: which device computes hair."""

import bpy

from .translations import CONTEXT

# The add-on's module: the extension's package, or hair_addon itself where it runs from a checkout.
ADDON_MODULE = __package__.removesuffix(".blender").removesuffix(".hair_addon")


class VellusPreferences(bpy.types.AddonPreferences):
    """Preferences of the extension"""

    bl_idname = ADDON_MODULE

    device: bpy.props.EnumProperty(
        name="Compute Device",
        description="Where hair is computed",
        translation_context=CONTEXT,
        items=[("cpu", "CPU", "The processor"), ("cuda", "NVIDIA GPU", "The first CUDA device")],
        default="cpu",
    )


def is_extension():
    """Whether this is an installed extension, with folders of its own, and no checkout."""
    return ADDON_MODULE.startswith("bl_ext.")


def device():
    """Name of the Warp device that the user chose; the processor where there is no choice, or no such device."""
    addon = bpy.context.preferences.addons.get(ADDON_MODULE)
    if addon is None or addon.preferences is None or addon.preferences.device == "cpu":
        return "cpu"
    import warp as wp  # late: it takes longer to import than Blender may take to start

    return "cuda" if wp.is_cuda_available() else "cpu"
