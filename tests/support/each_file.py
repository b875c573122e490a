# SPDX-License-Identifier: GPL-3.0-or-later
"""A rule that holds for every file: one test, which names all files that break it."""

import functools
from collections.abc import Callable, Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def each_file(paths: Iterable[Path]) -> Callable:
    """Turn a function that checks one `path` into a single test of all files, as one test per file would be
    thousands.
    """
    paths = list(paths)

    def test_of(rule):
        @functools.wraps(rule)
        def test():
            broken = []
            for path in paths:
                try:
                    rule(path)
                except AssertionError as error:
                    broken.append(f"{path.relative_to(ROOT).as_posix()}: {error}")
            assert paths and not broken, "\n".join(broken)

        del test.__wrapped__  # pytest would take its argument for a fixture
        return test

    return test_of
