# SPDX-License-Identifier: GPL-3.0-or-later
"""Existing curves used as hair: strands are kept unchanged, and guides that reproduce them are derived.

Points, their numbers and all attributes keep their bits until guides are moved, which strands follow
(kept_following.py). Vellus regenerates such hair only on request, with the same number of strands on the same roots.
"""

from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from bpy.types import Curves, Depsgraph, Object

from ....core import geometry, grooming
from ....core.geometry import strands
from ....core.grooming import groom, groom_defaults
from ....core.grooming.derived_guides import DerivationSettings, DerivedGuides
from ....core.grooming.groom import HairSettings
from ....core.grooming.rooted_curves import RootedCurves
from ....core.long_work import Work, part_of
from ....core.params import Param, declared, plain_value
from ...data import surface_space, thin_hair, whole_changes
from ...data.strands import attributes, curves, exported_curves, kept_shapes
from ...data.surfaces import Surface
from ...host.datablocks import Remembered
from ...materials import looks
from ...settings import setting_properties
from .. import pipeline, staleness, writing
from . import foreign_curves, hand_made_guides
from .hand_made_guides import HandMade, PlacedCurves

_SWITCH = Param("")
_MOST_RADIUS = next(details.high for name, _default, details in declared(HairSettings) if name == "radius")


@dataclass(frozen=True)
class KeptHair:
    """Hair Curves, the guide Curves derived from them, statistics of the curves, and errors of the reproduction."""

    hair: Curves
    guides: Curves
    rooted: RootedCurves
    mean_error: float  # root mean square distance of strands to their reproduction, as a fraction of their lengths
    high_error: float  # 95th percentile of the same errors

    def notes(self) -> list[tuple[str, dict[str, Any]]]:
        """Return [(sentence, values)] to report to the user."""
        return HandMade(self.guides, self.hair, self.rooted).notes()


@whole_changes.whole
def using_as_hair(
    curves_object: Object,
    surface_object: Object,
    depsgraph: Depsgraph,
    settings: DerivationSettings,
    *,
    applies_modifiers: bool = True,
    follows_guides: bool = False,
    guides_object: Object | None = None,
    is_directed: bool = False,
) -> Work[KeptHair]:
    """Convert an object's curves to hair and derive guides, as work in steps; returns `KeptHair`.

    applies_modifiers: as of `hand_made_guides.using_as_guides`; follows_guides: regenerate the strands from the guides,
    on the same roots; guides_object: of guides that came with the hair, used with their stored weights instead of
    derived guides; is_directed: curves run from root to tip, even where the tip is nearer to the surface. Raises
    `HairError` before anything changes.
    """
    applies_modifiers = plain_value("Apply Modifiers", applies_modifiers, True, _SWITCH)
    follows_guides = plain_value("Follow Guides", follows_guides, False, _SWITCH)
    surface, seen, to_surface = hand_made_guides.open_curves(
        curves_object, surface_object, depsgraph, applies_modifiers
    )
    place, its_surface = Remembered(curves_object), Remembered(surface_object)
    given = None if guides_object is None else _given_guides(guides_object, surface_object)
    its_guides = None if guides_object is None else Remembered(guides_object)

    def compute(progress):
        progress("Rooting strands", 0.0)
        placed = hand_made_guides.on_surface(surface, seen, to_surface, is_directed=is_directed)
        guides = None if given is None else hand_made_guides.on_surface(surface, *given)
        return placed, guides, *_reproduced(surface, placed, guides, settings, part_of(progress, 0.1, 1.0))

    placed, kept_guides, wanted, derived = yield compute
    hair = hand_made_guides.write(
        place.find(), its_surface.find(), surface, placed, seen, applies_modifiers, kind="HAIR"
    )
    wanted = replace(wanted, radius=_write_widths(hair, surface, placed, wanted))
    guide_map = derived.guide_map
    if its_guides is None or kept_guides is None or given is None:
        guides = writing.write_hand_made(hair.surface, surface, derived.guides)
    else:
        stored = exported_curves.read_guide_map(hair, len(given[0].starts) - 1)
        guides = hand_made_guides.write(its_guides.find(), hair.surface, surface, kept_guides, given[0], True)
        guide_map = guide_map if stored is None else _among(kept_guides.rooted.kept, *stored)
    _write_hair(hair, guides, surface, placed, wanted, guide_map)
    if follows_guides:
        pipeline.interpolate_hair(guides, wanted, depsgraph, hair)
    return KeptHair(hair, guides, placed.rooted, derived.mean_error, derived.high_error)


