# SPDX-License-Identifier: GPL-3.0-or-later
"""Damaged files by the thousand, read by every reader of `readers.py`.

    python -m tests.support.mutants.run COUNT SEED [--only NAME of a reader] [--share K/N] [--seconds S]

A mutant of a seed is the same each time: what goes wrong is printed with the number that makes it again. Share K of N,
from 0 on, is that of one of N processes, which together read all; one whose seconds are over says how many it read.
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
MEMORY = 4 * 2**30  # [bytes] beside what the process has


class Hangs(BaseException):
    """A reader did not come to an end."""


@contextlib.contextmanager
def patience(seconds):
    """Raise `Hangs` after a while, where the system has alarms."""

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
    """A reader's folder, in which its file is damaged again and again."""

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
        """What is wrong with how a mutant is read; "" where nothing is, and whether it was refused."""
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
    """(how many were read, {name: how many were refused}, [what went wrong]) of mutants, each reader's in turn."""
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
    """Print what goes wrong, each kind once, and how many mutants were refused."""
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
