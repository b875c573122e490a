# SPDX-License-Identifier: GPL-3.0-or-later
"""Data of pictures: cameras, light links, materials, drawn meshes, compositor nodes, files."""

from ....core.lazy import submodules

__getattr__ = submodules(__name__)
