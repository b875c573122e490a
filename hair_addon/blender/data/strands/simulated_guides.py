# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulated points of guides in the shown frame; their Curves stay as they were combed.

Hair follows these points in place of the combed points. They are rest points: the surface deforms them to the simulated
positions.
"""

import numpy as np

from ...host.caches import Cache

# session_uid of guide Curves → (G, POINT_COUNT, 3) float32 in local coordinates. Points are not used if the number of
# guides differs, as after an undo.
point_cache = Cache()


def show(guide_curves, points):
    """Show guides at (G, POINT_COUNT, 3) points, in local coordinates at rest; None: as combed."""
    if points is None:
        point_cache.invalidate(guide_curves.session_uid)
    else:
        point_cache.keep(guide_curves.session_uid, np.ascontiguousarray(points, np.float32))


def is_shown(guide_curves):
    """Whether guides are shown at simulated points."""
    return guide_curves is not None and point_cache.get(guide_curves.session_uid) is not None
