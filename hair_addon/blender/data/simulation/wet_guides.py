# SPDX-License-Identifier: GPL-3.0-or-later
"""How wet each guide is: where the hair's Wet styles have masks, the weights of these at the guides' roots count."""

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
    """(G,) float32 wetness, from 0 to 1, that guides on a `Surface` move with; None where no mask makes them differ.

    known: {mask: (G,) weights} as read before; those that are missing are read and added; roots: `SurfacePoints`, None
    for those that are stored. Raises `HairError`.
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
    """(K, G) float32 wetness by each mask, the weights alone where keys move amounts; None without a mask.

    Raises `HairError`.
    """
    is_keyed = shared_wetness.is_keyed(guides.vellus)
    styles = [style for style in shared_wetness.masked_styles(guides.vellus) if is_keyed or has_effect(style)]
    if not styles:
        return None
    surface, known = scene.read_surface(guides.surface, depsgraph), {}
    amounts = np.array([1.0 if is_keyed else mean_amount(style) for style in styles], np.float32)
    return amounts[:, None] * [_weights(guides, surface, depsgraph, mask_key(style), known) for style in styles]


def _weights(guides, surface, depsgraph, key, known, roots=None):
    """(G,) float32 of a mask; kept in {mask: weights}."""
    if key not in known:
        roots = stored_roots.points(guides, surface) if roots is None else roots
        if roots is None:
            raise HairError(
                'The guides "{name}" are not rooted on their surface as it is now: comb or regenerate them.',
                name=name_of(guides),
            )
        known[key] = style_inputs.read_mask(guides.surface, surface, guides, key, depsgraph).of_guides(roots)
    return known[key]
