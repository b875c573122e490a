# SPDX-License-Identifier: GPL-3.0-or-later
"""Conversion between Blender's data and arrays."""

from ...core.lazy import submodules

__getattr__ = submodules(__name__)
