# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of settings, tables and grooms, and file locks between processes."""

from typing import TYPE_CHECKING

from ..lazy import submodules

if TYPE_CHECKING:
    from . import (
        array_file,
        array_grooms,
        array_layouts,
        atomic_file,
        curve_file,
        curve_units,
        file_lock,
        flat_curves,
        frame_cache,
        frame_manifest,
        gltf_springs,
        groom_curves,
        library_settings,
        light_images,
        settings_file,
        style_presets,
        table_cache,
        table_exr,
        untrusted_file,
    )
else:
    __getattr__ = submodules(__name__)
