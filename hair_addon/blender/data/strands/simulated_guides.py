# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides where dynamics has moved them in the frame that is shown; their Curves stay as they were combed.

Hair follows these points in place of the combed ones. They are at rest: where guides would have to be combed to, so
that their surface carries them to where they were simulated.
"""

import numpy as np

from ...host.caches import Cache

# session_uid of guide Curves → (G, POINT_COUNT, 3) float32 in local coordinates. Those of another number of guides than
# there are, as after an undo, are not used.
point_cache = Cache()


def show(guide_curves, points):
    """Show guides at (G, POINT_COUNT, 3) points, local coordinates at rest; None: as they are combed."""
    if points is None:
        point_cache.invalidate(guide_curves.session_uid)
    else:
        point_cache.keep(guide_curves.session_uid, np.ascontiguousarray(points, np.float32))


def is_shown(guide_curves):
    """Whether guides are shown where dynamics has moved them."""
    return guide_curves is not None and point_cache.get(guide_curves.session_uid) is not None
