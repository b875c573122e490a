# SPDX-License-Identifier: GPL-3.0-or-later
"""Bound hair with other guide weights, lengths or radii, for sliders that take effect where strands are drawn."""

from dataclasses import replace

from bpy.types import Curves, Depsgraph

from ...core.grooming import following
from ...core.interpolation import hair_binding
from ..data.strands import curves
from ..settings import style_items
from . import bindings, pipeline, styled_hair
from .bindings import BoundHair

# Settings of guide weights, and settings applied after weights; neither change roots or the candidates for guides.
_WEIGHING = ("automatic_influence", "influence_distance", "neighbour_limit")
_AFTER_WEIGHING = ("keep_length", "angle_limit", "length_limit", "radius", "tip_taper", "guide_map")


def rebound(target: Curves, depsgraph: Depsgraph) -> BoundHair | None:
    """Return the `BoundHair` for changed weights, lengths or radii, without its points.

    None if other inputs have changed. Nothing is read or searched. Raises `HairError`.
    """
    known = bindings.of(target)
    guide_curves, settings = pipeline.inputs_of(target)
    if known is None or known.guide_uid != guide_curves.session_uid or known.straight is not None:
        return None
    if known.free is not None or guide_curves.surface is None:
        return None
    weighing, others = ({name: getattr(settings, name) for name in names} for names in (_WEIGHING, _AFTER_WEIGHING))
    if replace(known.settings, **weighing, **others) != settings:
        return None
    if not (bindings.has_scale(known, guide_curves.surface) and bindings.can_read_masks(known, target, depsgraph)):
        return None
    if settings.neighbour_limit >= known.binding.candidates.indices.shape[1]:
        return None
    device = known.binding.positions.device
    guides = curves.read_shown_guides(guide_curves, known.surface, device, known.guides)
    if following.combed(guides, known.guides) is None:
        return None
    styles = style_items.styles_of(target.vellus)
    read = styled_hair.read_styles(styles, guide_curves.surface, known.surface, guide_curves, depsgraph, target)
    if not read.is_same(known.styles.read):
        return None
    if replace(known.settings, **others) == settings:
        binding, shares = hair_binding.relimited(known.binding, settings), known.shares
    else:
        binding, shares = hair_binding.reweighed(known.binding, settings), None
    make_trees = styled_hair.reweighed_trees(known.styles, settings)
    styled = styled_hair.bind(read, binding, guides, settings, known.surface, make_trees)
    styled.continue_from(known.styles)
    changed = {"settings": settings, "binding": binding, "styles": styled, "shares": shares, "guides": guides}
    state = {"is_written": False, "has_moved_only": False, "is_map_written": False, "is_behind": True}
    return replace(known, **changed, **state)
