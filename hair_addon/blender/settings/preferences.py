# SPDX-License-Identifier: GPL-3.0-or-later
"""Preferences: the compute device, the device that makes strands in viewports, and light paths there."""

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
    stroke_device: bpy.props.EnumProperty(
        name="Strands While Combing",
        description="Device that makes strands in viewports while guides are combed or styles change",
        translation_context=CONTEXT,
        items=[
            ("AUTOMATIC", "Automatic", "Use the graphics card if it is faster"),
            ("GPU", "Graphics Card", "The graphics card that draws, of any vendor"),
            ("COMPUTE", "Compute Device", "The device that computes hair"),
        ],
        default="AUTOMATIC",
    )

    has_live_light: bpy.props.BoolProperty(
        name="Light Grid in Viewports",
        description=(
            "Follow light paths in Material Preview and Rendered shading while nothing moves, on the compute device or "
            "one core of the processor, if the scene's Multiple Scattering is Light Grid"
        ),
        translation_context=CONTEXT,
        default=True,
    )

    def draw(self, _context):
        """Draw rows of all preferences: Blender draws none by itself."""
        self.layout.use_property_split = True
        for name in ("device", "stroke_device", "has_live_light"):
            self.layout.prop(self, name)


def is_extension():
    """Whether this is an installed extension, with its own folders, and not a checkout."""
    return ADDON_MODULE.startswith("bl_ext.")


def device():
    """Return the name of the chosen Warp device; "cpu" without a choice or without that device."""
    chosen = _chosen()
    if chosen is None or chosen.device == "cpu":
        return "cpu"

    return "cuda" if kernels.kernel_cache.wp.is_cuda_available() else "cpu"


def stroke_device():
    """Return the choice for strands while combing: "AUTOMATIC", "GPU" or "COMPUTE"."""
    chosen = _chosen()
    return "AUTOMATIC" if chosen is None else chosen.stroke_device


def has_live_light():
    """Return whether light paths may be followed in viewports."""
    chosen = _chosen()
    return True if chosen is None else chosen.has_live_light


def _chosen():
    addon = bpy.context.preferences.addons.get(ADDON_MODULE)
    return None if addon is None else addon.preferences
