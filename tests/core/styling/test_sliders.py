# SPDX-License-Identifier: GPL-3.0-or-later
"""A slider moves hair by degrees: half a step moves strands half as far, so a keyed setting does not jump."""

from dataclasses import fields, replace

import numpy as np
import pytest

from hair_addon.core.styling import bend, braid, clump, curl, frizz, kinds, lean, smooth, trim, wet
from tests.support.stepped import largest_move
from tests.support.styled import head

PLACES = 8  # along the slider
STEPS = 200

# Where sliders are tried: from 0 on, a limit or a distance that is 0 is none; with what else, so that they do something.
RANGES = {
    (trim.Settings, "to_length"): (0.02, 0.2),
    (trim.Settings, "factor"): (0.0, 2.0),
    (clump.Settings, "fine_amount"): (0.0, 1.0),
    (clump.Settings, "twist"): (-1.0, 1.0),
    (curl.Settings, "radius"): (0.0, 0.02),
    (curl.Settings, "pitch"): (0.01, 0.1),
    (curl.Settings, "switchback"): (0.05, 0.2),
    (frizz.Settings, "amplitude"): (0.0, 0.005),
    (frizz.Settings, "wavelength"): (0.02, 0.1),
    (frizz.Settings, "spread"): (0.02, 0.1),
    (frizz.Settings, "stray_gain"): (0.0, 5.0),
    (bend.Settings, "angle"): (-6.0, 6.0),
    (smooth.Settings, "length"): (0.002, 0.1),
    (braid.Settings, "pitch"): (0.02, 0.1),
    (braid.Settings, "radius"): (0.0, 0.01),
}
WITH = {
    (trim.Settings, "undercoat"): {"factor": 1.0},
    (frizz.Settings, "spread"): {"coherence": 1.0},
    (curl.Settings, "switchback"): {"left_handed": 0.0},
}
# Phases at tips run along steep sliders.
MORE_STEPS = {
    (frizz.Settings, "wavelength"): 3200,
    (frizz.Settings, "spread"): 6400,
    (curl.Settings, "pitch"): 1600,
    (curl.Settings, "switchback"): 3200,
    (braid.Settings, "pitch"): 1600,
    (lean.Settings, "clearance"): 800,
}
DEFAULTS = {
    trim.Settings: {"factor": 0.7, "random": 0.3},
    bend.Settings: {"random_turn": 0.2},
    clump.Settings: {"size": 0.03},
}
# A number of waves, and which level.
WHOLE = {"octaves", "tip_level", "seed", "levels"}


def sliders():
    """[(class, name)] of what can be keyed."""
    found = []
    for settings_class in kinds.KINDS.values():
        for field in fields(settings_class):
            details = field.metadata["param"]
            if isinstance(field.default, float) and not details.is_structural and field.name not in WHOLE:
                found.append((settings_class, field.name))
    return found


@pytest.fixture(scope="module")
def hair():
    return head(160, 40)


@pytest.mark.parametrize("settings_class, name", sliders(), ids=lambda value: getattr(value, "__module__", value))
def test_half_a_step_moves_strands_half_as_far(hair, settings_class, name):
    key = settings_class, name
    details = settings_class.__dataclass_fields__[name].metadata["param"]
    low, high = RANGES.get(key, (details.low, min(details.high, details.soft_high)))
    base = settings_class(**(DEFAULTS.get(settings_class, {}) | WITH.get(key, {})))
    step = (high - low) / MORE_STEPS.get(key, STEPS)
    moves = [], []
    for place in np.linspace(low, high - step, PLACES):
        # Zero is off, and is as far from the smallest amount as that is.
        points = [hair.styled(replace(base, **{name: place + part * step})) for part in (0.0, 0.5, 1.0)]
        moves[0].append(largest_move(points[2], points[0]))
        moves[1].append(max(largest_move(*pair) for pair in (points[:2], points[1:])))
    whole, half = max(moves[0]), max(moves[1])
    assert whole > 1e-6
    assert 1.7 < whole / half < 2.3, f"{1e3 * whole:.3f} mm, of half a step {1e3 * half:.3f} mm"
