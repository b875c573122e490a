# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials and node groups for Cycles and EEVEE."""

from ...core.lazy import submodules

__getattr__ = submodules(__name__)
