# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of long lists, and of all pairs of two, of which `make test` runs a share and `pytest -m long` the rest."""

from collections.abc import Iterable

import pytest


def share_of(values: Iterable, share: int = 3) -> list:
    """Parameters for `pytest.mark.parametrize`: one value in `share` is not marked `long`."""
    return [pytest.param(value, marks=() if i % share == 0 else pytest.mark.long) for i, value in enumerate(values)]


def pairs(rows: Iterable, columns: Iterable, share: int = 3) -> list:
    """Parameters for `pytest.mark.parametrize` with two names: every pair of a row and a column.

    One in `share` is not marked `long`. These lie on diagonals, so each row meets every `share`-th column, and each
    column every `share`-th row.
    """
    columns = list(columns)
    return [
        pytest.param(row, column, marks=() if (i + j) % share == 0 else pytest.mark.long)
        for i, row in enumerate(rows)
        for j, column in enumerate(columns)
    ]
