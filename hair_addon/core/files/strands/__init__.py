# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of strands of other programs: HAIR, HairSalon, CT2Hair, TressFX, strands in PLY, lines in OBJ."""

from typing import TYPE_CHECKING

from ...lazy import submodules

if TYPE_CHECKING:
    from . import chains, contents, counted_points, hair, obj_lines, ply_strands, ply_table, tressfx, writers
else:
    __getattr__ = submodules(__name__)