def _reproduced(
    surface: Surface, placed: PlacedCurves, guides: PlacedCurves | None, settings: DerivationSettings, progress
) -> tuple[HairSettings, DerivedGuides]:
    """Return settings of the hair, and the `DerivedGuides` that reproduce it; guides: given with it, or None."""
    count = len(placed.counts)
    guide_count = min(settings.guide_count, count) if guides is None else len(guides.counts)
    wanted = groom_defaults.complete(HairSettings(strand_count=count), surface.posed_mesh, None, None, guide_count)
    points, roots = placed.even(surface), placed.rooted.roots
    is_mirrored = surface.has_flipped_winding
    if guides is None:
        return wanted, grooming.derived_guides.derive(
            surface.mesh, points, roots, wanted, settings.guide_count, is_mirrored=is_mirrored, progress=progress
        )
    present = strands.from_numpy(guides.even(surface), guides.rooted.roots)
    return wanted, grooming.derived_guides.reproduced(
        surface.mesh, points, roots, wanted, present, is_mirrored=is_mirrored, progress=progress
    )


def _given_guides(guides_object, surface_object):
    """Return (`SeenCurves`, `Affine` to the surface's coordinates) of guides that came with hair."""
    hand_made_guides.require_usable(guides_object, surface_object)
    return foreign_curves.read(guides_object, True), surface_space.between(guides_object, surface_object)


def _among(kept, indices, weights):
    """Restrict a guide map to kept guides; kept: (K,) rising indices."""
    places = np.minimum(np.searchsorted(kept, indices), len(kept) - 1)
    is_there = (indices >= 0) & (kept[places] == indices)
    return np.where(is_there, places, -1).astype(np.int32), np.where(is_there, weights, np.float32(0.0))


def _write_hair(hair, guides, surface, placed, settings, guide_map):
    state = hair.vellus
    state.guide_curves = guides
    setting_properties.assign(state.hair, settings)
    identities = surface.identities(placed.rooted.roots)
    for name, data_type, values in zip(("id", "strand_random"), ("INT", "FLOAT"), identities, strict=True):
        if not attributes.has(hair, name, data_type, "CURVE"):
            attributes.write(hair, name, data_type, "CURVE", values)
    curves.write_guide_map(hair, guide_map)
    kept_shapes.keep(guides, curves.read_points(guides))
    # Regenerated strands use these roots, and nothing is regenerated automatically.
    state.root_key = staleness.root_key(settings, None)
    state.followed = staleness.guides_digest(guides)
    state.is_stale = False
    thin_hair.show_thin(bpy.context.scene)
    looks.evaluate_shading(hair)
    looks.evaluate_guides(guides)


def _write_widths(hair, surface: Surface, placed: PlacedCurves, settings) -> float:
    """Write tapering radii of the settings to curves without radii; returns the mean radius at the roots [m]."""
    starts = strands.curve_offsets(placed.counts)
    if attributes.read(hair, "radius", "FLOAT", "POINT") is None:
        along = geometry.strands.places_along(placed.points, starts)
        taper = groom.strand_radii(settings)[[0, -1]] / np.float32(surface.scale)
        attributes.write(hair, "radius", "FLOAT", "POINT", taper[0] + (taper[1] - taper[0]) * along)
    found = float(curves.read_radii(hair)[starts[:-1]].mean() * surface.scale)
    return min(found, _MOST_RADIUS) or groom_defaults.known(settings.radius)
