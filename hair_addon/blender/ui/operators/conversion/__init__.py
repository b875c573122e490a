# SPDX-License-Identifier: GPL-3.0-or-later
"""One file per operator that makes guides or hair of curves, particles, or the groom of another mesh."""

from .convert_particles import VELLUS_OT_convert_particles
from .import_groom import VELLUS_OT_import_groom
from .transfer_groom import VELLUS_OT_transfer_groom
from .use_as_guides import VELLUS_OT_use_as_guides
from .use_as_hair import VELLUS_OT_use_as_hair

CLASSES = (
    VELLUS_OT_use_as_guides,
    VELLUS_OT_use_as_hair,
    VELLUS_OT_import_groom,
    VELLUS_OT_convert_particles,
    VELLUS_OT_transfer_groom,
)
