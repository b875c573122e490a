# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender requires a package beside blender_manifest.toml; it re-exports what Blender and its glTF exporter call."""

from .hair_addon import register, unregister

__all__ = ["glTF2ExportUserExtension", "register", "unregister"]


def glTF2ExportUserExtension():
    """Return the hooks of Blender's glTF exporter, which calls this name of each add-on."""
    from .hair_addon.blender.io.gltf_hooks import GltfHooks

    return GltfHooks()
