# SPDX-License-Identifier: GPL-3.0-or-later
"""The bend stiffness of each simulated guide by a map, read at the guides' roots."""

from ....core.errors import HairError
from ....core.maps import combination, varied_settings
from ...settings import map_items
from .. import scene
from ..maps import ramps, sources
from ..strands import stored_roots

SETTING = "dynamics.bend_stiffness"
_KINDS = ("IMAGE", "GROUP", "ATTRIBUTE", "STRAND")  # guides have no clumps


def of_guides(guides, surface, value, known):
    """Return the (G,) float64 bend stiffness of guides on a `Surface`; None without a map.

    value: of the setting; known: {map: (G,) weights} that were read before; missing weights are read and added. Raises
    `HairError` for a missing source.
    """
    item = map_items.item_of(guides.vellus, SETTING)
    if item is None or not map_items.is_set(item):
        return None
    settings, how, masks = _read(guides, surface, item, known)
    known[settings] = masks
    return combination.varied_number(value, masks, how, varied_settings.all_varied()[SETTING][1])


def unkeyed(guides, depsgraph):
    """Return (G,) float64 factors of the stiffness by the map; None without a map. Raises `HairError`."""
    item = map_items.item_of(guides.vellus, SETTING)
    if item is None or not map_items.is_set(item):
        return None
    return of_guides(guides, scene.read_surface(guides.surface, depsgraph), 1.0, {})


def _read(guides, surface, item, known):
    """Return (map, its `Combination`, (G,) its values at the roots of guides). Raises `HairError`."""
    settings = map_items.settings_of(item)
    if settings.kind not in _KINDS:
        raise HairError("Maps of guides need an image, a group, an attribute of the surface or random numbers.")
    ramp = ramps.map_samples(item, False)
    source = sources.read(guides, guides.surface, surface, settings, item.image, ramp=ramp)
    if settings in known:
        return settings, source.combination, known[settings]
    roots = stored_roots.points(guides, surface)
    if roots is None:
        raise HairError(
            'The guides "{name}" are not rooted on their current surface: comb or regenerate them.', name=guides.name
        )
    return settings, source.combination, source.values(roots, surface.identities(roots)[0], None)[:, 0]
