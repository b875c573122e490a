# SPDX-License-Identifier: GPL-3.0-or-later
"""Unique file names for named items."""

import itertools
import re
from collections.abc import Callable

# Windows forbids more characters than other systems do.
_FORBIDDEN = re.compile(r'[<>:"/\\|?*\x00-\x1f\x7f]')


def stem_of(name: str) -> str:
    """Return a name without characters that file systems forbid; it may be empty."""
    return _FORBIDDEN.sub("_", name).strip(" .")


def free_stem(name: str, is_taken: Callable[[str], bool]) -> str:
    """Return `stem_of` a name, with a number in Blender's format if it is taken.

    is_taken: returns whether a stem belongs to another item; it must ignore case, as some file systems do.
    """
    stem = stem_of(name)
    numbered = (f"{stem}.{number:03}" for number in itertools.count(1))
    return next(one for one in itertools.chain([stem], numbered) if not is_taken(one))
