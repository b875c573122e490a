# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of settings: numbers of any kind become plain Python values; everything else is refused with a message."""

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hair_addon.core.errors import HairError
from hair_addon.core.files.settings_file import GroomSettings
from hair_addon.core.grooming.groom import GuideSettings, HairSettings
from hair_addon.core.params import Settings, declared, param


@dataclass(frozen=True)
class Sample(Settings):
    """Settings with one setting of each type."""

    count: int = param(3, "How many", low=1, high=2**31 - 1)
    size: float = param(0.5, "How large", low=-1e6, high=1e6)
    is_on: bool = param(True, "Whether")
    group: str = param("", "Which")
    kind: str = param("A", "What", choices=(("A", "A", ""), ("B", "B", "")))
    color: tuple = param((1.0, 1.0, 1.0), "Color", low=0.0, high=1.0)


TAKEN = {
    "count": [(4.0, 4), (np.int64(4), 4), (np.uint8(4), 4), (np.float32(4), 4), (Fraction(8, 2), 4)],
    "size": [(2, 2.0), (np.float32(0.25), 0.25), (np.int16(-3), -3.0), (Fraction(1, 2), 0.5), (np.longdouble(1), 1.0)],
    "is_on": [(np.True_, True), (np.False_, False)],
    "group": [(np.str_("top"), "top"), ("Köpfe", "Köpfe")],
    "kind": [(np.str_("B"), "B")],
    "color": [([0, 1, 0.5], (0.0, 1.0, 0.5)), (np.float32([0, 1, 0.5]), (0.0, 1.0, 0.5))],
}

NO_NUMBERS = [
    None,
    "4",
    b"4",
    True,
    np.True_,
    [4],
    (4,),
    {4: 4},
    np.array(4),
    np.array([4]),
    4j,
    np.complex64(4),
    print,
]
NO_NUMBERS += [math.nan, math.inf, -math.inf, np.float32("nan"), 10**400, -(10**400), 10**5000, Fraction(10**400)]
REFUSED = {
    "count": [*NO_NUMBERS, 1.5, np.float64(1.5), 2**31, 0],
    "size": NO_NUMBERS,
    "is_on": [None, 0, 1, 1.0, "True", [], np.array(True)],
    "group": [None, 4, b"top", ["top"], "\udcff", "\ud800", "a\0b", "\0"],
    "kind": [None, "C", b"A", ["A"], "", {"A": 1}],
    "color": [None, 1.0, "abc", b"abc", (1, 1), [1] * 4, {1, 0.5, 0}, {0: 1, 1: 1, 2: 1}, np.eye(3), np.array(1.0)]
    + [[1, 1, no_number] for no_number in NO_NUMBERS]
    + [[1, [1, 1], 1]],
}


@pytest.mark.parametrize("name", TAKEN)
def test_values_become_plain_values_of_the_default_s_type(name):
    for value, plain in TAKEN[name]:
        settings = Sample(**{name: value})
        found = getattr(settings, name)
        assert found == plain and type(found) is type(plain)
        assert settings == Sample(**{name: plain}) and hash(settings) == hash(Sample(**{name: plain}))
        if isinstance(plain, tuple):
            assert {type(component) for component in found} == {float}


@pytest.mark.parametrize("name", REFUSED)
def test_values_of_other_types_are_refused_in_a_sentence_that_names_the_setting(name):
    for value in REFUSED[name]:
        with pytest.raises(HairError) as refused:
            Sample(**{name: value})
        reported = str(refused.value)
        assert reported.startswith(name.replace("_", " ").capitalize())
        assert "\n" not in reported and len(reported) < 120 and reported.isprintable()


ANYTHING = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.complex_numbers(),
    st.text(st.characters(), max_size=5),
    st.binary(max_size=5),
    st.fractions(),
    st.decimals(),
    st.lists(st.floats() | st.none(), max_size=4),
    st.sampled_from([np.array([1.0, 2.0, 3.0]), np.eye(2), np.array("text"), np.float16("inf"), np.datetime64(1, "s")]),
)


@given(
    st.sampled_from([GuideSettings, HairSettings]).flatmap(
        lambda settings: st.tuples(st.just(settings), st.sampled_from(declared(settings)), ANYTHING)
    )
)
def test_any_value_is_taken_or_refused(given_value):
    settings_class, (name, default, details), value = given_value
    try:
        found = getattr(settings_class(**{name: value}), name)
    except HairError:
        return
    if value is None:
        assert found is None and details.typical is not None  # it follows from the surface
        return
    assert type(found) is type(default)
    if isinstance(default, int | float):
        assert math.isfinite(found) and details.low <= found <= details.high


def test_a_section_takes_settings_of_its_class_alone():
    with pytest.raises(HairError, match=r"^hair must be groom\.HairSettings, not a value of type GuideSettings\.$"):
        GroomSettings(hair=GuideSettings())
    with pytest.raises(HairError, match=r"^tables must be lookup_tables\.Settings, not None\.$"):
        GroomSettings(tables=None)
