# SPDX-License-Identifier: GPL-3.0-or-later
"""USD files: reading of curves, writing of grooms and of moving hair."""

from ....core.lazy import submodules

__getattr__ = submodules(__name__)
