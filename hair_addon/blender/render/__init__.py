# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene's hair as it is drawn: its strands made for the GPU, its light, films of it; offscreen pictures."""

from ...core.lazy import submodules

__getattr__ = submodules(__name__)
