# SPDX-License-Identifier: GPL-3.0-or-later
"""Kept hair that follows its guides: each strand keeps its offset from the strand interpolated at its root.

The original shapes of guides and strands are stored with them (`kept_shapes`). So strands depend only on the present
guides, not on changes in between, and original guides give the original strands bit for bit.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from bpy.types import Curves, Depsgraph

from ....core import interpolation
from ....core.errors import HairError
from ....core.geometry import strands
from ....core.geometry.strands import Strands
from ....core.grooming import following, groom
from ....core.interpolation.hair_binding import HairBinding
from ...data import scene
from ...data.strands import attributes, curves, kept_shapes, partings, simulated_guides
from ...data.surfaces import Surface
from ...host.notices import name_of
from ...settings import setting_properties
from .. import bindings, staleness


@dataclass
class KeptBinding:
    """Kept strands bound to guides.

    shape: `Strands` of the original guides on their present roots; rest: (N, 3) float32 original local points of the
    strands; starts: (S+1,); followed: the guides that the strands have followed last. A changed `rest` needs a new
    `KeptBinding`, as values derived from it are cached.
    """

    surface: Surface
    binding: HairBinding
    shape: Strands
    rest: np.ndarray
    starts: np.ndarray
    followed: Strands

    @cached_property
    def _reach(self):
        return interpolation.guide_weights.reach(self.binding.guide_weights, len(self.shape))

    @cached_property
    def _course(self):
        return self._interpolated(self.shape)

    @cached_property
    def _places(self):
        return strands.places_along(self.surface.from_local(self.rest), self.starts)

    def _interpolated(self, guides):
        weights = following.weights_now(self.binding, guides)
        return following.strands_now(self.binding, guides, weights).numpy()

    def _some_interpolated(self, guides, chosen):
        """Return (M, P, 3) rows of `_interpolated` for (M,) indices; computes all rows if most are requested."""
        if len(chosen) > len(self.binding.positions) // 2:
            return self._interpolated(guides)[chosen]
        return following.follow_some(self.binding, guides, chosen)[0]

    def points_for(self, guides: Strands, points: np.ndarray | None = None, is_back: bool = False) -> np.ndarray:
        """Return the (N, 3) float32 local points of the strands for guides; points: to deform instead of `rest`.

        is_back: the inverse, from deformed to original strands.
        """
        points = self.rest if points is None else points
        moved = self._reach.of(_combed(guides, self.shape))
        if not len(moved):
            return points.copy()
        counts = np.diff(self.starts)
        is_moved = np.zeros(len(counts), bool)
        is_moved[moved] = True
        rows = np.repeat(is_moved, counts)
        made = interpolation.carried_strands.carried(
            self.surface.from_local(points[rows]),
            strands.curve_offsets(counts[moved]),
            self._places[rows],
            self._course[moved],
            self._some_interpolated(guides, moved),
            self.binding.normals.numpy()[moved],
            is_back=is_back,
        )
        out = points.copy()
        out[rows] = self.surface.to_local(made[:, None])[:, 0]
        return out


def follow(hair: Curves, depsgraph: Depsgraph, local: np.ndarray | None = None) -> bool:
    """Move kept strands with their present guides; returns whether the guides have changed.

    local: (N, 3) points of the guides, if already read. Raises `HairError`.
    """
    state = hair.vellus
    guide_curves = state.guide_curves
    if guide_curves is None or not len(hair.curves):
        return False
    digest, bound = staleness.guides_digest(guide_curves), bindings.kept_cache.get(hair.session_uid)
    is_simulated = simulated_guides.is_shown(guide_curves)
    if bound is None and state.followed == digest and not is_simulated:
        return False
    present = curves.read_points(hair)
    bound, guides = _up_to_date(bound, hair, present, depsgraph, local)
    # Strands return after a simulation, although the guides have not changed.
    digest = "" if is_simulated else digest
    is_other = state.followed != digest or len(_combed(guides, bound.followed)) > 0
    points = bound.points_for(guides)
    if not np.array_equal(points, present):
        if kept_shapes.read(hair) is None:
            kept_shapes.keep(hair, bound.rest)
        kept_shapes.write_strands(hair, points)
    bound.followed, state.followed, state.status = guides, digest, ""
    state.is_stale = False
    return is_other


def _combed(guides, before):
    """Return the (M,) indices of guides that differ; all if their roots differ."""
    combed = following.combed(guides, before)
    return np.arange(len(guides)) if combed is None else combed


def _up_to_date(bound, hair, present, depsgraph, local):
    """Return (`KeptBinding`, its present guides), bound again if guides were added, removed or slid, or hair edited."""
    guide_curves, known = hair.vellus.guide_curves, bound
    if bound is None or kept_shapes.is_edited(hair, present) or len(bound.rest) != len(present):
        bound = None
    else:
        guides = curves.read_shown_guides(guide_curves, bound.surface, "cpu", bound.shape, local)
        if following.combed(guides, bound.shape) is not None:
            return bound, guides
    bound = _bind(hair, present, depsgraph, None if known is None else known.followed)
    bindings.kept_cache.keep(hair.session_uid, bound)
    return bound, curves.read_shown_guides(guide_curves, bound.surface, "cpu", bound.shape, local)


def _bind(hair, present, depsgraph, followed):
    """Return a new `KeptBinding`; followed: guides that strands were last written for, None if unknown."""
    guide_curves = hair.vellus.guide_curves
    if not np.isfinite(present).all():
        raise HairError('"{name}" has non-finite coordinates: undo, or delete those strands.', name=name_of(hair))
    surface = scene.read_surface(hair.surface, depsgraph)
    guides = curves.read_guides(guide_curves, surface, "cpu")
    shape = guides.moved(_shape_of(guide_curves, surface))
    settings = setting_properties.to_settings(hair.vellus.hair, groom.HairSettings)
    parting = partings.read(hair.surface, surface, guide_curves, settings, depsgraph)
    starts = curves.curve_offsets(hair)
    roots = curves.read_roots(hair, surface, surface.from_local(present[starts[:-1]]))
    binding = groom.bind_hair(
        surface.mesh,
        shape,
        settings,
        regions=parting.regions,
        lines=parting.lines,
        drawn_on=surface.drawn_on,
        roots=roots,
        is_mirrored=surface.has_flipped_winding,
    )
    rest = kept_shapes.read(hair)
    bound = KeptBinding(surface, binding, shape, present if rest is None else rest, starts, guides)
    if rest is not None and kept_shapes.is_edited(hair, present):
        if followed is None or following.combed(followed, shape) is None:
            followed = guides
        bound = replace(bound, rest=_rest_of_edited(bound, followed, present))
        kept_shapes.keep(hair, bound.rest)
    return bound


def _rest_of_edited(bound, followed, present):
    """Return rest points with those of edited strands replaced by the inverse of the guides' deformation."""
    is_other = (bound.points_for(followed) != present).any(axis=1)
    rest = bound.rest.copy()
    rest[is_other] = bound.points_for(followed, present, is_back=True)[is_other]
    return rest


def _shape_of(guide_curves, surface):
    """Return the (G, POINT_COUNT, 3) float32 [m] original shape of guides, at their present roots.

    The original shape of new guides is stored when they are first seen.
    """
    present, shape = curves.read_points(guide_curves), kept_shapes.read(guide_curves)
    starts = curves.curve_offsets(guide_curves)
    counts = np.diff(starts)
    own = np.repeat(np.arange(len(counts)), counts)
    shape = np.zeros_like(present) if shape is None else shape
    arms = shape - shape[starts[:-1]][own]
    is_new = np.bincount(own, np.abs(arms).sum(axis=1), len(counts)) == 0.0
    shape = np.where(is_new[own][:, None], present, shape)
    kept_shapes.keep(guide_curves, shape)
    slid = present[starts[:-1]] - shape[starts[:-1]]
    at_roots = np.where(slid[own].any(axis=1)[:, None], shape + slid[own], shape)
    at_roots[starts[:-1]] = present[starts[:-1]]
    return curves.even_points(surface.from_local(at_roots), starts, lambda: attributes.are_smooth(guide_curves))
