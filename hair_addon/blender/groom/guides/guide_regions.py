# SPDX-License-Identifier: GPL-3.0-or-later
"""Regions of guides, divided by the parting of their hair: no friction or pressure acts between two regions."""

import numpy as np
from bpy.types import Curves, Depsgraph

from ....core import interpolation
from ....core.grooming import groom
from ...data import scene
from ...data.strands import curves, partings
from ...settings import preferences, setting_properties
from .. import bindings


def regions_of(guides: Curves, depsgraph: Depsgraph) -> np.ndarray | None:
    """Return the (G,) int32 regions of guides, from 0; None if no hair has a parting. Raises `HairError`."""
    parted = _parted_hair(guides)
    if not parted or guides.surface is None:
        return None
    device = preferences.device()
    surface = scene.read_surface(guides.surface, depsgraph)
    roots = curves.read_guides(guides, surface, device).roots
    drawn_on = surface.drawn_on
    labels = []
    for hair in parted:
        settings = setting_properties.to_settings(hair.vellus.hair, groom.HairSettings)
        parting = partings.read(guides.surface, surface, guides, settings, depsgraph)
        lines = groom.laid_lines(surface.mesh, parting.lines, drawn_on, device)
        labels.append(interpolation.guide_regions.guide_regions(surface.mesh, roots, parting.regions, lines, device))
    regions = interpolation.guide_regions.combined(labels)
    return regions if regions.any() else None


def is_parted(guides: Curves) -> bool:
    """Whether `regions_of` has partings to read."""
    return bool(_parted_hair(guides))


def _parted_hair(guides):
    return [hair for hair in curves.followers(guides) if partings.is_wanted(hair.vellus.hair)]


def parting_keys(guides: Curves) -> tuple[str, ...]:
    """Return the keys of the partings with which hair between guides was generated, to detect other `regions_of`."""
    followers = curves.followers(guides)
    bound = [bindings.of(hair) for hair in followers]  # newer than the datablock
    keys = [
        hair.vellus.parting_key if own is None else own.parting_key for hair, own in zip(followers, bound, strict=True)
    ]
    return tuple(sorted(keys))
