# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the simulation that differ between guides by maps: bend stiffness, damping, hold and pinned length."""

from dataclasses import dataclass, field

import numpy as np

from ....core.dynamics.rod.settings import VARIED
from ....core.errors import HairError
from ....core.maps import combination
from ...host.notices import name_of
from ...settings import map_items
from .. import scene
from ..maps import ramps, sources
from ..strands import stored_roots

_KINDS = ("IMAGE", "GROUP", "ATTRIBUTE", "STRAND")  # guides have no clumps


@dataclass(frozen=True, eq=False)
class VariedDynamics:
    """Maps of the simulation of guides.

    factors: {setting: (G,) float64 factors of its value}; status: a sentence about a missing source; the setting
    of this map keeps its value.
    """

    factors: dict[str, np.ndarray] = field(default_factory=dict)
    status: str = ""

    def values(self, settings):
        """Return {setting: (G,) float64 values of guides} for `DynamicsSettings`."""
        return {
            name: combination.within(getattr(settings, name) * factors, VARIED[name])
            for name, factors in self.factors.items()
        }

    def is_same(self, other):
        """Whether both vary the same settings equally."""
        return self.factors.keys() == other.factors.keys() and all(
            np.array_equal(factors, other.factors[name]) for name, factors in self.factors.items()
        )


def of_guides(guides, surface, known):
    """Return the `VariedDynamics` of guides on a `Surface`.

    known: {map: (G,) factors} that were read before; missing factors are read and added.
    """
    found, status = {}, ""
    for name, item in _items(guides):
        try:
            found[name] = _factors(guides, surface, item, known)
        except HairError as error:
            status = str(error)
    return VariedDynamics(found, status)


def present(guides, depsgraph):
    """Return the `VariedDynamics` of guides on their surface in a dependency graph. Raises `HairError`."""
    if not any(_items(guides)):
        return VariedDynamics()
    return of_guides(guides, scene.read_surface(guides.surface, depsgraph), {})


def _items(guides):
    """Return [(setting, map)] of the maps of the simulation that have a source."""
    items = ((name, map_items.item_of(guides.vellus, f"dynamics.{name}")) for name in VARIED)
    return [(name, item) for name, item in items if item is not None and map_items.is_set(item)]


def _factors(guides, surface, item, known):
    """Return (G,) factors at the roots of guides. Raises `HairError`."""
    settings = map_items.settings_of(item)
    if settings in known:
        return known[settings]
    if settings.kind not in _KINDS:
        raise HairError("Maps of guides need an image, a group, an attribute of the surface or random numbers.")
    ramp = ramps.map_samples(item, False)
    source = sources.read(guides, guides.surface, surface, settings, item.image, ramp=ramp)
    roots = stored_roots.points(guides, surface)
    if roots is None:
        raise HairError(
            'The guides "{name}" are not rooted on their current surface: comb or regenerate them.',
            name=name_of(guides),
        )
    masks = source.values(roots, surface.identities(roots)[0], None)[:, 0]
    known[settings] = combination.factors(masks, source.combination)
    return known[settings]
