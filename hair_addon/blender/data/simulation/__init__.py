# SPDX-License-Identifier: GPL-3.0-or-later
"""Data of simulations: poses of surfaces, force fields, colliders, wetness."""

from ....core.lazy import submodules

__getattr__ = submodules(__name__)
