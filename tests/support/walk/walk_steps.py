# SPDX-License-Identifier: GPL-3.0-or-later
"""Decorators for steps of the random walk: each step is printed before it runs."""

import functools
import math

import bpy
from hypothesis import strategies as st
from hypothesis.stateful import rule

MOST_OBJECTS = 14

pick = st.integers(0, 10_000)
odd_numbers = st.sampled_from([math.nan, math.inf, -math.inf, 0.0, -1.0, 1e30, 0.02, 0.3])


def step(**arguments):
    """Return a `rule` that prints its step before running it: after a crash the last lines show the walk.

    It runs within the artist's `law_of`, a context that may compare the states before and after.
    """

    def reported(function):
        @functools.wraps(function)
        def say_and_do(self, **values):
            print(
                f"{function.__name__}({', '.join(f'{name}={value!r}' for name, value in values.items())})", flush=True
            )
            with self.law_of(function.__name__, values):
                function(self, **values)

        return rule(**arguments)(say_and_do)

    return reported


def needs_room(function):
    """Skip a step if there are many objects; not a precondition, as random draws must not depend on Blender."""

    @functools.wraps(function)
    def in_room(self, **values):
        if len(bpy.data.objects) < MOST_OBJECTS:
            function(self, **values)

    return in_room
