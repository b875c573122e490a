# SPDX-License-Identifier: GPL-3.0-or-later
"""Dynamics: guides as elastic rods that move with their surface, in units of the SI."""

from typing import TYPE_CHECKING

from ..lazy import submodules

if TYPE_CHECKING:
    from . import air, closed_parts, colliders, contact, contact_queries, hair_volume, nearest_surface, rigid_motion
else:
    __getattr__ = submodules(__name__)
