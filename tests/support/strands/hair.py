# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands between guides in one call, from arrays: without interface and attributes."""

from hair_addon.core.grooming import following, groom


def generate_hair(mesh, guides, settings, *, device="cpu", **details):
    """Return `Strands` (strand_count, P) between guides of P points; arguments as of `groom.bind_hair`."""
    binding = groom.bind_hair(mesh, guides, settings, device=device, **details)
    return following.follow_guides(binding, guides)
