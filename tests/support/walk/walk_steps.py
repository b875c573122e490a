# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps of a random walk: how each is said before it is taken, and what it is given."""

import functools
import math

import bpy
from hypothesis import strategies as st
from hypothesis.stateful import rule

MOST_OBJECTS = 14

pick = st.integers(0, 10_000)
odd_numbers = st.sampled_from([math.nan, math.inf, -math.inf, 0.0, -1.0, 1e30, 0.02, 0.3])


def step(**arguments):
    """A `rule` that is said before it is taken: after a crash the last lines tell the way.

    It is taken within the `law_of` the artist, a context that may compare before and after.
    """

    def said(function):
        @functools.wraps(function)
        def say_and_do(self, **values):
            print(
                f"{function.__name__}({', '.join(f'{name}={value!r}' for name, value in values.items())})", flush=True
            )
            with self.law_of(function.__name__, values):
                function(self, **values)

        return rule(**arguments)(say_and_do)

    return said


def needs_room(function):
    """A step left out once there are many objects. No precondition: what is drawn must not follow from Blender."""

    @functools.wraps(function)
    def in_room(self, **values):
        if len(bpy.data.objects) < MOST_OBJECTS:
            function(self, **values)

    return in_room
