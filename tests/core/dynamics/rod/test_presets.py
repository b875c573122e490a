# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets of dynamics set their settings, keep all others, and are compared with the current settings."""

from dataclasses import asdict, replace
from itertools import pairwise

import pytest

from hair_addon.core.dynamics.rod import presets
from hair_addon.core.dynamics.rod.settings import DynamicsSettings
from hair_addon.core.dynamics.rod.stiffness_advice import bend_under_weight
from hair_addon.core.params import declared

# Every setting elsewhere than at its default.
OTHER = DynamicsSettings(
    **{
        name: (not default) if isinstance(default, bool) else "Body" if isinstance(default, str) else details.high
        for name, default, details in declared(DynamicsSettings)
    }
)


@pytest.mark.parametrize("identifier", presets.PRESETS)
def test_a_preset_sets_the_same_whatever_was_set_before(identifier):
    fresh, changed = (presets.applied(settings, identifier) for settings in (DynamicsSettings(), OTHER))
    assert presets.applied(changed, identifier) == changed
    for name, value in asdict(changed).items():
        assert value == getattr(fresh if name in presets.NAMES else OTHER, name), name


def test_natural_is_the_default():
    assert presets.applied(DynamicsSettings(), "NATURAL") == DynamicsSettings()
    for identifier in presets.PRESETS:
        assert presets.applied(presets.applied(DynamicsSettings(), identifier), "NATURAL") == DynamicsSettings()


def test_presets_are_ordered_by_how_far_hair_bends():
    order = ["SHORT_FUR", "STYLED", "NATURAL", "WET", "LOOSE"]
    assert set(order) == set(presets.PRESETS)
    bends = [bend_under_weight(presets.applied(DynamicsSettings(), name), 0.15, 9.81) for name in order]
    assert all(softer > 1.05 * stiffer for stiffer, softer in pairwise(bends))


def test_presets_differ_from_their_neighbors_in_what_they_name():
    for _label, _tooltip, changes in presets.PRESETS.values():
        assert set(changes) <= set(presets.NAMES)
        assert replace(DynamicsSettings(), **changes) != DynamicsSettings() or not changes
