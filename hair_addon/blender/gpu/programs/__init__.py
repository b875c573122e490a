# SPDX-License-Identifier: GPL-3.0-or-later
"""GLSL files → GPU programs, and their uniform blocks."""

from ....core.lazy import submodules

__getattr__ = submodules(__name__)
