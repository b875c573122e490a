# SPDX-License-Identifier: GPL-3.0-or-later
"""Light scattering by fibers: the reference for the shaders."""

from typing import TYPE_CHECKING

from ..lazy import submodules

if TYPE_CHECKING:
    from . import appearance, fibre, light_paths, presets, strand_colors, strand_looks, tables
else:
    __getattr__ = submodules(__name__)
