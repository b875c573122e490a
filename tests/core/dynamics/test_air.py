# SPDX-License-Identifier: GPL-3.0-or-later
"""Force fields have the strength and falloff of Blender's, air has a velocity, and noise is smooth."""

import math

import numpy as np
import pytest
import warp as wp

from hair_addon.core.dynamics.air import Air, ForceField
from hair_addon.core.errors import HairError

AXIS = np.array([0.6, 0.0, 0.8])
ORIGIN = np.array([0.3, -0.2, 0.1])


def blown(device, fields, points, velocities=None, time=0.0):
    """Return (airs (N, 3), accelerations (N, 3), drags (N,), warnings) at points (N, 3)."""
    points = np.asarray(points, np.float32)
    velocities = np.zeros_like(points) if velocities is None else np.asarray(velocities, np.float32)
    air = Air((1, 1, len(points)), device)
    there = [wp.array(np.ascontiguousarray(a.T)[None], dtype=float, device=device) for a in (points, velocities)]
    reported = air.blow(fields, *there, time)
    return air.airs.numpy()[0].T.copy(), air.accelerations.numpy()[0].T.copy(), air.drags.numpy()[0, 0].copy(), reported


def field(kind="WIND", **details):
    return ForceField(kind, tuple(ORIGIN), tuple(2.0 * AXIS), **details)


def points_around(rng, count=200):
    return ORIGIN + rng.normal(size=(count, 3))


def falloff(distance, minimum, maximum, power):
    """Return the falloff of effect.cc: 1 up to the minimum, 0 beyond the maximum, between (1 + d - minimum)^-power."""
    part = np.maximum(1.0 + distance - (minimum or 0.0), 1e-3) ** -power
    part = np.where((minimum is not None) & (distance < (minimum or 0.0)), 1.0, part)
    return np.where((maximum is not None) & (distance > (maximum or 0.0)), 0.0, part)


@pytest.mark.parametrize(("minimum", "maximum"), [(None, None), (0.7, None), (None, 1.5), (0.7, 1.5)])
@pytest.mark.parametrize("power", [0.0, 1.0, 2.5])
@pytest.mark.parametrize("shape", ["POINT", "LINE", "PLANE"])
def test_spheres_fall_off_with_the_distance_from_the_shape(device, rng, minimum, maximum, power, shape):
    points = points_around(rng)
    offset = points - ORIGIN
    along = offset @ AXIS
    beside = np.linalg.norm(offset - along[:, None] * AXIS, axis=1)
    distance = {"POINT": np.linalg.norm(offset, axis=1), "LINE": beside, "PLANE": np.abs(along)}[shape]
    one = field(strength=3.0, power=power, minimum=minimum, maximum=maximum, shape=shape)
    airs, _, _, reported = blown(device, [one], points)
    wanted = 3.0 * falloff(distance, minimum, maximum, power)[:, None] * AXIS
    np.testing.assert_allclose(airs, wanted, atol=1e-5)
    assert reported == []


@pytest.mark.parametrize("direction", ["BOTH", "POSITIVE", "NEGATIVE"])
@pytest.mark.parametrize("kind", ["TUBE", "CONE"])
def test_tubes_and_cones_fall_off_along_and_beside_their_axis(device, rng, kind, direction):
    points = points_around(rng)
    offset = points - ORIGIN
    along = offset @ AXIS
    beside = np.linalg.norm(offset - along[:, None] * AXIS, axis=1)
    side, unit = (beside, 1.0) if kind == "TUBE" else (np.degrees(np.arctan2(beside, along)), 180.0 / math.pi)
    one = field(
        falloff=kind,
        direction=direction,
        power=1.5,
        minimum=0.2,
        maximum=1.4,
        radial_power=0.5,
        radial_minimum=0.3,
        radial_maximum=1.2,
    )
    wanted = falloff(np.abs(along), 0.2, 1.4, 1.5) * falloff(side, 0.3 * unit, 1.2 * unit, 0.5)
    wanted[
        (along < 0.0) if direction == "POSITIVE" else (along > 0.0) if direction == "NEGATIVE" else along != along
    ] = 0
    airs, _, _, _ = blown(device, [one], points)
    np.testing.assert_allclose(airs, wanted[:, None] * AXIS, atol=1e-5)


def test_forces_point_away_and_pull_hair_to_their_flow(device, rng):
    points, velocities = points_around(rng), rng.normal(size=(200, 3))
    offset = points - ORIGIN
    distance = np.linalg.norm(offset, axis=1, keepdims=True)
    _, found, _, _ = blown(device, [field("FORCE", strength=-2.0, power=2.0, flow=3.0)], points, velocities)
    part = (1.0 + distance) ** -2.0
    np.testing.assert_allclose(found, part * (-2.0 * offset / distance - 3.0 * velocities), atol=1e-5)
    _, found, _, _ = blown(device, [field("FORCE", strength=5.0, is_gravitation=True)], points)
    np.testing.assert_allclose(found, 5.0 * offset / distance**3, rtol=1e-4)


