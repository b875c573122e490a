# SPDX-License-Identifier: GPL-3.0-or-later
"""`HairError`, the exception that is shown to the user, and short descriptions of other exceptions."""

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
    """Turn `MemoryError` into `HairError`, in a context or as a decorator."""
    try:
        yield
    except MemoryError as error:
        raise HairError("Not enough memory: use fewer strands or points, or a smaller picture.") from error


def cause_of(error: Exception) -> str:
    """Return a short description of a system error or an operator's error."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    lines = [line for line in str(error).splitlines() if line.strip()] or [type(error).__name__]
    if "Traceback" in lines[0]:
        # For a Python operator, Blender reports the whole traceback, then the error and the location of the call.
        lines = [line for line in lines if not line.startswith("Location: ")][-1:]
    line = lines[0]
    return line.strip().removeprefix("Error: ").rstrip(".")
