# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of files are readable, allowed by all systems, and different for different things."""

import pytest

from hair_addon.core.files.file_names import free_stem, stem_of


@pytest.mark.parametrize("name", ["Bob", "Grün", "Grän", "短发 1", "Bob.v1", "Bob (short)", "a'b"])
def test_what_systems_allow_stays(name):
    assert stem_of(name) == name


def test_signs_that_some_systems_forbid_are_replaced():
    assert stem_of("a/b:c\\d*e?f<g>h|i\n") == "a_b_c_d_e_f_g_h_i_"
    assert stem_of(" ../Bob. ") == "_Bob" and not stem_of(" . ")


def test_different_things_have_different_files():
    """Names differ also on systems that ignore case."""
    owners = {}
    for name in ("A/B", "A:B", "a|b", "A_B", "A_B.001"):
        owners[free_stem(name, lambda stem: stem.casefold() in owners).casefold()] = name
    assert len(owners) == 5 and owners["a_b"] == "A/B"
