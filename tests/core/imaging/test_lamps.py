# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps chosen by importance lose no light, and change continuously."""

import numpy as np
import pytest

from hair_addon.core.imaging import ambient_cube, lamps

FIELDS = {"kind": (), "cos_cone": (), "blend": (), "radius": (), "position": (4,), "axis": (4,), "power": (4,)}
LAMP = np.dtype([(name, "<i4" if name == "kind" else "<f4", shape) for name, shape in FIELDS.items()])


def some_lamps(rng, count):
    """Return lamps of every kind around the origin."""
    found = np.zeros(count, LAMP)
    found["kind"] = np.arange(count) % 4
    positions = rng.normal(size=(count, 3))
    positions *= rng.uniform(2.0, 6.0, (count, 1)) / np.linalg.norm(positions, axis=1, keepdims=True)
    found["position"][:, :3] = positions
    axes = -positions + rng.normal(size=(count, 3))
    found["axis"][:, :3] = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    found["power"][:, :3] = rng.uniform(0.0, 100.0, (count, 3))
    found["cos_cone"], found["blend"] = rng.uniform(0.2, 0.9, count), rng.uniform(0.0, 1.0, count)
    found["radius"] = rng.uniform(0.0, 0.5, count)
    return found


def test_all_are_drawn_where_there_is_room(rng):
    assert (lamps.shares(rng.random(16), 16) == 1.0).all()


@pytest.mark.parametrize("count", [17, 40, 300])
def test_no_more_than_there_is_room_for_are_drawn_and_the_brightest_first(rng, count):
    importance = 10.0 ** rng.uniform(-3.0, 3.0, count)
    shares = lamps.shares(importance, 16)
    assert 1 <= np.count_nonzero(shares) <= 16
    assert (np.diff(shares[np.argsort(importance)]) >= 0.0).all() and shares.max() == 1.0


def test_a_lamp_fades_out_before_another_takes_its_place(rng):
    """A lamp fades out before another takes its place: importances that change by 1/1000 change no share by more
    than 1/50.
    """
    start, end = 10.0 ** rng.uniform(-1.0, 1.0, (2, 40))
    moments = np.linspace(0.0, 1.0, 20_000)
    along = np.array([lamps.shares(start ** (1.0 - t) * end**t, 16) for t in moments])
    assert (np.diff(np.argsort(along.sum(axis=0))) != 0).all() and np.count_nonzero(np.ptp(along, axis=0) == 1.0) > 5
    assert np.abs(np.diff(along, axis=0)).max() < 0.02


def test_equal_lamps_are_treated_equally():
    assert np.ptp(lamps.shares(np.ones(40), 16)) == 0.0


def test_ambient_light_of_lamps_keeps_the_mean_irradiance(rng):
    """Ambient light of lamps keeps the mean irradiance over all orientations of a plane: max(cos, 0) has the mean
    1/4.
    """
    some, place = some_lamps(rng, 12), np.zeros((1, 3))
    normals = rng.normal(size=(200_000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    arriving = lamps.irradiance(some, place)[:, 0]
    cosines = np.maximum(lamps.directions_to(some, place)[:, 0] @ normals.T, 0.0)
    expected = np.einsum("nc,nd->c", arriving, cosines) / len(normals)
    # As shaders/light/world.glsl lights a surface.
    planes = np.pi * ambient_cube.side_shares(normals) @ lamps.ambient_sides(some, place)
    np.testing.assert_allclose(planes.mean(axis=0), expected, rtol=0.01)


def test_ambient_light_of_places_is_their_mean(rng):
    some, places = some_lamps(rng, 8), rng.normal(size=(5, 3))
    one_by_one = np.mean([lamps.ambient_sides(some, place[None]) for place in places], axis=0)
    np.testing.assert_allclose(lamps.ambient_sides(some, places), one_by_one, rtol=1e-9)


def test_a_lamp_that_shines_all_around_turns_its_disk_to_all():
    """At any distance the lamp is an area lamp that faces the place, with a quarter of the power."""
    around = np.zeros(1, LAMP)
    around["kind"], around["radius"], around["axis"][0, 2], around["power"] = lamps.POINT, 0.3, -1.0, 4.0
    forward = around.copy()
    forward["kind"], forward["power"] = lamps.AREA, 1.0
    places = np.array([[0.0, 0.0, -height] for height in (0.01, 0.1, 0.3, 1.0, 20.0)])
    np.testing.assert_allclose(lamps.irradiance(around, places), lamps.irradiance(forward, places), rtol=1e-6)
