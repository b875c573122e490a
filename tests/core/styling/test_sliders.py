# SPDX-License-Identifier: GPL-3.0-or-later
"""Sliders move hair continuously over their whole range, on five grooms, so animated settings do not jump.

The largest move m(h) of any point over steps h of a slider obeys m(h) ≤ 2 m(h/2), by the triangle inequality. As h
falls, m(h)/h rises to the slider's steepest slope: m(h)/m(h/2) tends to 2 where strands move by degrees, and to 1 where
they jump. How short the steps must be depends on the hair: phases at tips run, and strands in tight bends swing. So
steps are halved where strands move the most, until two halvings in turn halve the moves, within 1.7; a jump would stay.
"""

from collections import Counter
from dataclasses import fields, replace
from functools import cache, partial
from itertools import islice

import numpy as np
import pytest

from hair_addon.core.styling import bend, braid, clump, curl, frizz, kinds, lean, smooth, trim, wet
from tests.support.dynamics.slid import Slid, steepest_moves
from tests.support.strands import styled

PLACES = 32  # along the slider, at first
FEWEST_HALVINGS, MOST_HALVINGS = 5, 16
ROUNDING = 2e-5  # [m]: what moves strands less is no jump

# Where sliders are tried other than from their lowest to their highest value; lengths by even ratios.
RANGES = {
    (trim.Settings, "to_length"): (0.002, 1.0),  # 0 is no limit
    (smooth.Settings, "length"): (0.0001, 0.1),  # shorter chords are those of one segment
    (clump.Settings, "twist"): (-1.0, 1.0),  # more turns take more length than strands have
    (braid.Settings, "radius"): (0.0, 0.02),  # as do wider braids
    # Phases are lengths divided by these: of shorter waves, which points cannot carry, many turns pass in a step.
    (curl.Settings, "pitch"): (0.01, 0.2),
    (curl.Settings, "switchback"): (0.02, 0.2),
    (frizz.Settings, "wavelength"): (0.01, 0.2),
    (frizz.Settings, "spread"): (0.01, 0.2),
    (braid.Settings, "pitch"): (0.04, 0.2),
}
# Other settings that a slider needs for an effect.
WITH = {
    trim.Settings: {"factor": 0.7, "random": 0.3},
    bend.Settings: {"random_turn": 0.2},
    wet.Settings: {"lock": 0.2},
    lean.Settings: {"clearance": 0.02},
    braid.Settings: {"pitch": 0.08, "radius": 0.008},
    (trim.Settings, "undercoat_length"): {"undercoat": 0.5},
    (frizz.Settings, "spread"): {"coherence": 1.0},
    # A profile that begins steeply moves points as steeply where its beginning passes them.
    (clump.Settings, "start"): {"shape": 0.5},
    (braid.Settings, "start"): {"shape": 0.5},
    (smooth.Settings, "shape"): {"root": 0.0},
    (smooth.Settings, "start"): {"root": 0.0},
    (curl.Settings, "switchback"): {"left_handed": 0.0},
}

# The second head has strands that turn back by 170°.
HAIR = [partial(styled.head, 160, 40), partial(styled.head, 160, 40, seed=5)]
HAIR += [partial(styled.beard, 160), partial(styled.lawn, 160), partial(styled.ball, 160, size=0.1)]
# For what keeps guides off the surface, whose nearest point jumps on a head.
FUR = [partial(styled.ball, 60, seed=seed) for seed in range(1, 6)]
GROOMINGS = len(HAIR)


def sliders():
    """Return [(class, name)] of the settings that can be keyed."""
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


def cases():
    """Return each slider on each grooming; all are marked `long` except one grooming for the first and every sixth
    slider of a style.
    """
    counts = Counter()
    for place, (settings_class, name) in enumerate(sliders()):
        counts[settings_class] += 1
        is_quick = counts[settings_class] % 6 == 1
        for grooming in range(GROOMINGS):
            marks = () if is_quick and grooming == place % GROOMINGS else pytest.mark.long
            case = f"{settings_class.__module__.rpartition('.')[2]}-{name}-{grooming}"
            yield pytest.param(settings_class, name, grooming, id=case, marks=marks)


def is_by_degrees(moves):
    """Whether strands moved half as far in the last two of ever shorter steps, each half as long as the one before."""
    if len(moves) <= FEWEST_HALVINGS:
        return False
    return min(moves[-3] / moves[-2], moves[-2] / moves[-1]) > 1.7


@cache
def groomed(maker):
    return maker()


@pytest.mark.parametrize("settings_class, name, grooming", list(cases()))
def test_half_a_step_moves_strands_half_as_far(settings_class, name, grooming):
    hair = groomed((FUR if settings_class in {lean.Settings, wet.Settings} else HAIR)[grooming])
    key = settings_class, name
    details = settings_class.__dataclass_fields__[name].metadata["param"]
    low, high = RANGES.get(key, (details.low, min(details.high, details.soft_high)))
    is_length = key in RANGES and low > 0.0
    values = (np.geomspace if is_length else np.linspace)(low, high, PLACES + 1)
    base = settings_class(**WITH.get(settings_class, {}) | WITH.get(key, {}))
    in_effect = base if name == "amount" else replace(base, **{name: values[PLACES // 2]})
    moves = []
    for move in islice(steepest_moves(Slid(hair, in_effect, name).at, values), MOST_HALVINGS + 1):
        moves.append(move)
        if move < ROUNDING or is_by_degrees(moves):
            break
    else:
        pytest.fail(f"Ever shorter steps move strands by {', '.join(f'{1e3 * move:.3f}' for move in moves)} mm.")
    assert moves[0] > 1e-5
