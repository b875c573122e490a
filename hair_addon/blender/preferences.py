# SPDX-License-Identifier: GPL-3.0-or-later
"""What holds for every file: which device computes hair."""

import bpy

# The add-on's module: the extension's package, or hair_addon itself where it runs from a checkout.
ADDON_MODULE = __package__.partition(".hair_addon.")[0].partition(".blender")[0]


class VellusPreferences(bpy.types.AddonPreferences):
    """Preferences of the extension"""

    bl_idname = ADDON_MODULE

    device: bpy.props.EnumProperty(
        name="Compute Device",
        description="Where hair is computed",
        items=[("cpu", "CPU", "The processor"), ("cuda", "NVIDIA GPU", "The first CUDA device")],
        default="cpu",
    )


def device():
    """Name of the Warp device that the user chose; the processor where the preferences do not exist."""
    addon = bpy.context.preferences.addons.get(ADDON_MODULE)
    return addon.preferences.device if addon and addon.preferences else "cpu"
