# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair in 3-D viewports: pictures that settle, outlines of what is selected, what was shown before."""

from ....core.lazy import submodules

__getattr__ = submodules(__name__)
