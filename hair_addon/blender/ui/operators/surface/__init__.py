# SPDX-License-Identifier: GPL-3.0-or-later
"""One file per operator that repairs or prepares a surface for hair."""

from .apply_scale import VELLUS_OT_apply_scale
from .attach_to_surface import VELLUS_OT_attach_to_surface
from .check_uvs import VELLUS_OT_check_uvs
from .flip_normals import VELLUS_OT_flip_normals
from .make_uv_map import VELLUS_OT_make_uv_map
from .use_uv_map import VELLUS_OT_use_uv_map

CLASSES = (
    VELLUS_OT_attach_to_surface,
    VELLUS_OT_make_uv_map,
    VELLUS_OT_use_uv_map,
    VELLUS_OT_check_uvs,
    VELLUS_OT_apply_scale,
    VELLUS_OT_flip_normals,
)
