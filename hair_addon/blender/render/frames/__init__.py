# SPDX-License-Identifier: GPL-3.0-or-later
"""Rendered frames: the render engine, tiles, panoramas, and compositing over other engines' renders."""

from ....core.lazy import submodules

__getattr__ = submodules(__name__)
