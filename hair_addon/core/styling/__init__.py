# SPDX-License-Identifier: GPL-3.0-or-later
"""Styles: trim, clump, curl, frizz and others, applied in order to interpolated strands."""

from typing import TYPE_CHECKING

from ..lazy import submodules

if TYPE_CHECKING:
    from . import (
        base,
        clump_trees,
        courses,
        fitting,
        guide_lean,
        guide_styles,
        kinds,
        masks,
        program,
        random_numbers,
        stack,
        steps,
        strand_wetness,
        style_text,
        varied_numbers,
    )
else:
    __getattr__ = submodules(__name__)
