# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers of styles that differ between strands: each strand is as in hair that has the strand's numbers everywhere."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp

from hair_addon.core.errors import HairError
from hair_addon.core.styling import bend, braid, clump, curl, frizz, kinds, smooth, steps, trim
from hair_addon.core.styling.style_inputs import Inputs
from hair_addon.core.styling.varied_numbers import NumberMap
from tests.support.strands.styled import head

BELOW = (clump.Settings(levels=1), frizz.Settings(seed=2))

# Style, other styles above it, {setting: (value in one half, value in the other half)}.
CASES = {
    "trim": (trim.Settings(undercoat=0.2), (), {"factor": (0.8, 0.3), "random": (0.1, 0.5), "undercoat": (0.2, 0.6)}),
    "curl": (curl.Settings(), (), {"radius": (0.004, 0.0), "pitch": (0.02, 0.05), "flatness": (0.1, 1.0)}),
    "curl in locks": (curl.Settings(), BELOW[:1], {"radius": (0.004, 0.007), "coherence": (0.9, 0.2)}),
    "hands of curls": (
        curl.Settings(),
        (),
        {"pitch_vary": (0.0, 0.6), "stretch": (0.0, 1.5), "left_handed": (0.0, 0.9), "switchback": (0.0, 0.02)},
    ),
    "frizz": (frizz.Settings(octaves=3), (), {"amplitude": (0.002, 0.005), "wavelength": (0.02, 0.07)}),
    "coherent frizz": (frizz.Settings(), (), {"coherence": (0.0, 0.8), "spread": (0.02, 0.05)}),
    "stray frizz": (frizz.Settings(), (), {"stray": (0.0, 0.4), "stray_gain": (1.0, 5.0)}),
    "bend": (bend.Settings(), (), {"angle": (0.5, -3.0), "turn": (0.0, 1.0), "random_turn": (0.0, 0.7)}),
    "smooth": (smooth.Settings(), BELOW[1:], {"length": (0.02, 0.1)}),
    "clump": (clump.Settings(levels=1), BELOW[1:], {"thickness": (0.1, 0.6), "twist": (0.0, 1.5)}),
    "stray strands": (clump.Settings(levels=1), BELOW[1:], {"stray": (0.0, 0.5)}),
    "braid": (braid.Settings(), (), {"radius": (0.006, 0.01), "pitch": (0.04, 0.06), "thickness": (0.1, 0.3)}),
}


@pytest.fixture(scope="module")
def hair():
    return head(300, 40)


def halves(binding):
    """Return (S,) whether roots are in the second half of the head."""
    return binding.positions.numpy()[:, 0] > 0.0


def varied(values, is_of_places=False):
    """Return the `NumberMap` of a value in each half of the head."""
    return NumberMap(lambda binding, _clumps: np.where(halves(binding), values[1], values[0]), is_of_places)


@pytest.mark.parametrize("name", CASES)
def test_each_half_has_the_strands_of_its_own_numbers(hair, name):
    """Where numbers differ between two halves, each strand has the bits of hair with this strand's numbers; centers of
    locks have the same numbers in both.
    """
    style, above, values = CASES[name]
    numbers = {(len(above), setting): varied(pair) for setting, pair in values.items()}
    found = hair.styled(*above, style, inputs=Inputs(numbers=numbers))
    is_second = halves(hair.binding)
    assert 50 < is_second.sum() < 250
    for half in (0, 1):
        own = replace(style, **{setting: pair[half] for setting, pair in values.items()})
        alone = hair.styled(*above, own)
        np.testing.assert_array_equal(found[is_second == half], alone[is_second == half])
        assert (found != alone).any()


def test_locks_have_the_number_of_their_center(hair):
    """A number of a lock that belongs to places of the surface is that of the lock's center, also across a seam."""
    above, style = clump.Settings(levels=1, stray=0.0), curl.Settings()
    found = hair.styled(above, style, inputs=Inputs(numbers={(1, "pitch"): varied((0.02, 0.05), True)}))
    styling = hair.bound(above, style)
    of_centre = halves(styling.levels[0].binding)[styling.data.members.numpy()[0]]
    assert (of_centre != halves(hair.binding)).any()
    for half, pitch in enumerate((0.02, 0.05)):
        alone = hair.styled(above, replace(style, pitch=pitch))
        np.testing.assert_array_equal(found[of_centre == half], alone[of_centre == half])


def test_every_setting_that_may_vary_reaches_a_number():
    """Each setting of a style that may vary changes a number of a step that kernels read for each strand."""
    for kind, settings_class in kinds.KINDS.items():
        for name in kinds.varied_settings_of(kind):
            values = {name: np.array([0.25, 0.5])}
            made = kinds.steps_of(kinds.with_values(settings_class(), values), {})
            assert any(isinstance(number, np.ndarray) for step in made for number in step.numbers.values())


def test_missing_rows_of_numbers_are_an_error(hair):
    """A program whose numbers of strands are not among the masks of its strands does not reach the kernel."""
    styling = hair.bound(curl.Settings(), inputs=Inputs(numbers={(0, "radius"): varied((0.0, 0.01))}))
    none = replace(styling.data, masks=wp.zeros((0, 0), dtype=float, device=hair.device))
    points = wp.zeros((len(hair.binding.roots), 41), dtype=wp.vec3, device=hair.device)
    with pytest.raises(HairError, match="numbers of strands"):
        steps.apply_steps(points, styling.program, none, np.eye(4))
