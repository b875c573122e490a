# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair on the GPU: textures, lights, drawing, shadows, visibility."""

from ...core.lazy import submodules

__getattr__ = submodules(__name__)
