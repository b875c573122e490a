# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands that follow combed guides and their surface on the GPU, without computing points on the CPU.

Following guides requires hair without styles, or with styles that the GPU can apply; Warp computes the points of other
hair. All hair can be deformed with its surface on the GPU.
"""

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ...core.errors import HairError
from ..data.strands import attributes
from ..data.strands.posed_strands import Pose
from ..gpu import strand_textures, surface_textures
from ..gpu.programs import shaders
from ..gpu.strands import device_choice, strand_carrier, strand_maker, style_maker
from ..groom.bindings import BoundHair
from ..groom.styled_hair import StyledHair
from ..host import running
from ..settings import preferences


def are_wanted() -> bool:
    """Whether the GPU should make strands, as set by the user, or decided by one measurement.

    Must be called during drawing.
    """
    chosen = preferences.stroke_device()
    if chosen == "COMPUTE" or not running.has_window():
        return False
    return device_choice.can_make() if chosen == "GPU" else device_choice.is_faster()


@dataclass
class StrandGenerator:
    """The state of making the strands of one hair on the GPU, and of deforming them with their surface."""

    maker: strand_maker.StrandMaker | style_maker.StyleMaker | None = None
    carrier: strand_carrier.StrandCarrier | None = None  # None while drawn strands are at rest, or were uploaded
    is_chosen: bool = False  # whether the next edit makes strands
    is_to_prepare: bool = False  # whether it would if all programs were compiled
    may_carry: bool = False  # whether the next pose carries strands
    is_refused: bool = False  # whether the driver does not support it
    due: BoundHair | None = None  # hair whose guides were combed: the next redraw makes its strands
    _binding: Any = None  # `HairBinding` of the maker
    _triangles: np.ndarray | None = None  # of the surface that the carrier's strands are rooted on

    @property
    def textures(self) -> list:
        """All textures of the maker and the carrier."""
        return [texture for one in (self.maker, self.carrier) if one is not None for texture in one.textures]

    def choose(self, is_wanted: bool, bound: BoundHair | None) -> None:
        """Decide whether to carry strands, and to make those of `BoundHair` with their styles.

        Strands are not made before the programs are compiled, which may take a second, so that no edit waits for it.
        """
        self.may_carry = is_wanted and not self.is_refused
        self.is_to_prepare = self.may_carry and bound is not None and self.can_style(bound.styles)
        self.is_chosen = self.is_to_prepare and self.is_prepared(bound, bound.styles)

    def prepare(self, bound: BoundHair) -> bool:
        """Compile one missing program for edits of `BoundHair`; returns whether there was one."""
        if not self.is_to_prepare:
            return False
        try:
            was_missing = shaders.compile_one(_programs_of(bound, bound.styles))
        except HairError:
            self._refuse()
            return False
        self.is_chosen = self.is_prepared(bound, bound.styles)
        return was_missing

    def is_prepared(self, bound: BoundHair, styles: StyledHair) -> bool:
        """Whether all programs for edits of `BoundHair` with these styles are compiled."""
        return shaders.are_compiled(_programs_of(bound, styles))

    def can_style(self, styles: StyledHair) -> bool:
        """Whether the GPU can apply the styles of strands that it makes; decided only here."""
        return styles.styling is None or style_maker.can_style(styles.styling)

    def release_memory(self) -> None:
        """Release the memory that is needed only until changed strands are written."""
        if isinstance(self.maker, style_maker.StyleMaker):
            self.maker.release_memory()

    def bring(self, cached: Any, pose: Pose | None, is_behind: bool) -> bool:
        """Update the cached strands of `hair_cache` for combed guides and for a pose of their surface.

        is_behind: whether their points on the CPU are of former guides. Returns False if the driver does not support it
        or it was not chosen; strands must then be uploaded.
        """
        if cached.moved:
            return False
        try:
            if not self._can_carry(cached, pose, is_behind):
                return False
            if self.due is not None:
                self._make(cached)
            if self.carrier is not None:
                cached.on_gpu = self.carrier.carry(cached.on_gpu, pose.surface.posed if _is_deformed(pose) else None)
        except HairError:
            self._refuse()
            return False
        self.due, cached.pose = None, pose
        return True

    def _refuse(self):
        self.is_refused, self.carrier = True, None
        self.is_chosen = self.is_to_prepare = self.may_carry = False

    def _make(self, cached):
        bound, binding, known = self.due, self.due.binding, self._binding
        before = self.maker if self.maker is not None and known.positions is binding.positions else None
        axes = bound.surface.to_local_axes
        radii = bound.radii
        self.maker = style_maker.maker_of(binding, bound.styles.styling, radii.shape[-1], axes, before)
        if known is not binding and self.maker is before:
            if known.guide_weights is not binding.guide_weights:
                self.maker = self.maker.weighed(strand_maker.bound_strands(binding))
            self.maker = self.maker.limited(binding.limits.fading, binding.keep_length)
        self._binding = binding
        # If only points have moved, the radii are those of the datablock, which others may have changed.
        if not bound.has_moved_only:
            are_same = _have_radii(cached.radii, radii)
            cached.radii = np.broadcast_to(radii, cached.radii.shape)  # a single row is compared the next time
            if not are_same:
                cached.on_gpu = strand_textures.with_radii(cached.on_gpu, cached.radii)
        wetness = bound.wetness
        if not are_equal(cached.wetness, wetness):
            cached.wetness = wetness
            texture = None if wetness is None else strand_textures.numbers_texture(wetness, cached.on_gpu.row_strands)
            cached.on_gpu = replace(cached.on_gpu, wetness=texture, wetness_here=wetness)
        made = self.maker.make(cached.on_gpu, _followed(bound), self.carrier and self.carrier.rest)
        cached.on_gpu = replace(made, has_bends=False)

    def _can_carry(self, cached, pose, is_behind):
        """Whether a carrier for a pose exists, can be made now, or is not needed."""
        if not (_is_deformed(pose) or _is_deformed(cached.pose)):
            return True
        surface = None if pose is None else pose.surface
        if self.carrier is not None:
            if surface is not None and self._is_carried_on(surface):
                return True
            self.carrier = None  # the surface has other triangles now
            return False
        if surface is None or not self.may_carry or (is_behind and self.due is None and _is_deformed(cached.pose)):
            return False
        vertices, weights, *slides = pose.rooted(
            cached.rooted_on[1], cached.places, cached.points[:, 0], cached.may_start_off_surface
        )
        drawn = cached.on_gpu
        if _is_deformed(cached.pose):
            rest, _bounds = strand_textures.packed_texture(cached.points, drawn.row_strands)
        else:
            rest, cached.on_gpu = drawn.texture, replace(drawn, texture=strand_textures.like(drawn.texture))
        self.carrier = strand_carrier.new_carrier(
            *(rest, drawn.point_count, (vertices, weights), surface.rest, surface.turning(vertices)),
            slides[0] if slides else None,
            partial(surface_textures.posed_places, cached.rooted_on[0]),
        )
        self._triangles = surface.mesh.triangles
        return True

    def _is_carried_on(self, surface):
        own, others = (self._triangles, self.carrier.vertices), (surface.mesh.triangles, surface.rest)
        return all(a is b or np.array_equal(a, b) for a, b in zip(own, others, strict=True))


def _have_radii(values, radii):
    """Whether radii (S, P) of strands are (P,) radii that all of them have, or (S, P) of each."""
    if radii.ndim == 1 and values.strides[0] == 0:  # one row in memory
        return np.array_equal(values[0], radii)
    return attributes.are_radii(values.ravel(), radii)


def _is_deformed(pose):
    return pose is not None and pose.is_deformed


def are_equal(values: np.ndarray | None, others: np.ndarray | None) -> bool:
    """Whether two arrays, each of which may be None, are equal."""
    if values is None or others is None:
        return values is others
    return np.array_equal(values, others)


def _followed(bound):
    """Return (G, P, 3) guides that strands follow, to which styles may be applied."""
    styling = bound.styles.styling
    return (bound.guides if styling is None else styling.guides(bound.guides)).numpy()


def _programs_of(bound, styles):
    """Programs that make the strands of `BoundHair` with the styles of a `StyledHair`."""
    slot_count = bound.binding.guide_weights.indices.shape[1]
    return style_maker.programs_of(styles.styling, slot_count, bound.settings.point_count)
