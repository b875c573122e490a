# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers of styles that differ between strands: each strand is as in hair that has the strand's numbers everywhere."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp

from hair_addon.core.errors import HairError
from hair_addon.core.geometry.strands import from_numpy
from hair_addon.core.styling import bend, braid, clump, curl, frizz, kinds, lean, program, smooth, steps, trim, wet
from hair_addon.core.styling.masks import Inputs
from hair_addon.core.styling.varied_numbers import NumberMap
from tests.support.strands.styled import head

BELOW = (clump.Settings(levels=1), frizz.Settings(seed=2))

# Style, other styles above it, {setting: (value in one half, value in the other half)}.
CASES = {
    "trim": (trim.Settings(undercoat=0.2), (), {"factor": (0.8, 0.3), "random": (0.1, 0.5), "undercoat": (0.2, 0.6)}),
    "longest": (trim.Settings(), (), {"to_length": (0.12, 0.0)}),
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
    "profile": (curl.Settings(), (), {"root": (0.4, 0.0), "tip": (1.0, 0.2), "start": (0.0, 0.3)}),
    "shape": (frizz.Settings(), (), {"shape": (0.5, 0.8), "vary": (0.0, 0.5)}),
    "other shapes": (bend.Settings(), (), {"shape": (0.2, 0.5), "root": (0.0, 0.5)}),
    "profile of locks": (clump.Settings(levels=2), BELOW[1:], {"root": (0.0, 0.4), "fine_amount": (0.8, 0.2)}),
    "straight profile": (smooth.Settings(tip=1.0), BELOW[1:], {"tip": (1.0, 0.1), "shape": (0.9, 0.3)}),
    "lengths of curls": (curl.Settings(), (), {"keep_length": (1.0, 0.0)}),
    "octaves": (frizz.Settings(octaves=3), (), {"gain": (0.5, 0.8), "keep_length": (0.2, 1.0)}),
    "root of a braid": (braid.Settings(), (), {"root": (0.0, 0.6)}),
    "wet": (wet.Settings(amount=0.7), BELOW[1:], {"relax": (0.8, 0.0)}),
    "braid": (braid.Settings(), (), {"radius": (0.006, 0.01), "pitch": (0.04, 0.06), "thickness": (0.1, 0.3)}),
}


@pytest.fixture(scope="module")
def hair():
    return head(300, 40)


@pytest.fixture
def halves(hair):
    """Return a function that returns (S,) whether roots are in the second half of the head."""
    corners = hair.mesh.vertices[hair.mesh.triangles][..., 0]
    return lambda roots: (corners[roots.triangle] * roots.barycentric).sum(axis=1) > 0.0


@pytest.fixture
def varied(halves):
    """Return a function that returns a `NumberMap` with a value for each half of the head."""

    def made(values, is_of_places=False):
        return NumberMap(
            lambda roots, _identities, _clumps: np.where(halves(roots), values[1], values[0]), is_of_places
        )

    return made


@pytest.mark.parametrize("name", CASES)
def test_each_half_has_the_strands_of_its_own_numbers(hair, halves, varied, name):
    """Where numbers differ between two halves, each strand has the bits of hair with this strand's numbers, unless its
    lock has its center in the other half.
    """
    style, above, values = CASES[name]
    numbers = {(len(above), setting): varied(pair) for setting, pair in values.items()}
    found = hair.styled(*above, style, inputs=Inputs(numbers=numbers))
    is_second = halves(hair.binding.roots)
    assert 50 < is_second.sum() < 250
    styling = hair.bound(*above, style)
    is_whole = np.ones(len(found), bool)
    for level, members in zip(styling.levels, styling.data.members.numpy(), strict=False):
        is_whole &= (members < 0) | (halves(level.binding.roots)[members] == is_second)
    assert is_whole.mean() > 0.9
    for half in (0, 1):
        own = replace(style, **{setting: pair[half] for setting, pair in values.items()})
        alone = hair.styled(*above, own)
        same = is_whole & (is_second == half)
        np.testing.assert_array_equal(found[same], alone[same])
        assert (found != alone).any()


def test_locks_have_the_number_of_their_center(hair, halves, varied):
    """A number of a lock that belongs to places of the surface is that of the lock's center, also across a seam."""
    above, style = clump.Settings(levels=1, stray=0.0), curl.Settings()
    found = hair.styled(above, style, inputs=Inputs(numbers={(1, "pitch"): varied((0.02, 0.05), True)}))
    styling = hair.bound(above, style)
    of_centre = halves(styling.levels[0].binding.roots)[styling.data.members.numpy()[0]]
    assert (of_centre != halves(hair.binding.roots)).any()
    for half, pitch in enumerate((0.02, 0.05)):
        alone = hair.styled(above, replace(style, pitch=pitch))
        np.testing.assert_array_equal(found[of_centre == half], alone[of_centre == half])


def test_every_setting_that_may_vary_reaches_a_number():
    """Each setting of a style on strands that may vary changes a number of a step that kernels read for each strand."""
    for kind, settings_class in kinds.KINDS.items():
        for name in kinds.varied_settings_of(kind):
            values = {name: np.array([0.25, 0.5])}
            made = kinds.steps_of(kinds.with_values(settings_class(), values), {})
            numbers = [number for step in made for number in program.numbers_of(step)]
            is_of_guides = (
                (kind, name) == ("WET", "cling") or not made or name in ("size", "lock", "ratio", "crossover")
            )
            assert is_of_guides or any(isinstance(number, np.ndarray) for number in numbers)


@pytest.mark.parametrize(
    ("style", "values"),
    [
        (lean.Settings(), {"clearance": (0.004, 0.03)}),
        (lean.Settings(), {"root": (0.0, 0.5), "tip": (1.0, 0.3), "start": (0.0, 0.4)}),
        (lean.Settings(), {"shape": (0.5, 0.9), "vary": (0.0, 0.8)}),
        (wet.Settings(), {"cling": (0.35, 0.9)}),
    ],
)
def test_each_half_has_the_guides_of_its_own_numbers(hair, halves, varied, style, values):
    """Guides of styles on guides have the bits of guides with their own numbers, also if only some guides change."""
    numbers = {(0, setting): varied(pair) for setting, pair in values.items()}
    is_second = halves(hair.guides.roots)
    styling = hair.bound(style, inputs=Inputs(numbers=numbers))
    found = styling.guides(hair.guides).numpy()
    for half in (0, 1):
        own = replace(style, **{setting: pair[half] for setting, pair in values.items()})
        alone = hair.bound(own).guides(hair.guides).numpy()
        np.testing.assert_array_equal(found[is_second == half], alone[is_second == half])
        assert (found != alone).any()
    moved = hair.guides.numpy().copy()
    moved[10:20, 1:] += 0.01
    moved = from_numpy(moved, hair.guides.roots)
    again = hair.bound(style, inputs=Inputs(numbers=numbers)).guides(moved).numpy()
    np.testing.assert_array_equal(styling.guides(moved).numpy(), again)


def test_missing_rows_of_numbers_are_an_error(hair, varied):
    """A program whose numbers of strands are not among the masks of its strands does not reach the kernel."""
    styling = hair.bound(curl.Settings(), inputs=Inputs(numbers={(0, "radius"): varied((0.0, 0.01))}))
    none = replace(styling.data, masks=wp.zeros((0, 0), dtype=float, device=hair.device))
    points = wp.zeros((len(hair.binding.roots), 41), dtype=wp.vec3, device=hair.device)
    with pytest.raises(HairError, match="numbers of strands"):
        steps.apply_steps(points, styling.program, none, np.eye(4))
