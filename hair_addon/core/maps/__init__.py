# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings that vary over a head: values of maps at the roots of strands, combined with the value of a setting."""

from typing import TYPE_CHECKING

from ..lazy import submodules

if TYPE_CHECKING:
    from . import (
        box_filter,
        combination,
        map_settings,
        pixels,
        ramp_text,
        uv_islands,
        varied_settings,
    )
else:
    __getattr__ = submodules(__name__)
