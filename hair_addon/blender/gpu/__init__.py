# SPDX-License-Identifier: GPL-3.0-or-later
"""Shader programs, textures and passes on the GPU."""

from ...core.lazy import submodules

__getattr__ = submodules(__name__)
