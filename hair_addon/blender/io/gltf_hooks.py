# SPDX-License-Identifier: GPL-3.0-or-later
"""Hooks of Blender's glTF exporter: files have the springs of bone chains."""

from ...core.files import gltf_springs
from ..data.made import chain_armatures


class GltfHooks:
    """Hooks that the exporter calls; the exporter is loaded only while its add-on is enabled."""

    def gather_gltf_extensions_hook(self, gltf, _export_settings):
        """Add the springs to an exported file before it is written."""
        described = gltf_springs.extension(gltf.to_dict()["nodes"], chain_armatures.all_springs())
        if described:
            from io_scene_gltf2.io.com.gltf2_io_extensions import Extension

            gltf.extensions[gltf_springs.NAME] = Extension(gltf_springs.NAME, described, required=False)
