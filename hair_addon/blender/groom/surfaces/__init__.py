# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair on edited, transformed and exchanged surfaces."""

from typing import TYPE_CHECKING

from ....core.lazy import submodules

if TYPE_CHECKING:
    from . import applied_transforms, attached_hair, edited_faces, edited_surfaces, kept_densities, posed_shapes
else:
    __getattr__ = submodules(__name__)
