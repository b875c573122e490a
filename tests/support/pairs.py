# SPDX-License-Identifier: GPL-3.0-or-later
"""Parameters of tests with long lists or all pairs: `make test` runs a share of them, `make long` the rest."""

from collections.abc import Iterable

import pytest


def share_of(values: Iterable, share: int = 3) -> list:
    """Return parameters for `pytest.mark.parametrize`: one value in `share` is not marked `long`."""
    return [pytest.param(value, marks=() if i % share == 0 else pytest.mark.long) for i, value in enumerate(values)]


def pairs(rows: Iterable, columns: Iterable, share: int = 3) -> list:
    """Return parameters for `pytest.mark.parametrize` with two names: every pair of a row and a column.

    One pair in `share` is not marked `long`. These pairs are on diagonals, so each row is paired with every `share`-th
    column, and each column with every `share`-th row.
    """
    columns = list(columns)
    return [
        pytest.param(row, column, marks=() if (i + j) % share == 0 else pytest.mark.long)
        for i, row in enumerate(rows)
        for j, column in enumerate(columns)
    ]


def share_of_rows(rows: Iterable, share: int = 3) -> list:
    """Return parameters as `share_of`, for several names: one row of values in `share` is not marked `long`."""
    return [pytest.param(*row, marks=() if i % share == 0 else pytest.mark.long) for i, row in enumerate(rows)]
