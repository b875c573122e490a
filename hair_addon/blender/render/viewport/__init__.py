# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair in 3D viewports: progressive pictures, outlines of selected hair, and the history of pictures."""

from ....core.lazy import submodules

__getattr__ = submodules(__name__)
