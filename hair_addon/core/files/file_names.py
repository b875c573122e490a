# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of things as names of files: of different things different ones."""

import itertools
import re
from collections.abc import Callable

# Windows forbids more than other systems do.
_FORBIDDEN = re.compile(r'[<>:"/\\|?*\x00-\x1f\x7f]')


def stem_of(name: str) -> str:
    """Return a name without what file systems forbid; letters of any language and spaces stay. It may be empty."""
    return _FORBIDDEN.sub("_", name).strip(" .")


def free_stem(name: str, is_taken: Callable[[str], bool]) -> str:
    """Return `stem_of` a name, with a number as Blender's where it is taken.

    is_taken: whether a file of a stem belongs to another thing. Systems may take capitals for small letters.
    """
    stem = stem_of(name)
    numbered = (f"{stem}.{number:03}" for number in itertools.count(1))
    return next(one for one in itertools.chain([stem], numbered) if not is_taken(one))
