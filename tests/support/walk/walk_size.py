# SPDX-License-Identifier: GPL-3.0-or-later
"""Size of the `long` random walks, set by environment variables: on a large machine processes share the seeds.

VELLUS_WALK_SEEDS=1-160 VELLUS_WALK_STEPS=1000 pytest -n 16 -m long tests/crossings/test_any_operation.py
"""

import os


def seeds(first, last):
    """Return the seeds of VELLUS_WALK_SEEDS, "7" or "1-160" inclusive; by default those from `first` to `last`."""
    low, _, high = os.environ.get("VELLUS_WALK_SEEDS", f"{first}-{last}").partition("-")
    return range(int(low), int(high or low) + 1)


def steps(count):
    """Return the maximum number of steps per seed, from VELLUS_WALK_STEPS; by default `count`."""
    return int(os.environ.get("VELLUS_WALK_STEPS", count))
