# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings as Blender's properties, with keyframes, preferences, saved looks and translations."""

from ...core.lazy import submodules

__getattr__ = submodules(__name__)
