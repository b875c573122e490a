# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands for many values of one setting of a style, and their displacement between values."""

from dataclasses import replace

import warp as wp

from hair_addon.core.grooming import following
from hair_addon.core.styling import lean, wet
from hair_addon.core.styling import program as programs
from tests.support.dynamics.stepped import largest_move


class Slid:
    """Hair in a `Groom` with a style, one setting of which varies; `at(value)` returns points (S, P, 3).

    Results that do not depend on the setting are computed once, so many values take little time.
    """

    def __init__(self, hair, settings, name):
        """settings: with the style in effect; name: of a setting that is not structural."""
        self._hair, self._settings, self._name = hair, settings, name
        self._styling = hair.bound(settings)
        self._plain = {}

    def at(self, value):
        settings = replace(self._settings, **{self._name: float(value)})
        if isinstance(settings, lean.Settings | wet.Settings):  # they move guides
            return self._hair.styled(settings)
        made = programs.strand_steps((settings,), {})
        levels = self._styling.levels
        first_centres = [level.first for level in levels]
        first_centres.append(sum(len(level.binding.roots) for level in levels))
        program = programs.compiled(made, [], first_centres)
        of_levels = [replace(level, steps=program.before(row)) for row, level in enumerate(levels)]
        points = self._plain_strands(self._hair.binding)
        centres = [(self._plain_strands(level.binding), None) for level in levels]
        replace(self._styling, program=program, levels=of_levels).apply(points, centres)
        return points.numpy()

    def _plain_strands(self, binding):
        """Return a copy of the strands of a binding without styles."""
        if id(binding) not in self._plain:
            self._plain[id(binding)] = following.follow_guides(binding, self._hair.guides).points
        return wp.clone(self._plain[id(binding)])


def steepest_moves(points_at, values, chosen=4):
    """Yield the largest displacements [m] between values, then of repeatedly halved steps, the steepest ones.

    points_at(value): strands; values: rising; chosen: number of steps that are halved each time.
    """
    made = [points_at(value) for value in values]
    steps = [
        (largest_move(before, after), low, high, before, after)
        for low, high, before, after in zip(values[:-1], values[1:], made[:-1], made[1:], strict=True)
    ]
    while True:
        steps = sorted(steps, key=lambda step: -step[0])[:chosen]
        yield steps[0][0]
        halves = []
        for _move, low, high, before, after in steps:
            middle = 0.5 * (low + high)
            between = points_at(middle)
            halves.append((largest_move(before, between), low, middle, before, between))
            halves.append((largest_move(between, after), middle, high, between, after))
        steps = halves
