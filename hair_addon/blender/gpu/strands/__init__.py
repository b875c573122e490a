# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands made on the GPU: interpolation between guides, styles, deformation with the surface, and changes."""

from ....core.lazy import submodules

__getattr__ = submodules(__name__)
