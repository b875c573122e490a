# SPDX-License-Identifier: GPL-3.0-or-later
"""Console messages about data. Each message is printed once, as drawing would repeat it."""

import sys

import numpy as np

from .caches import Cache

LARGEST = 1e15  # squares of single-precision numbers must stay finite

printed_cache = Cache()  # sentence → True


def say(sentence):
    """Print a message, unless it was printed before."""
    if printed_cache.get(sentence) is None:
        printed_cache.keep(sentence, True)
        print(f"Vellus: {sentence}", file=sys.stderr)


def name_of(owner):
    """Return the name of a datablock; a readable replacement if it is not valid UTF-8, as in a damaged file."""
    try:
        return owner.name
    except UnicodeDecodeError:
        return "(unreadable name)"


def text_of(owner, name):
    """Return a text property of data; empty if it is not valid UTF-8, as in a damaged file."""
    try:
        return getattr(owner, name)
    except UnicodeDecodeError:
        return ""


def can_be_drawn(datablock, *values):
    """Whether values of a datablock are finite and at most `LARGEST`; if not, print that it is skipped."""
    # Written so that NaN fails too: every comparison with it is false.
    if all((np.abs(np.asarray(value, np.float64)) <= LARGEST).all() for value in values):
        return True
    say(f"{name_of(datablock)!r} is skipped: it has infinite or NaN values.")
    return False
