# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames and sequences of images."""

from ....core.lazy import submodules

__getattr__ = submodules(__name__)
