# SPDX-License-Identifier: GPL-3.0-or-later
"""The wetness of each strand for the shading: the largest of its Wet styles."""

from collections.abc import Mapping, Sequence

import numpy as np

from . import random_numbers, wet
from .base import StyleSettings, has_effect
from .program import mask_key


def is_uneven(styles: Sequence[StyleSettings]) -> bool:
    """Return whether a mask or a variation makes the wetness differ between strands."""
    soaking = _soaking(styles)
    everywhere = max((style.amount for style in soaking if not _has_places(style)), default=0.0)
    return any(style.amount > everywhere for style in soaking if _has_places(style))


def of_strands(
    styles: Sequence[StyleSettings], masks: Mapping[tuple[str, str, bool], np.ndarray], identities: np.ndarray
) -> np.ndarray:
    """Return (S,) float32 in [0, 1]: amount · mask · (1 - vary · h), as in steps.cpp, of each strand's wettest style.

    masks: (S,) weights by `program.mask_key`; identities: (S,) int32 IDs of strands.
    """
    found = np.zeros(len(identities), np.float32)
    for style in _soaking(styles):
        numbers = random_numbers.random_numbers(identities, style.seed, random_numbers.VARY)
        amounts = np.float32(style.amount) * (np.float32(1.0) - np.float32(style.vary) * numbers)
        key = mask_key(style)
        np.maximum(found, amounts if key is None else amounts * masks[key], out=found)
    return found


def mean_amount(style: StyleSettings) -> float:
    """Return the mean amount of a style over strands, without its mask: h is uniform in [0, 1)."""
    return style.amount * (1.0 - 0.5 * style.vary)


def _soaking(styles):
    return [style for style in styles if isinstance(style, wet.Settings) and has_effect(style)]


def _has_places(style):
    return style.vary > 0.0 or mask_key(style) is not None
