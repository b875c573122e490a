# SPDX-License-Identifier: GPL-3.0-or-later
"""Masks of guides and strands: a vertex group and an image. Strands use their own mask, or else their guides' mask."""

from dataclasses import dataclass

from ...core.errors import HairError
from . import scene


@dataclass(frozen=True)
class Mask:
    """Names of a vertex group and of an image; empty for none."""

    group: str = ""
    image: str = ""

    def __bool__(self):
        return bool(self.group or self.image)

    def read(self, surface_object, surface, depsgraph):
        """Return (V,) weights and the `Texture` on the `Surface` of a mesh object, each None without a name."""
        weights = scene.read_density(surface_object, surface, depsgraph, self.group)
        return weights, scene.read_texture(surface, self.image)


def own(settings):
    """Return the `Mask` in `GuideSettings`, `HairSettings`, or properties of the same names."""
    return Mask(_name(settings, "density_group"), _name(settings, "density_image"))


def of_strands(settings, guide_settings):
    """Return the `Mask` of strands between guides, from `HairSettings` and `GuideSettings`, or properties of them."""
    return own(settings) or own(guide_settings)


def _name(settings, attribute):
    try:
        return getattr(settings, attribute)
    except UnicodeDecodeError as error:
        raise HairError("A name in the hair settings is not valid UTF-8: pick the item again.") from error


def of_curves(target):
    """Return the `Mask` of a guide or hair Curves datablock."""
    state = target.vellus
    if state.kind == "GUIDES":
        return own(state.guides)
    if state.guide_curves is None:
        return own(state.hair)
    return of_strands(state.hair, state.guide_curves.vellus.guides)
