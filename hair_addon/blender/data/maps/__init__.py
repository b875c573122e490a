# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps of settings: images, vertex groups and attributes ↔ values of strands."""

from ....core.lazy import submodules

__getattr__ = submodules(__name__)
