# SPDX-License-Identifier: GPL-3.0-or-later
"""How long the `long` random walks are, by the environment: many processes on a large machine share the seeds.

VELLUS_WALK_SEEDS=1-160 VELLUS_WALK_STEPS=1000 pytest -n 16 -m long tests/crossings/test_any_operation.py
"""

import os


def seeds(first, last):
    """The seeds from VELLUS_WALK_SEEDS, "7" or "1-160" with both ends; by default those from `first` to `last`."""
    low, _, high = os.environ.get("VELLUS_WALK_SEEDS", f"{first}-{last}").partition("-")
    return range(int(low), int(high or low) + 1)


def steps(count):
    """The number of steps that a seed takes at most, from VELLUS_WALK_STEPS; by default `count`."""
    return int(os.environ.get("VELLUS_WALK_STEPS", count))
