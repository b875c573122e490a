# SPDX-License-Identifier: GPL-3.0-or-later
"""Ramps are written as text, and read from it."""

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.maps import combination, ramp_text, varied_settings
from hair_addon.core.maps.map_settings import MapSettings

CURVES = ["0:1 0.5:0.3 1:0.2", "extrapolated 0.1:0 0.3:1:auto 1:0.25:auto_clamped", "0:0.123456789 1:1e-07"]
COLORS = ["0:0.1/0.05/0 1:1/0.8/0.5/0.5", "constant hsv cw 0:1/0/0 0.25:0/1/0 1:1/1/1", "0.5:1/0/0"]


@pytest.mark.parametrize("text", CURVES + COLORS)
def test_text_is_what_it_was_parsed_from(text):
    """A parsed ramp has the same text again, with its points in the order of their positions."""
    ramp = ramp_text.parsed(text)
    assert ramp.text() == text
    assert isinstance(ramp, ramp_text.Colors if text in COLORS else ramp_text.Curve)
    words = text.split()
    points = [word for word in words if ":" in word]
    others = words[: len(words) - len(points)]
    assert ramp_text.parsed(" ".join([*others, *points[::-1]])) == ramp


INVALID = [
    "1",
    "0:1",
    "0:1 2:1",
    "0:1 1:nan",
    "0:1 1:x",
    "0:1 1:1:round",
    "0:1 1:1:auto:auto",
    "horizontal",
    "linear 0:1 1:1",
]
INVALID += [
    "0:1/0",
    "0:1/0/0/0/0",
    "0:1/0/0 1:1",
    "0:1/2/0",
    "0:-0.1 1:1",
    "0:1 vector 1:1",
    "rgb hsv 0:1/1/1",
    ":",
    "0: 1:",
]
INVALID += [" ".join(f"{place / 64}:0/0/0" for place in range(33)), " ".join(["0:0"] * 1025)]


@pytest.mark.parametrize("text", INVALID)
def test_other_text_is_refused(text):
    """Text that is not a ramp is refused with a sentence that quotes it."""
    with pytest.raises(HairError, match="is not a ramp"):
        ramp_text.parsed(text)
    with pytest.raises(HairError, match="is not a ramp"):
        MapSettings(ramp=text)


def test_a_ramp_has_the_kind_of_its_setting():
    """Colors need color ramps, numbers need curves."""
    varied_settings.require_map(MapSettings(setting="look.color", ramp=COLORS[0]))
    varied_settings.require_map(MapSettings(setting="look.melanin", ramp=CURVES[0]))
    with pytest.raises(HairError, match="color ramp, not a curve"):
        varied_settings.require_map(MapSettings(setting="look.color", ramp=CURVES[0]))
    with pytest.raises(HairError, match="curve, not a color ramp"):
        varied_settings.require_map(MapSettings(setting="look.melanin", ramp=COLORS[0]))


def test_masks_without_a_value_keep_none():
    """A ramp is evaluated between samples: masks beyond 0 and 1 have the ends, infinite masks are 0, and NaN stays
    NaN.
    """
    ramp = np.float32([[0.0, 1.0], [0.5, 1.0], [0.5, 0.0]])
    masks = np.float32([0.0, 0.25, 1.0, -3.0, 7.0, np.inf, np.nan])
    found = combination.ramped(masks, ramp, is_inverted=False)
    np.testing.assert_array_equal(found[:, 0], [0.0, 0.25, 0.5, 0.0, 0.5, 0.0, np.nan])
    np.testing.assert_array_equal(combination.ramped(masks, ramp, True)[:3, 1], [0.0, 0.5, 1.0])
