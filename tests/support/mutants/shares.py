# SPDX-License-Identifier: GPL-3.0-or-later
"""Division of a campaign of mutants among processes."""

import argparse
import math


def given(words=None):
    """Parse a campaign's command line: count, seed, only, share, seconds."""
    parser = argparse.ArgumentParser()
    parser.add_argument("count", type=int)
    parser.add_argument("seed", type=int)
    parser.add_argument("--only", default="", help="name of a reader")
    parser.add_argument("--share", type=_share, default=(0, 1), help="K/N: what one of N processes reads, K from 0 on")
    parser.add_argument("--seconds", type=float, default=math.inf, help="after which no more mutants are read")
    return parser.parse_args(words)


def _share(text):
    place, of = map(int, text.split("/"))
    if not 0 <= place < of:
        raise ValueError
    return place, of


def numbers(count, seed, share=(0, 1)):
    """Return the numbers of the mutants of a share."""
    place, of = share
    first = seed * 10**9
    return range(first + count * place // of, first + count * (place + 1) // of)
