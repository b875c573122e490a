# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of guides that differ between guides by maps: length, tilt, gravity and lift."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from bpy.types import Curves, Object

from ...core.errors import HairError
from ...core.geometry.mesh import SurfacePoints
from ...core.grooming import groom, groom_defaults
from ...core.grooming.groom import GuideSettings
from ...core.maps import combination, varied_settings
from ...core.params import Param
from ..data.maps import ramps, sources
from ..data.surfaces import Surface
from ..settings import map_items

_LEAST_LENGTH = 1e-3  # of the setting: guides without length have no direction
_KINDS = ("IMAGE", "GROUP", "ATTRIBUTE", "STRAND")  # guides have no clumps, and lose attributes when they grow


@dataclass(frozen=True, eq=False)
class VariedGuides:
    """Maps of the settings of guides on a surface; status: a sentence about a missing source."""

    surface: Surface
    maps: Mapping[str, tuple[float, Param, sources.Source]]  # {setting: (value, its `Param`, source)}
    status: str = ""

    def values(self, roots: SurfacePoints) -> dict[str, np.ndarray]:
        """Return {setting: (G,) float64} of guides with roots (G)."""
        identities, _randoms = self.surface.identities(roots)
        return {
            name: combination.varied_number(
                value, source.values(roots, identities, None)[:, 0], source.combination, details
            )
            for name, (value, details, source) in self.maps.items()
        }


def read(guides: Curves | None, surface_object: Object, surface: Surface, settings: GuideSettings) -> VariedGuides:
    """Return the `VariedGuides` of guide Curves, None if they are new; settings: completed for the surface."""
    maps, status = {}, ""
    if guides is None:
        return VariedGuides(surface, maps)
    for name in groom.VARIED:
        item = map_items.item_of(guides.vellus, f"guides.{name}")
        if item is None or not map_items.is_set(item):
            continue
        details, value = varied_settings.all_varied()[item.setting][1], groom_defaults.known(getattr(settings, name))
        if name == "length":
            details = replace(details, low=_LEAST_LENGTH * value, above=-np.inf)
        try:
            if item.kind not in _KINDS:
                raise HairError("Maps of guides need an image, a group, an attribute of the surface or random numbers.")
            ramp, own = ramps.map_samples(item, False), map_items.settings_of(item)
            maps[name] = value, details, sources.read(guides, surface_object, surface, own, item.image, ramp=ramp)
        except HairError as error:
            status = str(error)
    return VariedGuides(surface, maps, status)
