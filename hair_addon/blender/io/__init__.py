# SPDX-License-Identifier: GPL-3.0-or-later
"""Import and export: meshes, curves, grooms, tables."""

from ...core.lazy import submodules

__getattr__ = submodules(__name__)
