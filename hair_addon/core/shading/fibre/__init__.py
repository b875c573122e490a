# SPDX-License-Identifier: GPL-3.0-or-later
"""Light scattering by one fiber: the reference formulas of the shaders."""

from typing import TYPE_CHECKING

from ...lazy import submodules

if TYPE_CHECKING:
    from . import (
        angles,
        azimuthal,
        elliptic_section,
        energy_conserving,
        fresnel,
        kajiya_kay,
        longitudinal,
        marschner,
        paths,
        pigment,
        principled,
        scattering_kernel,
        strand_variation,
    )
else:
    __getattr__ = submodules(__name__)
