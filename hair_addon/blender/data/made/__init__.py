# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes and images made of hair: cards, tubes, grooms of asset libraries."""

from ....core.lazy import submodules

__getattr__ = submodules(__name__)
