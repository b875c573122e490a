# SPDX-License-Identifier: GPL-3.0-or-later
"""Sag-free rest shapes keep a groom unchanged under gravity."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon.core.dynamics.rod.material import material_of
from hair_addon.core.dynamics.rod.rods import combed_shape
from hair_addon.core.dynamics.rod.sag_free import least_stiffnesses, sag_free
from hair_addon.core.dynamics.rod.settings import DynamicsSettings
from tests.support.dynamics.rods import FRAME, GRAVITY, Simulation, curl, line

NATURAL = DynamicsSettings()


def shapes(length, vertex_count=25):
    """Return a level line, an arc that rises, a curl and an upright strand."""
    angle = np.linspace(0.0, 1.5, vertex_count)
    rising = length / 1.5 * np.stack([np.sin(angle), 0.0 * angle, 1.0 - np.cos(angle)], axis=-1)[None]
    upright = line(length, vertex_count, (0.05, 0.0, 1.0))
    return np.concatenate([line(length, vertex_count), rising, curl(length, vertex_count), upright])


def held(groom, settings=NATURAL, substeps=4):
    material = material_of(settings, combed_shape(groom).lengths)
    found = sag_free(groom, material, GRAVITY)
    assert not found.clipped.any()
    return Simulation(groom, settings, substeps, rest=found.rest)


def drift(simulation):
    return np.linalg.norm(simulation.points - simulation.groom, axis=2).max()


@pytest.mark.gate(id="V17")
@pytest.mark.parametrize(
    ("length", "vertex_count", "substeps"), [(0.05, 25, 4), (0.1, 25, 4), (0.18, 25, 1), (0.18, 41, 4)]
)
def test_the_groom_stays_as_it_was_combed(length, vertex_count, substeps):
    """For Γ ≤ 7 the groom stays in place for five seconds, to a hundredth of a millimeter."""
    groom = shapes(length, vertex_count)
    simulation = held(groom, substeps=substeps)
    most = 0.0
    for _ in range(120):
        most = max(most, drift(simulation.advance()))
    assert most < 1e-5
    assert drift(Simulation(groom, NATURAL).advance(120)) > 1e-3  # others sag


def test_a_cartoon_does_not_stretch_under_its_weight():
    groom = shapes(0.1)
    soft = replace(NATURAL, stretch_stiffness=1e-5, bend_stiffness=2.0)
    assert drift(held(groom, soft).advance(48)) < 1e-5
    assert drift(Simulation(groom, soft).advance(48)) > 1e-3


def test_the_soft_tip_and_the_wet_strand_are_held_too():
    settings = replace(NATURAL, tip_stiffness=0.3, wetness=1.0)
    assert drift(held(shapes(0.08), settings).advance(120)) < 1e-5


def test_joints_that_would_turn_too_far_are_clipped_and_counted():
    groom = np.concatenate([line(0.3, 25), line(0.3, 25, (0.0, 0.0, -1.0))])
    material = material_of(replace(NATURAL, bend_stiffness=1e-2), combed_shape(groom).lengths)
    assert list(sag_free(groom, material, GRAVITY).clipped > 0) == [True, False]


@pytest.mark.parametrize("length", [0.1, 0.2])
def test_an_upright_strand_stands_from_greenhills_stiffness_on(length):
    """A pushed upright strand stays near its groom at 1.1 times Greenhill's least stiffness, and falls at 0.9 times."""
    groom = line(length, 25, (0.0, 0.0, 1.0))
    unit = material_of(replace(NATURAL, bend_stiffness=1.0), combed_shape(groom).lengths)
    (least,) = least_stiffnesses(groom, unit, GRAVITY)
    ends = []
    for factor in (0.9, 1.1):
        simulation = held(groom, replace(NATURAL, bend_stiffness=factor * least))
        pushed = np.zeros_like(groom)
        pushed[..., 0] = 0.002 * groom[..., 2] / length / FRAME
        simulation.advance()
        ends.append(drift(simulation.place(simulation.points, pushed).advance(24 * 6)) / length)
    assert ends[0] > 0.1
    assert ends[1] < 0.01


def test_hanging_strands_need_no_stiffness():
    groom = line(0.2, 25, (0.1, 0.0, -1.0))
    material = material_of(NATURAL, combed_shape(groom).lengths)
    assert least_stiffnesses(groom, material, GRAVITY) == 0.0
    assert least_stiffnesses(line(0.2, 25), material, (0.0, 0.0, 0.0)) == 0.0
