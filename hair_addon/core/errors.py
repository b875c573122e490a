# SPDX-License-Identifier: GPL-3.0-or-later
"""The one exception that is meant for the user's eyes, and what other exceptions say."""

import contextlib
from collections.abc import Iterator


class HairError(Exception):
    """An error that the user can fix: one sentence with the problem and the fix.

    Values may be given separately, HairError("{name} has no faces.", name=…), so that the sentence can be translated.
    """

    def __init__(self, sentence: str, **values: object) -> None:
        super().__init__(sentence.format(**values) if values else sentence)
        self.sentence, self.values = sentence, values


@contextlib.contextmanager
def memory_as_sentence() -> Iterator[None]:
    """Raise a `HairError` where memory is used up in a context, or in a function that this decorates."""
    try:
        yield
    except MemoryError as error:
        raise HairError("Not enough memory: use fewer strands or points, or a smaller picture.") from error


def cause_of(error: Exception) -> str:
    """Return a short description of an error of the system or of an operator."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    lines = [line for line in str(error).splitlines() if line.strip()] or [type(error).__name__]
    if "Traceback" in lines[0]:
        # For an operator in Python, Blender passes on the whole traceback, then the error and where it was called.
        lines = [line for line in lines if not line.startswith("Location: ")][-1:]
    line = lines[0]
    return line.strip().removeprefix("Error: ").rstrip(".")
