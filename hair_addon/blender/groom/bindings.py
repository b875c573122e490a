# SPDX-License-Identifier: GPL-3.0-or-later
"""Cache of hair bindings during combing, by session UID of the hair, without references to Blender's data.

Bindings are derived from the surface, the guides, the settings and the roots stored in the hair's Curves, and can be
dropped at any time: the next change of a guide then searches again.
"""

from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from bpy.types import Curves, Depsgraph, Object

from ...core import interpolation
from ...core.errors import memory_as_sentence
from ...core.geometry.strands import Strands
from ...core.grooming import following, groom
from ...core.grooming.groom import HairSettings
from ...core.interpolation.hair_binding import HairBinding
from ..data import scene, surface_space
from ..data.strands import curves
from ..data.surfaces import Surface, cage_of
from ..host.caches import Cache
from ..settings import map_items, style_items
from . import styled_hair
from .size_fitting import Fits
from .styled_hair import StyledHair

if TYPE_CHECKING:
    from ...core.interpolation.guide_weights import Reach

T = TypeVar("T")


@dataclass
class BoundHair:
    """The current state of hair, newer than its datablock while `is_written` is false."""

    binding: HairBinding
    settings: HairSettings
    root_key: str  # of `staleness.root_key`
    parting_key: str  # of `partings.Partings`
    guides: Strands  # guides that the hair last followed
    guide_uid: int | None  # session_uid of the guides' Curves, None until they exist
    surface: Surface
    styles: StyledHair
    shares: np.ndarray | None = None  # (S, k) float32, weights of each strand's guides for the combed guides
    growing: Future | None = None  # of `points`
    free: Future | None = None  # of the interpolated points, if `points` were moved out of colliders
    fits: Fits = field(default_factory=Fits)  # settings that are fitted to the surface
    is_written: bool = False  # whether the datablock holds these points
    has_moved_only: bool = False  # whether only points, and possibly the guide map, are unwritten
    is_map_written: bool = False  # whether the datablock holds this guide map
    # The same hair without styles while viewports show it: only this hair follows strokes.
    straight: "BoundHair | None" = None
    is_behind: bool = False  # whether only the display, not `points`, has followed `guides`
    thickness: np.ndarray | None = None  # (S,) float32 factors of radii by a map, None without it
    course: np.ndarray | None = None  # (N,) float32 factors of the radius from root to tip, None without a ramp
    map_status: str = ""  # sentence about the maps of thickness and wetness
    mapped_wetness: np.ndarray | None = None  # (S,) float32 by the map of the look and by styles, None without the map

    @property
    def points(self) -> np.ndarray:
        """(S, P, 3) float32 at rest, in the surface's local coordinates; waits until they are computed."""
        with memory_as_sentence():
            return _grown(self.growing).result()

    @property
    def radii(self) -> np.ndarray:
        """(P,) float32 radii along each strand, or (S, P) if a map varies them, in the surface's local units."""
        radii = (
            self.styles.radius_factor * groom.strand_radii(self.settings, self.course) / np.float32(self.surface.scale)
        )
        return radii if self.thickness is None else self.thickness[:, None] * radii

    @property
    def guide_map(self) -> tuple[np.ndarray, np.ndarray]:
        """(S, k) int32 and float32: each strand's guides, -1 for none, and their current weights."""
        shares = _grown(self.shares)
        return np.where(shares > 0.0, self.binding.guide_weights.indices.numpy(), -1), shares

    @cached_property
    def reach(self) -> "Reach":
        """Strands that follow each guide."""

        return interpolation.guide_weights.reach(self.binding.guide_weights, len(self.guides))

    def follow(self, guides: Strands) -> np.ndarray | None:
        """Update strands for combed guides; returns the indices (M,) of moved strands.

        None if the hair has to be bound again, as guides were added, removed or slid over the surface.
        """
        combed = following.combed(guides, self.guides)
        if combed is None:
            return None
        self.guides = guides
        if self.straight is not None:
            moved = self.straight.follow(guides)
            if moved is not None and len(moved):
                self.is_behind = True
                self._points_have_moved()
            return moved
        strand_count = len(self.binding.positions)
        moves_all = self.is_behind or len(combed) == len(guides)
        moved = np.arange(strand_count) if moves_all else self._reached(combed)
        if len(moved):
            # If more than half have moved, updating all is faster than selecting.
            self.grow(moved if len(moved) <= strand_count // 2 else None)
            self._points_have_moved()
        return moved

    def follow_on_gpu(self, guides: Strands) -> np.ndarray | None:
        """Store combed guides while the GPU generates the shown strands; returns the indices (M,) of moved guides.

        Points are computed in `update_points`. None as from `follow`.
        """
        combed = following.combed(guides, self.guides)
        if combed is None:
            return None
        self.guides = guides
        if len(combed):
            self.is_behind = True
            self._points_have_moved()
            if self.straight is not None:
                self.straight.follow_on_gpu(guides)
        return combed

    def override_points(self, points: np.ndarray) -> None:
        """Override the interpolated points until they grow again."""
        self.free, self.growing = self.growing, Future()
        self.growing.set_result(points)

    def restore_points(self) -> None:
        """Restore the interpolated points after `override_points`."""
        if self.free is not None:
            self.growing, self.free = self.free, None

    def is_due(self) -> None:
        """Mark the points for writing although none has moved."""
        self._points_have_moved()

    def _points_have_moved(self):
        self.has_moved_only = self.is_written or self.has_moved_only
        self.is_written = False

    def _reached(self, combed):
        """Return the indices (M,) of strands that follow some guides or whose clumps do."""
        moved, styling = self.reach.of(combed), self.styles.styling
        return moved if styling is None or not len(combed) else styling.reached(combed, moved)

    @memory_as_sentence()
    def grow(self, chosen: np.ndarray | None = None) -> None:
        """Compute strands for `guides` in other threads; if indices (M,) are given, compute only these, immediately."""
        self.restore_points()
        binding, styling, axes = self.binding, self.styles.styling, self.surface.to_local_axes
        guides = self.guides if styling is None else styling.guides(self.guides)
        if chosen is None:
            weights = following.weights_now(binding, guides)
            self.is_behind = False
            out = None if self.growing is None else self.points
            out = out if out is not None and out.shape == (len(binding.positions), guides.point_count, 3) else None
            self.growing = following.growing_points(binding, guides, weights, axes, out, styling)
            self._take_shares(weights.weights.numpy())
        else:
            self.points[chosen], shares = following.follow_some(binding, guides, chosen, axes, styling)
            self._take_shares(shares, chosen)

    def restyle(self, styles: StyledHair, is_drawn: bool = False) -> None:
        """Apply other styles to the same strands, without a search.

        is_drawn: whether the GPU generates the shown strands; points are then computed in `update_points`.
        """
        styles.continue_from(self.styles)
        self.styles = styles
        if is_drawn:
            self.is_behind = True
        else:
            self.grow()
        self.is_written = self.has_moved_only = False

    def thicken(self, thickness: np.ndarray | None, map_status: str = "", course: np.ndarray | None = None) -> None:
        """Multiply the radii of strands by factors (S,) float32; None for 1.

        map_status: sentence about maps of strands; course: (N,) float32 factors from root to tip, None for the taper
        of the settings.
        """
        is_same = map_status == self.map_status and are_same(course, self.course)
        if is_same and are_same(thickness, self.thickness):
            return
        self.thickness, self.map_status, self.course = thickness, map_status, course
        if self.straight is not None:
            self.straight.thickness, self.straight.course = thickness, course
        self.is_written = self.has_moved_only = False

    @property
    def wetness(self) -> np.ndarray | None:
        """(S,) float32 wetness of strands for the shading; None if they do not differ."""
        return self.styles.wetness if self.mapped_wetness is None else self.mapped_wetness

    def soak(self, wetness: np.ndarray | None) -> None:
        """Give strands the wetness (S,) float32 of a map and of styles; None without a map."""
        if not are_same(wetness, self.mapped_wetness):
            self.mapped_wetness = wetness
            self.is_written = self.has_moved_only = False

    @property
    def shown(self) -> "BoundHair":
        """Hair shown in viewports: the one without styles if it exists."""
        return self if self.straight is None else self.straight

    def show_styles(self, is_styled: bool) -> None:
        """Show strands in viewports with or without styles."""
        if is_styled:
            self.update_points()
            self.straight = None
        elif self.straight is None:
            self.straight = replace(self, styles=self._unstyled(), growing=None, free=None, shares=None)
            self.straight.grow()

    def update_points(self) -> None:
        """Compute the points for guides that only the viewport display has followed."""
        if self.is_behind:
            self.grow()

    def _unstyled(self):
        return styled_hair.unstyled(self.styles, self.binding, self.guides, self.settings, self.surface)

    def _take_shares(self, shares, moved=slice(None)):
        """Store the weights of all strands, or of those with indices (M,), in the guide map."""
        if self.shares is None:
            self.shares = shares
            return
        self.is_map_written = self.is_map_written and np.array_equal(shares, self.shares[moved])
        self.shares[moved] = shares


def are_same(one: np.ndarray | None, other: np.ndarray | None) -> bool:
    """Whether numbers of strands, each possibly None, are the same."""
    return one is other if one is None or other is None else np.array_equal(one, other)


def _grown(value: T | None) -> T:
    """Return a value that exists once `grow` was called, as `pipeline` does for every `BoundHair`."""
    if value is None:
        raise ValueError("These strands have not begun to grow.")
    return value


binding_cache = Cache()  # session_uid of hair Curves → BoundHair
kept_cache = Cache()  # session_uid of kept hair Curves → `kept_following.KeptBinding`


def keep(datablock: Curves, bound: BoundHair) -> None:
    """Cache the binding of a hair Curves datablock."""
    binding_cache.keep(datablock.session_uid, bound)


def grow_in_place_of(datablock: Curves | None, bound: BoundHair) -> None:
    """Start computing strands for a hair Curves datablock, None for a new one, and drop its present binding.

    The memory of the present points is reused if their number is the same: the system would have to clear new memory.
    """
    if datablock is not None and (before := of(datablock)) is not None:
        binding_cache.invalidate(datablock.session_uid)
        if before.free is None and before.growing is not None and before.growing.exception() is None:
            # A new array: drawing identifies data by its array.
            bound.growing = Future()
            bound.growing.set_result(before.points.view())
    bound.grow()


def of(datablock: Curves) -> BoundHair | None:
    """Return the `BoundHair` of a hair Curves datablock, or None."""
    return binding_cache.get(datablock.session_uid)


def with_clumps(guides: Curves) -> BoundHair | None:
    """Return the first `BoundHair` that follows all guides and has a style that gathers strands, or None.

    None while guides were added or removed that hair does not follow yet.
    """
    for bound in filter(None, map(of, curves.followers(guides))):
        styling = bound.styles.styling
        if styling is not None and styling.tree_levels and len(bound.guides) == len(guides.curves):
            return bound
    return None


def has_scale(bound: BoundHair, surface_object: Object | None) -> bool:
    """Whether a surface has the scale that hair was bound at, as styles and spacings are in meters; it may be turned.

    True for a deleted surface, which has no other scale.
    """
    if surface_object is None:
        return True
    return surface_space.has_scale(surface_object, bound.surface.to_world_axes)


def can_read_masks(bound: BoundHair, target: Curves, depsgraph: Depsgraph) -> bool:
    """Whether the surface has the level of subdivision that hair is bound at, or no masks or maps depend on it."""
    surface_object = curves.grown_on(target)
    if surface_object is None or surface_object.type != "MESH":
        return False
    if not style_items.have_masks(target.vellus) and not map_items.read_faces(target.vellus):
        return True
    present, known = scene.read_surface(surface_object, depsgraph).cage.topology, bound.surface.topology
    return present == known or cage_of(present) != cage_of(known)


def invalidate(datablock: Curves) -> None:
    """Drop the bindings of a datablock that was changed by other code."""
    binding_cache.invalidate(datablock.session_uid)
    kept_cache.invalidate(datablock.session_uid)


def has_unwritten() -> bool:
    """Whether any hair is newer than its datablock."""
    return any(not bound.is_written for bound in binding_cache.values())
