# SPDX-License-Identifier: GPL-3.0-or-later
"""A slider moves hair by degrees: half a step moves strands half as far, so a keyed setting does not jump."""

from dataclasses import fields, replace

import numpy as np
import pytest

from hair_addon.core.styling import bend, braid, clump, curl, frizz, kinds, lean, smooth, trim, wet
from tests.support.stepped import largest_move
from tests.support.styled import ball, head

PLACES = 8  # along the slider
STEPS = 200

# Where sliders are tried, a limit of 0 being none; and with what else, so that they do something.
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
    (wet.Settings, "amount"): (0.1, 1.0),  # small locks join by its square root
    (braid.Settings, "pitch"): (0.1, 0.3),
    (braid.Settings, "radius"): (0.0, 0.02),
    (braid.Settings, "root"): (0.0, 0.5),
}
WITH = {
    (trim.Settings, "undercoat_length"): {"undercoat": 0.5},
    (frizz.Settings, "spread"): {"coherence": 1.0},
    (smooth.Settings, "shape"): {"root": 0.0},
    (smooth.Settings, "start"): {"root": 0.0},
    (curl.Settings, "switchback"): {"left_handed": 0.0},
}
# Phases at tips run along steep sliders.
MORE_STEPS = {
    (clump.Settings, "start"): 1600,
    (clump.Settings, "stray"): 1600,
    (clump.Settings, "twist"): 3200,
    (curl.Settings, "amount"): 1600,
    (curl.Settings, "tip"): 1600,
    (frizz.Settings, "coherence"): 6400,
    (braid.Settings, "amount"): 3200,
    (braid.Settings, "vary"): 3200,
    (braid.Settings, "root"): 3200,
    (braid.Settings, "tip"): 3200,
    (braid.Settings, "shape"): 3200,
    (braid.Settings, "thickness"): 3200,
    (braid.Settings, "start"): 1600,
    (frizz.Settings, "wavelength"): 3200,
    (frizz.Settings, "spread"): 25600,
    (curl.Settings, "pitch"): 1600,
    (curl.Settings, "switchback"): 3200,
    (braid.Settings, "pitch"): 3200,
    (lean.Settings, "amount"): 6400,
    (lean.Settings, "tip"): 6400,
    (lean.Settings, "start"): 3200,
    (lean.Settings, "clearance"): 1600,
    (wet.Settings, "amount"): 6400,
    (wet.Settings, "cling"): 6400,
}
DEFAULTS = {
    trim.Settings: {"factor": 0.7, "random": 0.3},
    bend.Settings: {"random_turn": 0.2},
    clump.Settings: {"size": 0.03},
    wet.Settings: {"lock": 0.2},
    braid.Settings: {"size": 0.3, "radius": 0.015, "pitch": 0.15},
    lean.Settings: {"clearance": 0.02},
}
# Of all styles: a profile that begins vertically moves by a power of the step where its beginning passes a point.
PROFILES = {"shape": ((0.1, 0.9), {}), "start": ((0.0, 0.8), {"shape": 0.5})}


def sliders():
    """[(class, name)] of what can be keyed."""
    found = []
    for settings_class in kinds.KINDS.values():
        for field in fields(settings_class):
            details = field.metadata["param"]
            if (
                isinstance(field.default, float)
                and not details.is_structural
                and (settings_class, field.name) != (wet.Settings, "swelling")
            ):  # of radii alone
                found.append((settings_class, field.name))
    return found


@pytest.fixture(scope="module")
def hair():
    return head(160, 40)


@pytest.fixture(scope="module")
def fur():
    """For what keeps off the surface, whose nearest point jumps on a head, and for braids, which need gentle curves."""
    return ball(160)


@pytest.mark.parametrize("settings_class, name", sliders(), ids=lambda value: getattr(value, "__module__", value))
def test_half_a_step_moves_strands_half_as_far(hair, fur, settings_class, name):
    key = settings_class, name
    hair = fur if settings_class in {lean.Settings, wet.Settings, braid.Settings} else hair
    details = settings_class.__dataclass_fields__[name].metadata["param"]
    limits, others = PROFILES.get(name, ((details.low, min(details.high, details.soft_high)), {}))
    low, high = RANGES.get(key, limits)
    base = settings_class(**(DEFAULTS.get(settings_class, {}) | WITH.get(key, {}) | others))
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
