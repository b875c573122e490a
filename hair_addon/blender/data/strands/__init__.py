# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves ↔ arrays: points, attributes, deformation, and the lines that part and guide them."""

from ....core.lazy import submodules

__getattr__ = submodules(__name__)
