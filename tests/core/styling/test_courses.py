# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves from root to tip by which numbers of styles are multiplied."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.grooming import style_binding
from hair_addon.core.styling import bend, braid, clump, courses, curl, frizz, kinds, lean, smooth
from hair_addon.core.styling.masks import Inputs
from tests.support.devices import DEVICE
from tests.support.strands.styled import head

CURL = curl.Settings()

# Style, other styles above it.
CASES = {
    "bend": (bend.Settings(shape=0.7, start=0.1), ()),
    "clump": (clump.Settings(levels=2, twist=1.5, root=0.4), (frizz.Settings(),)),
    "curl": (curl.Settings(flatness=0.6, stretch=0.5), ()),
    "frizz": (frizz.Settings(), ()),
    "smooth": (smooth.Settings(amount=0.7), (frizz.Settings(),)),
    "braid": (braid.Settings(root=0.3), ()),
    "lean": (lean.Settings(amount=0.6), ()),
}
SETTINGS = [(name, setting) for name, (style, _) in CASES.items() for setting in courses.settings_with_course(style)]
# 1 up to six tenths of the length, then down to 0.2.
LATE = np.interp(np.linspace(0.0, 1.0, 256), [0.0, 0.6, 1.0], [1.0, 1.0, 0.2])


@pytest.fixture(scope="module")
def hair():
    return head(200, 30)


def styled(hair, name, curves):
    """Return (S, P, 3) with courses {setting: samples} of the style of a case."""
    style, above = CASES[name]
    found = {(len(above), setting): course for setting, course in curves.items()}
    return hair.styled(*above, style, inputs=Inputs(courses=found))


@pytest.mark.parametrize("name", CASES)
def test_a_course_of_one_keeps_all_bits(hair, name):
    """A course of ones gives the bits of no course; on a GPU, whose compiler fuses operations, to rounding."""
    ones = dict.fromkeys(courses.settings_with_course(CASES[name][0]), np.ones(5))
    found, plain = styled(hair, name, ones), styled(hair, name, {})
    np.testing.assert_allclose(found, plain, rtol=0.0, atol=0.0 if DEVICE == "cpu" else 2e-7)


@pytest.mark.parametrize(("name", "setting"), SETTINGS)
def test_a_late_course_changes_the_outer_part_alone(hair, name, setting):
    """Points before a curve descends keep their bits, and points near the tip move."""
    found, plain = styled(hair, name, {setting: LATE}), styled(hair, name, {})
    # Lengths along the center of a lock, and of guides, are not those of the strand.
    if name not in ("clump", "braid", "lean"):
        inner = int(0.5 * plain.shape[1])
        np.testing.assert_array_equal(found[:, :inner], plain[:, :inner])
    moved = np.linalg.norm(found - plain, axis=-1)
    assert moved[:, -1].mean() > 1e-4
    np.testing.assert_array_equal(moved[:, 0], 0.0)


def test_cut_strands_have_the_course_of_their_own_style(hair):
    """Strands that are cut before the styles keep the courses of their styles, which then have another place."""
    course = {(0, "radius"): np.full(2, 0.5)}
    found, wanted = (
        style_binding.bind_styles(
            hair.binding,
            hair.guides,
            replace(hair.settings, strand_length=length),
            [CURL],
            hair.trees,
            Inputs(courses=course),
        ).program
        for length in (0.5, 1.0)
    )
    assert len(found) == 2 and found.before(1).choices[0, -1] == 0
    np.testing.assert_array_equal(found.choices[1, -1:], wanted.choices[0, -1:])
    assert found.choices[1, -1] > 0


@pytest.mark.parametrize(("name", "setting"), [pair for pair in SETTINGS if pair[1] not in ("pitch", "wavelength")])
def test_a_constant_course_is_a_factor(hair, name, setting):
    """A course of one half halves the number, also where it sets the roots of locks and the progress of waves."""
    style, above = CASES[name]
    half = hair.styled(*above, replace(style, **{setting: 0.5 * getattr(style, setting)}))
    found = styled(hair, name, {setting: np.full(3, 0.5)})
    # The start of a curl depends on its largest radius.
    off = np.linalg.norm(found - half, axis=-1)
    assert np.quantile(off, 0.95) < (2e-3 if (name, setting) == ("curl", "radius") else 2e-5)


def test_waves_of_half_the_length_are_twice_as_many(hair):
    """A constant course of the wavelength scales the noise of frizz along the strand, and leaves out the waves that the
    strand's points cannot carry.
    """
    wanted = hair.styled(frizz.Settings(wavelength=0.06, octaves=3, stray=0.0))
    style = frizz.Settings(wavelength=0.12, octaves=3, stray=0.0)
    found = hair.styled(style, inputs=Inputs(courses={(0, "wavelength"): np.full(2, 0.5)}))
    np.testing.assert_allclose(found, wanted, atol=2e-5)


def test_every_setting_with_a_course_reaches_a_kernel():
    """Each setting of a style on strands that may have a course is in the list of its step, the amount first."""
    for kind, settings_class in kinds.KINDS.items():
        names = courses.settings_with_course(settings_class)
        for step in kinds.steps_of(settings_class(), {}) if kind != "WET" else ():
            listed = courses.names_of(kinds.STEPS[step.kind])
            assert sorted(listed) == sorted(names)
            assert not listed or listed[0] == "amount"
            assert len(listed) <= courses.MOST_OF_A_STEP


def test_too_many_courses_are_refused(hair):
    styles = [bend.Settings(angle=0.01)] * 64
    names = ("amount", "angle")
    curves = {
        (place, name): np.full(2, 0.001 * place + 0.5 * (name == "angle")) for place in range(64) for name in names
    }
    with pytest.raises(HairError, match="at most 127 curves"):
        hair.bound(*styles, inputs=Inputs(courses=curves))
    few = {key: course for key, course in curves.items() if key[0] < 60}
    assert len(hair.bound(*styles, inputs=Inputs(courses=few)).program.courses) == 120
