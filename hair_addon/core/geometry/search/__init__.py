# SPDX-License-Identifier: GPL-3.0-or-later
"""Search and order: sorting, nearest neighbors, clusters, trees of triangles."""

from typing import TYPE_CHECKING

from ...lazy import submodules

if TYPE_CHECKING:
    from . import clusters, counting_sort, hash_grid, triangle_tree
else:
    __getattr__ = submodules(__name__)
