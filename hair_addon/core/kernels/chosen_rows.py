# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels that run on all rows of arrays, or on chosen rows only.

The first parameter of such a kernel is an array of the chosen rows, which is empty for all rows.
"""

from collections.abc import Callable
from typing import Any

import warp as wp

from . import parallel
from .checks import require_count
from .parallel import Rows


@wp.func
def chosen_at(chosen: wp.array[int], row: int):
    """Return the chosen row with an index; the index itself if none are chosen."""
    if chosen.shape[0] == 0:
        return row
    return chosen[row]


def arguments(chosen: wp.array | None, device: wp.DeviceLike) -> tuple[Any, Callable[[wp.array], Any]]:
    """Return the first argument of a launch, and a function that makes other arguments from arrays with all rows."""
    if chosen is None:
        return wp.empty(0, dtype=int, device=device), Rows
    return Rows(chosen), lambda array: array


def launch(kernel: wp.Kernel, inputs: list[wp.array], outputs: list[wp.array], chosen: wp.array | None) -> None:
    """Run a kernel on all rows of arrays, or on chosen (M,) int32 rows, which must exist.

    Raises `HairError` if an array has a different number of rows.
    """
    row_count, device = len(inputs[0]), inputs[0].device
    for array in (*inputs, *outputs):
        require_count("rows", len(array), row_count)
    rows, of_all = arguments(chosen, device)
    arrays = [rows, *map(of_all, (*inputs, *outputs))]
    parallel.launch(kernel, row_count if chosen is None else len(chosen), arrays, [], device)
