# SPDX-License-Identifier: GPL-3.0-or-later
"""The wetness of each guide: masks of the hair's Wet styles are read at the guides' roots."""

import numpy as np

from ....core.errors import HairError
from ....core.styling.base import has_effect
from ....core.styling.program import mask_key
from ....core.styling.strand_wetness import mean_amount
from ...host.notices import name_of
from ...settings import shared_wetness
from .. import scene
from ..strands import stored_roots, style_inputs


def of_guides(guides, surface, depsgraph, known, roots=None):
    """Return (G,) float32 wetness of simulated guides on a `Surface`, from 0 to 1; None if no mask makes guides
    differ.

    known: {mask: (G,) weights} that were read before; missing masks are read and added; roots: `SurfacePoints`, None:
    stored roots. Raises `HairError`.
    """
    evenly = shared_wetness.evenly_of_guides(guides.vellus)
    styles = [style for style in shared_wetness.masked_styles(guides.vellus) if has_effect(style)]
    if not any(mean_amount(style) > evenly for style in styles):
        return None
    wetness = np.full(len(guides.curves), evenly, np.float32)
    for style in styles:
        weights = _weights(guides, surface, depsgraph, mask_key(style), known, roots)
        np.maximum(wetness, np.float32(mean_amount(style)) * weights, out=wetness)
    return wetness


def unkeyed(guides, depsgraph):
    """Return (K, G) float32 wetness by each mask, or only its weights if amounts are keyed; None without a mask.

    Raises `HairError`.
    """
    is_keyed = shared_wetness.is_keyed(guides.vellus)
    styles = [style for style in shared_wetness.masked_styles(guides.vellus) if is_keyed or has_effect(style)]
    if not styles:
        return None
    surface, known = scene.read_surface(guides.surface, depsgraph), {}
    amounts = np.array([1.0 if is_keyed else mean_amount(style) for style in styles], np.float32)
    return amounts[:, None] * [_weights(guides, surface, depsgraph, mask_key(style), known) for style in styles]


def places(guides, known):
    """Return {mask: (G,) weights} of the masks of wetness that `of_guides` has read into `known`."""
    keys = (mask_key(style) for style in shared_wetness.masked_styles(guides.vellus))
    return {key: known[key] for key in keys if key in known}


def are_others(now, before, guides):
    """Return whether weights of `places` differ from those before, or masks differ while no wetness is keyed."""
    if now.keys() != before.keys() and not shared_wetness.is_keyed(guides.vellus):
        return True
    return any(key in before and not np.array_equal(weights, before[key]) for key, weights in now.items())


def _weights(guides, surface, depsgraph, key, known, roots=None):
    """Return (G,) float32 weights of a mask, cached in `known`."""
    if key not in known:
        roots = stored_roots.points(guides, surface) if roots is None else roots
        if roots is None:
            raise HairError(
                'The guides "{name}" are not rooted on their current surface: comb or regenerate them.',
                name=name_of(guides),
            )
        known[key] = style_inputs.read_mask(guides.surface, surface, guides, key, depsgraph).of_guides(roots)
    return known[key]
