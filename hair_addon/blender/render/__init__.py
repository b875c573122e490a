# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawing a scene's hair: strands for the GPU, lighting, films and offscreen pictures."""

from ...core.lazy import submodules

__getattr__ = submodules(__name__)
