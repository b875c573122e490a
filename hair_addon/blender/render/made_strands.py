# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands that follow combed guides, and their surface, where they are drawn: nothing is computed on this side.

Guides are followed so by hair without styles, or with styles that the GPU can apply; other hair takes points that Warp
computes. Any hair is carried so.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.errors import HairError
from ..data.strands.posed_strands import Pose
from ..gpu import shaders, strand_textures
from ..gpu.strands import maker_choice, strand_carrier, strand_maker, style_maker
from ..groom.bindings import BoundHair
from ..groom.styled_hair import StyledHair
from ..host import running
from ..settings import preferences


def are_wanted() -> bool:
    """Whether strands are to be made where they are drawn: as the user chose, or by what is measured once.

    To be asked while something is drawn.
    """
    chosen = preferences.stroke_device()
    if chosen == "COMPUTE" or not running.has_window():
        return False
    return maker_choice.can_make() if chosen == "GPU" else maker_choice.is_faster()


@dataclass
class Making:
    """What makes the strands of one hair, and of which guides; and what carries them with their surface."""

    maker: strand_maker.StrandMaker | style_maker.StyleMaker | None = None
    carrier: strand_carrier.StrandCarrier | None = None  # None while what is drawn is at rest, or was uploaded
    is_chosen: bool = False  # whether it is to make them with the next edit
    is_to_prepare: bool = False  # whether it would, were all programs compiled
    may_carry: bool = False  # whether it is to carry them with the next pose
    is_refused: bool = False  # whether the driver makes no such strands
    due: BoundHair | None = None  # whose guides were combed: the next redraw makes its strands
    _binding: Any = None  # `HairBinding` of the maker
    _triangles: np.ndarray | None = None  # that the carrier's strands are rooted on

    @property
    def textures(self) -> list:
        """All that its maker and its carrier hold."""
        return [texture for one in (self.maker, self.carrier) if one is not None for texture in one.textures]

    def choose(self, is_wanted: bool, bound: BoundHair | None) -> None:
        """Choose what it is to do: carry strands, and make those of `BoundHair` with their styles.

        It makes none before its programs are compiled, which may take a second: no edit waits for that.
        """
        self.may_carry = is_wanted and not self.is_refused
        self.is_to_prepare = self.may_carry and bound is not None and self.can_style(bound.styles)
        self.is_chosen = self.is_to_prepare and self.is_prepared(bound, bound.styles)

    def prepare(self, bound: BoundHair) -> bool:
        """Compile one program that edits of `BoundHair` need; whether there was one."""
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
        """Whether all programs are compiled that edits of `BoundHair` with such styles need."""
        return shaders.are_compiled(_programs_of(bound, styles))

    def can_style(self, styles: StyledHair) -> bool:
        """Whether styles can be applied to strands that are made here: the one place where that is decided."""
        return styles.styling is None or style_maker.can_style(styles.styling)

    def bring(self, kept: Any, pose: Pose | None, is_behind: bool) -> bool:
        """Bring the strands that `hair_cache` keeps up to combed guides, and to a pose of their surface.

        is_behind: whether they were made for other guides than their points on this side. False where the driver
        cannot, or it is not to: strands are then to be uploaded.
        """
        if kept.moved:
            return False
        try:
            if not self._can_carry(kept, pose, is_behind):
                return False
            if self.due is not None:
                self._make(kept)
            if self.carrier is not None:
                kept.on_gpu = self.carrier.carry(kept.on_gpu, pose.surface.posed if _is_deformed(pose) else None)
        except HairError:
            self._refuse()
            return False
        self.due, kept.pose = None, pose
        return True

    def _refuse(self):
        self.is_refused, self.carrier = True, None
        self.is_chosen = self.is_to_prepare = self.may_carry = False

    def _make(self, kept):
        bound, binding, known = self.due, self.due.binding, self._binding
        before = self.maker if self.maker is not None and known.positions is binding.positions else None
        axes = bound.surface.to_local_axes
        self.maker = style_maker.maker_of(binding, bound.styles.styling, len(bound.radii), axes, before)
        if known is not binding and self.maker is before:
            if known.guide_weights is not binding.guide_weights:
                self.maker = self.maker.weighed(strand_maker.bound_strands(binding))
            self.maker = self.maker.limited(binding.limits.fading, binding.keep_length)
        self._binding = binding
        if not np.array_equal(kept.radii[0], bound.radii):
            kept.radii = np.broadcast_to(bound.radii, kept.radii.shape)
            kept.on_gpu = strand_textures.with_radii(kept.on_gpu, kept.radii)
        wetness = bound.styles.wetness
        if not are_equal(kept.wetness, wetness):
            kept.wetness = wetness
            texture = None if wetness is None else strand_textures.numbers_texture(wetness, kept.on_gpu.row_strands)
            kept.on_gpu = replace(kept.on_gpu, wetness=texture, wetness_here=wetness)
        kept.on_gpu = self.maker.make(kept.on_gpu, _followed(bound), self.carrier and self.carrier.rest)

    def _can_carry(self, kept, pose, is_behind):
        """Whether there is a carrier to a pose, made now if need be; or none is needed."""
        if not (_is_deformed(pose) or _is_deformed(kept.pose)):
            return True
        surface = None if pose is None else pose.surface
        if self.carrier is not None:
            if surface is not None and self._is_carried_on(surface):
                return True
            self.carrier = None  # for the surface has other triangles now
            return False
        if surface is None or not self.may_carry or (is_behind and self.due is None and _is_deformed(kept.pose)):
            return False
        vertices, weights, *slides = pose.rooted(kept.rooted_on[1], kept.places, kept.points[:, 0], kept.may_float)
        drawn = kept.on_gpu
        if _is_deformed(kept.pose):
            rest = strand_textures.packed_texture(kept.points, drawn.row_strands)
        else:
            rest, kept.on_gpu = drawn.texture, replace(drawn, texture=strand_textures.like(drawn.texture))
        self.carrier = strand_carrier.new_carrier(
            *(rest, drawn.point_count, (vertices, weights), surface.rest, surface.turning(vertices)),
            slides[0] if slides else None,
        )
        self._triangles = surface.mesh.triangles
        return True

    def _is_carried_on(self, surface):
        mine, its = (self._triangles, self.carrier.vertices), (surface.mesh.triangles, surface.rest)
        return all(a is b or np.array_equal(a, b) for a, b in zip(mine, its, strict=True))


def _is_deformed(pose):
    return pose is not None and pose.is_deformed


def are_equal(values: np.ndarray | None, others: np.ndarray | None) -> bool:
    """Whether two arrays, either of which may be missing, hold the same."""
    if values is None or others is None:
        return values is others
    return np.array_equal(values, others)


def _followed(bound):
    """(G, P, 3): guides as strands follow them, which styles may lean."""
    styling = bound.styles.styling
    return (bound.guides if styling is None else styling.guides(bound.guides)).numpy()


def _programs_of(bound, styles):
    """Programs that make the strands of `BoundHair` with a `StyledHair`."""
    slot_count = bound.binding.guide_weights.indices.shape[1]
    return style_maker.programs_of(styles.styling, slot_count, len(bound.radii))
