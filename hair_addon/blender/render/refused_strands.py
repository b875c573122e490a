# SPDX-License-Identifier: GPL-3.0-or-later
"""What is kept in place of strands that cannot be drawn, so that no redraw tries again before they change."""

import sys
from dataclasses import dataclass

from ...core.errors import HairError


@dataclass(frozen=True)
class Refused:
    """Strands that are not drawn, and why."""

    error: HairError


def refused(error: HairError) -> Refused:
    """Say once why strands are not drawn."""
    print(f"Vellus: {error}", file=sys.stderr)
    return Refused(error)


def error_of(kept: object) -> HairError | None:
    """Why what `hair_cache.strand_cache` keeps is not drawn; None where it is."""
    return kept.error if isinstance(kept, Refused) else None