def test_vortices_turn_about_their_axis(device, rng):
    """A point that moves with a plane vortex has the acceleration of its circle."""
    points = points_around(rng)
    offset = points - ORIGIN
    around = offset - (offset @ AXIS)[:, None] * AXIS
    swirl = np.cross(AXIS, offset)
    _, found, _, _ = blown(device, [field("VORTEX", strength=3.0, shape="PLANE")], points, 3.0 * swirl)
    np.testing.assert_allclose(found, -9.0 * around, atol=1e-4)
    _, found, _, _ = blown(device, [field("VORTEX", strength=3.0)], points)
    unit = swirl / np.linalg.norm(swirl, axis=1, keepdims=True)
    np.testing.assert_allclose(found, 3.0 * np.linalg.norm(offset, axis=1, keepdims=True) * unit, rtol=1e-3, atol=1e-4)


def test_fields_add_up(device, rng):
    points, velocities = points_around(rng), rng.normal(size=(200, 3))
    fields = [
        field(strength=2.0, power=1.0),
        field("TURBULENCE", strength=0.5),
        field("DRAG", strength=2.0, power=1.0),
        field("FORCE", flow=1.0),
        field("DRAG", strength=-9.0, maximum=0.5),
    ]
    whole = blown(device, fields, points, velocities, 0.4)
    parts = [blown(device, [one], points, velocities, 0.4) for one in fields]
    for index in (0, 1):
        np.testing.assert_allclose(whole[index], sum(part[index] for part in parts), atol=1e-5)
    distance = np.linalg.norm(points - ORIGIN, axis=1)
    wanted = 1.0 + 2.0 / (1.0 + distance) - np.where(distance > 0.5, 0.0, 9.0)
    np.testing.assert_allclose(whole[2], np.maximum(wanted, 0.0), atol=1e-5)
    nothing = blown(device, [], points, velocities)
    assert not nothing[0].any() and not nothing[1].any() and (nothing[2] == 1.0).all()


def test_turbulence_is_smooth_noise_without_a_mean(device, rng):
    one = field("TURBULENCE", strength=1.0, size=0.1)
    points = rng.uniform(-2.0, 2.0, (4000, 3))
    airs = blown(device, [one], points, time=3.3)[0]
    assert np.abs(airs).max() < 1.75 and 0.15 < airs.std() < 0.5
    assert np.abs(airs.mean(axis=0)).max() < 0.03
    # By place, by time, by seed and by component.
    assert np.abs(np.corrcoef(airs.T) - np.eye(3)).max() < 0.08
    others = (
        blown(device, [one], points + 1.0, time=3.3)[0],
        blown(device, [one], points, time=7.9)[0],
        blown(device, [field("TURBULENCE", strength=1.0, size=0.1, seed=2)], points, time=3.3)[0],
    )
    for other in others:
        assert abs(np.corrcoef(airs.ravel(), other.ravel())[0, 1]) < 0.05
    np.testing.assert_array_equal(airs, blown(device, [one], points, time=3.3)[0])
    for offset, later in ((1e-4, 0.0), (0.0, 1e-3)):
        near = blown(device, [one], points + offset, time=3.3 + later)[0]
        assert np.abs(near - airs).max() < 0.02


def test_turbulence_moves_with_its_object_unless_it_is_global(device, rng):
    points = rng.normal(size=(100, 3))
    for is_global in (False, True):
        fields = [ForceField("TURBULENCE", origin=(shift, 0.0, 0.0), is_global=is_global) for shift in (0.0, 0.5)]
        here = blown(device, fields[:1], points)[0]
        there = blown(device, fields[1:], points + np.array([0.0 if is_global else 0.5, 0.0, 0.0]))[0]
        np.testing.assert_allclose(here, there, atol=1e-5)


@pytest.mark.parametrize(
    "details",
    [
        {"kind": "MAGNET"},
        {"shape": "SURFACE"},
        {"strength": math.nan},
        {"strength": 1e9},
        {"axis": (0.0, 0.0, 0.0)},
        {"origin": (math.inf, 0.0, 0.0)},
        {"minimum": math.nan},
        {"power": math.inf},
    ],
)
def test_fields_that_cannot_act_are_named_and_left_out(device, details):
    points = np.eye(3)
    airs, _, _, reported = blown(device, [field(), ForceField(**({"kind": "WIND"} | details))], points)
    np.testing.assert_array_equal(airs, blown(device, [field()], points)[0])
    assert len(reported) == 1 and "Force field 2" in str(reported[0])


def test_whatever_is_absurd_stays_finite(device):
    points = np.array([ORIGIN, [1e30, 0, 0], [np.nan, 0, 0], [1e9, -1e9, 1e9]])
    kinds = ("WIND", "TURBULENCE", "FORCE", "VORTEX", "DRAG")
    fields = [field(kind, strength=1e6, power=10.0, minimum=-5.0, size=1e-9, seed=-(2**40)) for kind in kinds]
    fields += [field("FORCE", strength=-1e6, is_gravitation=True), field("VORTEX", strength=1e6, shape="LINE")]
    for found in blown(device, fields, points, 1e30 * np.ones((4, 3)), time=-1e9)[:3]:
        assert np.isfinite(found).all()


def test_arrays_of_other_shapes_are_refused(device):
    air = Air((2, 3, 8), device)
    positions = wp.zeros((2, 9, 8), dtype=float, device=device)
    air.blow([], positions, positions, 0.0)
    for shape in ((1, 9, 8), (2, 6, 8), (2, 9, 4)):
        with pytest.raises(HairError):
            air.blow([], positions, wp.zeros(shape, dtype=float, device=device), 0.0)
