# SPDX-License-Identifier: GPL-3.0-or-later
"""Colliders have the settings of the hair unless an object overrides them."""

from hypothesis import given
from hypothesis import strategies as st

from hair_addon.core.dynamics.collision.collider_settings import ColliderSettings, contact_of
from hair_addon.core.dynamics.rod.settings import DynamicsSettings

FRICTIONS, DISTANCES = st.floats(0.0, 2.0), st.floats(0.0, 1e3)


@given(FRICTIONS, DISTANCES, FRICTIONS, DISTANCES, st.booleans(), st.booleans())
def test_an_object_overrides_what_it_says(friction, distance, own_friction, own_distance, has_friction, has_distance):
    settings = DynamicsSettings(friction=friction, collision_distance=distance)
    collider = ColliderSettings(
        overrides_friction=has_friction,
        friction=own_friction,
        overrides_distance=has_distance,
        collision_distance=own_distance,
    )
    assert contact_of(collider, settings) == (
        own_friction if has_friction else friction,
        own_distance if has_distance else distance,
    )
