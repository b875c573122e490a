# SPDX-License-Identifier: GPL-3.0-or-later
"""Damaged files by the thousand, read by every reader of `readers.py`.

    python -m tests.support.mutants.run COUNT SEED [--only NAME of a reader] [--share K/N] [--seconds S]

A seed always gives the same mutants: faults are printed with the number that reproduces them. Share K of N, from 0 on,
is the part of one of N processes that together read all; at its time limit a process prints how many it read.
"""

import contextlib
import math
import random
import signal
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from hair_addon.core.errors import HairError
from tests.support.mutants.changes import mutated
from tests.support.mutants.readers import readers
from tests.support.mutants.shares import given, numbers

PATIENCE = 10.0  # [s] for a reader of a small file
MEMORY = 4 * 2**30  # [bytes] in addition to the memory of the process


class Hangs(BaseException):
    """Raised if a reader takes too long."""


@contextlib.contextmanager
def patience(seconds):
    """Context that raises `Hangs` after some seconds, on systems with alarms."""

    def ring(_number, _frame):
        raise Hangs

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


class Bench:
    """A reader's folder, in which its file is damaged repeatedly."""

    def __init__(self, name, reader, folder):
        self.name, self.reader, self.folder = name, reader, folder
        self.path = folder / reader.path
        for path, data in reader.others.items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_bytes(data)
        self.path.write_bytes(reader.data)
        self.whole = reader.read(self.path)
        reader.check(self.whole, self.whole)

    def fault(self, number):
        """Read a mutant; returns (fault or "", whether it was refused)."""
        self.path.write_bytes(mutated(self.reader.data, random.Random(number), self.reader.is_text))
        try:
            with patience(PATIENCE):
                self.reader.check(self.reader.read(self.path), self.whole)
        except HairError as error:
            is_sentence = str(error).endswith(".") and "\n" not in str(error)
            return ("" if is_sentence else f"no sentence: {error!s:.100}"), True
        except Hangs:
            return f"no end in {PATIENCE} s", False
        except AssertionError as error:
            return f"accepted: {error!s:.200}", False
        except Exception as error:
            return f"{type(error).__name__}: {error!s:.200}", False
        return "", False


def faults(count, seed, only="", share=(0, 1), seconds=math.inf):
    """Read mutants of all readers; returns (number read, {name: number refused}, [faults])."""
    refused, found, read = Counter(), [], 0
    end = time.monotonic() + seconds
    with tempfile.TemporaryDirectory() as folder:
        benches = []
        for place, (name, reader) in enumerate(readers().items()):
            if name == only or not only:
                own = Path(folder) / str(place)
                own.mkdir()
                benches.append(Bench(name, reader, own))
        for number in numbers(count, seed, share):
            if time.monotonic() > end:
                break
            bench = benches[number % 10**9 % len(benches)]
            fault, is_refused = bench.fault(number)
            read += 1
            refused[bench.name] += is_refused
            if fault:
                found.append(f"{bench.name} {number}: {fault}")
    return read, dict(refused), found


def main(words=None):
    """Print each kind of fault once, and the number of refused mutants."""
    import resource

    own = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (own + MEMORY, own + MEMORY))
    read, refused, found = faults(**vars(given(words)))
    kinds = {}
    for line in found:
        kinds.setdefault((line.split()[0], line.partition(": ")[2][:40]), []).append(line)
    for lines in kinds.values():
        print(f"{len(lines)} like {lines[0]}")
    print(f"{read} mutants, refused: {refused}, wrong: {len(found)}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
