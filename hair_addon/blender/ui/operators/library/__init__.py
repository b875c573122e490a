# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators of grooms in asset libraries: saved, and put on a mesh."""

from .apply_groom import VELLUS_OT_apply_groom
from .save_groom import VELLUS_OT_save_groom

CLASSES = (VELLUS_OT_save_groom, VELLUS_OT_apply_groom)
