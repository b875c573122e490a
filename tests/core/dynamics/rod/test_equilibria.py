# SPDX-License-Identifier: GPL-3.0-or-later
"""Equilibria of strands agree with elastica and Kirchhoff's equations to second order in the number of vertices."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.dynamics.rod_references import heavy_elastica, kirchhoff
from tests.support.dynamics.rods import BENDING, FIBRE, LINE_MASS, TWISTING, Simulation, arc, curl, line

WEIGHT = LINE_MASS * 9.81  # [N/m]
IN_THICK_AIR = replace(FIBRE, air_drag=10.0, damping=0.05)


def largest_error(simulation, reference, length):
    """Return the largest error as a fraction of the length; the strand must be at rest."""
    assert simulation.speed.max() < 1e-3
    assert not simulation.rods.reset_counts().any()
    return np.linalg.norm(simulation.points[0] - reference, axis=1).max() / length


def settled(groom, seconds=6):
    return Simulation(groom, IN_THICK_AIR).advance(24 * seconds)


@pytest.mark.gate(id="V1")
@pytest.mark.parametrize(("length", "gate"), [(0.05, 0.0005), (0.1, 0.002), (0.2, 0.0045)])
def test_a_level_strand_becomes_the_heavy_elastica(length, gate):
    """A level strand becomes the heavy elastica, and drag carries no part of the weight."""
    simulation = settled(line(length, 25))
    assert largest_error(simulation, heavy_elastica(BENDING, WEIGHT, length, 25), length) < gate
    assert abs(simulation.rods.stretch()).max() < 1e-4


def order(errors, counts):
    """Return the order of convergence in the number of segments, between the first and the last."""
    return np.log(errors[0] / errors[-1]) / np.log((counts[-1] - 1) / (counts[0] - 1))


@pytest.mark.gate(id="V1")
def test_the_error_is_of_second_order_in_the_vertices():
    counts = 11, 41
    errors = [largest_error(settled(line(0.1, n)), heavy_elastica(BENDING, WEIGHT, 0.1, n), 0.1) for n in counts]
    assert order(errors, counts) > 1.8


# The moments at the roots of circles clamped level, in EI / L; the test finds that they leave none at the tips.
ARCS = [
    (0.03, 0.25, (-0.19171892, 0.33682638, 0.0), 0.0002),
    (0.03, 0.75, (-3.52390557, 2.37823428, 0.0), 0.001),
    (0.015, 1.5, (-2.23040666, 0.74498298, 0.0), 0.003),
]
LEVEL = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # the third column along x


@pytest.mark.gate(id="V5")
@pytest.mark.parametrize(("radius", "turns", "moment", "gate"), ARCS)
def test_a_level_arc_bends_and_twists_as_kirchhoff_says(radius, turns, moment, gate):
    """A level arc bends and twists as Kirchhoff's equations say, by moments of a rod that is weightless at its tip."""
    length = 2.0 * np.pi * turns * radius
    errors, counts = [], (11, 25, 41)
    for count in counts:
        reference, tip_moment = kirchhoff(
            BENDING,
            TWISTING,
            WEIGHT,
            length,
            LEVEL.T @ [0.0, 0.0, 1.0 / radius],
            LEVEL,
            np.array(moment) * BENDING / length,
            count,
        )
        assert abs(tip_moment).max() < 1e-6 * BENDING / length
        errors.append(largest_error(settled(arc(radius, turns, count), 8), reference, length))
    assert errors[1] < gate
    assert order(errors, counts) > 1.8


@pytest.mark.gate(id="V6")
def test_a_curl_at_rest_stays():
    simulation = Simulation(curl(0.15, 25), gravity=(0.0, 0.0, 0.0)).advance(240)
    assert abs(simulation.points - simulation.groom).max() < 1e-6
