# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender as an application: paths, references across undo, long operations, the command line."""

from ...core.lazy import submodules

__getattr__ = submodules(__name__)
