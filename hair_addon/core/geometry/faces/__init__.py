# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces of meshes: polygons and cages, connected components, orientation, UV maps."""

from typing import TYPE_CHECKING

from ...lazy import submodules

if TYPE_CHECKING:
    from . import cages, connected_components, face_atlas, face_places, flipped_faces, orientation, uv_maps
else:
    __getattr__ = submodules(__name__)
