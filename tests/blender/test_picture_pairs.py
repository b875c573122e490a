# SPDX-License-Identifier: GPL-3.0-or-later
"""Comparisons of pictures with noisy references."""

import numpy as np

from blend_samples.sheets import picture_pairs


def test_noise_of_references_is_no_error(rng):
    """Against noisy halves, the right picture has little error, and a darker or brighter picture its true error."""
    light = np.ones((48, 48, 4), np.float32)
    light[..., :3] = rng.uniform(0.5, 1.5, (48, 48, 1))
    halves = []
    for _ in range(2):
        noise = np.ones_like(light)
        noise[..., :3] = rng.gamma(1.0, 1.0, (48, 48, 1))
        halves.append(light * noise)
    brighter = light * np.array([1.3, 1.3, 1.3, 1.0])
    biased = picture_pairs.block_error(0.5 * (halves[0] + halves[1]), light)
    right, wrong = (picture_pairs.noiseless_block_error(halves, one) for one in (light, brighter))
    known = picture_pairs.block_error(light, brighter)
    assert right < 0.5 * biased
    assert abs(wrong - known) < 0.2 * known
    assert picture_pairs.noiseless_block_error([light, light], brighter) == known
