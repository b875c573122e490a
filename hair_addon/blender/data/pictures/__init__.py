# SPDX-License-Identifier: GPL-3.0-or-later
"""What a picture is taken of and with: cameras, lights, materials, compositor nodes."""

from ....core.lazy import submodules

__getattr__ = submodules(__name__)
