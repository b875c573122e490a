# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawing: the viewport, offscreen pictures and the render engine."""

from ...core.lazy import submodules

__getattr__ = submodules(__name__)
