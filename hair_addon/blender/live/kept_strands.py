# SPDX-License-Identifier: GPL-3.0-or-later
"""Kept hair follows its guides while they are combed or simulated; its Curves are written at once."""

from ...core.errors import HairError
from ..groom import bindings
from ..groom.foreign import kept_following
from . import events


def follow(hair, depsgraph, local=None):
    """Let kept hair follow its guides; returns whether the guides have changed. An error becomes its status.

    local: (N, 3) current points of the guides, if they have been read already.
    """
    try:
        is_other = kept_following.follow(hair, depsgraph, local)
    except HairError as error:
        bindings.kept_cache.invalidate(hair.session_uid)
        hair.vellus.status = str(error)
        hair.vellus.is_stale = False
        return True
    if is_other:
        events.strands_made(hair)
    return is_other
