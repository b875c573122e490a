# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels: compilation, caching, and launches on CPU or GPU with checked counts and indices."""

from typing import TYPE_CHECKING

from ..lazy import submodules

if TYPE_CHECKING:
    from . import (
        checks,
        compiled_kernels,
        foreign_memory,
        glsl_text,
        kernel_cache,
        kernel_entries,
        kernel_setup,
        native_code,
        parallel,
        replays,
        running_sums,
    )
else:
    __getattr__ = submodules(__name__)
