# SPDX-License-Identifier: GPL-3.0-or-later
"""Plots of the solver beside reference solutions: elastica, Kirchhoff's rods, a chain's damping, a capstan.

Strands, settings and references are those of the tests in tests/core/dynamics.
"""

import numpy as np
from scipy.special import j0

from blend_samples.sheets import line_plot
from blend_samples.sheets.line_plot import COLORS, REFERENCE, Plot
from tests.core.dynamics.collision import test_contact
from tests.core.dynamics.rod import test_equilibria, test_motion
from tests.support.dynamics.rod_references import heavy_elastica, kirchhoff
from tests.support.dynamics.rods import BENDING, TWISTING, Simulation, arc, line

LENGTHS = (0.05, 0.1, 0.15, 0.2)  # [m]
VERTEX_COUNTS = (7, 13, 25)
CHAIN = 0.2  # [m]
CHAIN_SUBSTEPS = (1, 2, 8)


def draw(out):
    """Write elastica.png, kirchhoff.png, chain.png and capstan.png to a folder."""
    line_plot.write(elastica(), out / "elastica.png")
    line_plot.write([arcs()], out / "kirchhoff.png")
    line_plot.write([chain()], out / "chain.png")
    line_plot.write([capstan()], out / "capstan.png")


def elastica():
    """Level strands under their weight, in parts of their length: lines of the elastica, dots of the solver."""
    plots = []
    for count in VERTEX_COUNTS:
        ticks = ((0, 0.5, 1), (-1, -0.5, 0))
        plot = Plot(f"{count} points", (-0.03, 1.05), (-1.02, 0.06), ticks, "x / L", legend=(0.5, 0.74))
        for length, color in zip(LENGTHS, COLORS, strict=True):
            plot.line(heavy_elastica(BENDING, test_equilibria.WEIGHT, length, 200)[:, ::2] / length, REFERENCE)
            found = test_equilibria.settled(line(length, count)).points[0]
            reference = heavy_elastica(BENDING, test_equilibria.WEIGHT, length, count)
            error = np.linalg.norm(found - reference, axis=1).max() / length
            plot.dots(found[:, ::2] / length, color)
            plot.name(color, f"{100 * length:.0f} cm: {error:.2%}")
            print(f"elastica, {count} points, {100 * length:.0f} cm: {error:.3%} of the length", flush=True)
        plots.append(plot)
    return plots


def arcs():
    """Level circles that bend and twist under their weight, seen from above at a slant."""
    title = "Level circles, and under their weight: Kirchhoff's rods, 25 points"
    plot = Plot(title, (-0.06, 0.05), (-0.075, 0.035), size=(640, 640), legend=(0.5, 0.86))
    view = np.array([[0.86, -0.5, 0.0], [0.25, 0.43, 0.87]]).T
    for (radius, turns, moment, _gate), color in zip(test_equilibria.ARCS, COLORS, strict=False):
        length = 2.0 * np.pi * turns * radius
        curvature = test_equilibria.LEVEL.T @ [0.0, 0.0, 1.0 / radius]
        material = BENDING, TWISTING, test_equilibria.WEIGHT
        clamp = test_equilibria.LEVEL, np.array(moment) * BENDING / length
        lines = {count: kirchhoff(*material, length, curvature, *clamp, count)[0] for count in (25, 200)}
        found = test_equilibria.settled(arc(radius, turns, 25), 8).points[0]
        error = np.linalg.norm(found - lines[25], axis=1).max() / length
        plot.line(arc(radius, turns, 200)[0] @ view, (70, 70, 70))
        plot.line(lines[200] @ view, REFERENCE)
        plot.dots(found @ view, color)
        plot.name(color, f"{turns:g} turns: {error:.3%} of the length")
        print(f"kirchhoff, {turns:g} turns: {error:.3%} of the length", flush=True)
    return plot


def chain():
    """Return the tip of a chain in its first mode, and implicit Euler's own damping exp(-ω² h t / 2) of it."""
    groom = line(CHAIN, 25, (0.0, 0.0, -1.0))
    swung = groom.copy()
    swung[..., 0] = 0.02 * CHAIN * j0(2.404826 * np.sqrt(1.0 + groom[..., 2] / CHAIN))
    rate = 1.202413 * np.sqrt(9.81 / CHAIN)
    title = "The tip of a swinging chain of 20 cm, between exp(-ω² h t / 2)"
    ticks = ((0, 1, 2, 3, 4), (-1, 0, 1))
    plot = Plot(title, (0.0, 4.0), (-1.1, 1.1), ticks, "seconds", (720, 320), (0.78, 0.05))
    for substeps, color in zip(CHAIN_SUBSTEPS, COLORS, strict=False):
        simulation = Simulation(groom, test_motion.LIMP, substeps).place(swung)
        size = simulation.step.size
        tip = simulation.substeps(int(4.0 / size))[:, 0, -1, 0] / swung[0, -1, 0]
        times = size * np.arange(1, len(tip) + 1)
        envelope = np.exp(-(rate**2) * size * times / 2.0)
        for side in (1.0, -1.0):
            plot.line(np.stack([times, side * envelope], axis=-1), tuple(c // 2 for c in color), 1.0)
        plot.line(np.stack([times, tip], axis=-1), color)
        plot.name(color, f"{substeps} substep{'s' * (substeps > 1)}")
        last = times > 4.0 - np.pi / rate
        at = abs(tip[last]).argmax()
        fallen, expected = abs(tip[last][at]), envelope[last][at]
        print(f"chain, {substeps} substeps: {fallen:.3f} of the amplitude after 4 s, for {expected:.3f}", flush=True)
    return plot


def capstan():
    """Tension around a quarter of a cylinder, by that without friction: e^(μ φ)."""
    title = "Tension over a quarter of a cylinder"
    plot = Plot(title, (0.0, 0.7), (0.8, 3.2), ((0, 0.3, 0.6), (1, 2, 3)), "friction", legend=(0.06, 0.06))
    friction = np.linspace(0.0, 0.7, 100)
    plot.line(np.stack([friction, np.exp(friction * np.pi / 2.0)], axis=-1), REFERENCE)
    plot.name(REFERENCE, "capstan equation")
    for substeps, color in ((8, COLORS[0]), (32, COLORS[1])):
        ratios = test_contact.tension_ratios(substeps)
        plot.dots(np.stack([test_contact.FRICTIONS, np.append(1.0, ratios)], axis=-1), color)
        plot.name(color, f"{substeps} substeps")
        print(f"capstan, {substeps} substeps: {np.round(ratios, 3)}", flush=True)
    return plot
