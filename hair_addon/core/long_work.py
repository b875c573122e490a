# SPDX-License-Identifier: GPL-3.0-or-later
"""Long operations as generators: steps on the caller's thread, and computations that may run on another one.

A generator reads, yields a function of (progress) that computes, receives its result, writes, and returns what it
created. `run_now` runs it at once, and a `Job` runs one computation in a thread. Kernels release the GIL, so the
window is drawn meanwhile.
"""

import threading
from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Any, TypeVar

from .errors import memory_as_sentence

Progress = Callable[[str, float], None]  # told a step and the part of the work that is done
Compute = Callable[[Progress], Any]
T = TypeVar("T")
Work = Generator[Compute, Any, T]


class Stopped(Exception):
    """Raised inside a computation that was cancelled."""


def no_progress(_step: str, _part: float) -> None:
    """Ignore progress. step: the current step, in a word or two; part: completed fraction, in [0, 1]."""


@dataclass(frozen=True)
class Stage:
    """Yielded before a stage that must run on the caller's thread, to report progress and allow cancelling."""

    step: str
    part: float

    def __call__(self, progress: Progress) -> None:
        progress(self.step, self.part)


def part_of(progress: Progress, first: float, last: float) -> Progress:
    """Progress of a stage that makes up the part between `first` and `last` of the whole."""
    return lambda step, part: progress(step, first + (last - first) * part)


def run_now(work: Work[T], progress: Progress = no_progress) -> T:
    """Run such a generator to its end; returns its result. progress: callback for each computation.

    After an error, of a computation or of progress, it is closed: what it had begun is undone by then.
    """
    try:
        with memory_as_sentence():
            compute = next(work)
            while True:
                compute = work.send(compute(progress))
    except StopIteration as end:
        return end.value
    finally:
        work.close()


class Job:
    """A computation in its own thread, with its progress as step and part."""

    def __init__(self, compute: Compute) -> None:
        self.step, self.part = "", 0.0
        self._result: Any = None
        self._error: BaseException | None = None
        self._is_stopped = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(compute,), name="vellus", daemon=True)
        self._thread.start()
        if isinstance(compute, Stage):
            self.wait()

    def _run(self, compute):
        try:
            self._result = compute(self._progress)
        except BaseException as error:  # re-raised by `result`
            self._error = error

    def _progress(self, step, part):
        if self._is_stopped.is_set():
            raise Stopped
        self.step, self.part = step, part

    @property
    def is_done(self) -> bool:
        """Whether `result` returns at once."""
        return not self._thread.is_alive()

    def stop(self) -> None:
        """Ask the computation to end at its next step."""
        self._is_stopped.set()

    @property
    def is_stopping(self) -> bool:
        """Whether it was asked to end."""
        return self._is_stopped.is_set()

    def wait(self) -> None:
        """Return when the computation has ended, however it did."""
        self._thread.join()

    def result(self) -> Any:
        """The result; waits for it. Re-raises exceptions of the computation, `Stopped` if it was stopped."""
        self.wait()
        if self._error is not None:
            with memory_as_sentence():
                raise self._error
        if self.is_stopping:
            raise Stopped
        return self._result
