# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of settings, tables and grooms, and file locks between processes."""

from typing import TYPE_CHECKING

from ..lazy import submodules

if TYPE_CHECKING:
    from . import (
        array_file,
        array_grooms,
        curve_file,
        curve_units,
        file_lock,
        frame_cache,
        frame_manifest,
        groom_curves,
        library_settings,
        plain_file,
        settings_file,
        style_presets,
        table_cache,
        table_exr,
        whole_file,
    )
else:
    __getattr__ = submodules(__name__)
