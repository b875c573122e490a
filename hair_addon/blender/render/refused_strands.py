# SPDX-License-Identifier: GPL-3.0-or-later
"""A cached marker for strands that cannot be drawn, so that redraws do not try again before they change."""

import sys
from dataclasses import dataclass

from ...core.errors import HairError


@dataclass(frozen=True)
class Refused:
    """Strands that are not drawn, and the reason."""

    error: HairError


def refused(error: HairError) -> Refused:
    """Print why strands are not drawn, and return the marker."""
    print(f"Vellus: {error}", file=sys.stderr)
    return Refused(error)


def error_of(cached: object) -> HairError | None:
    """The error of a value in `hair_cache.strand_cache`, or None."""
    return cached.error if isinstance(cached, Refused) else None
