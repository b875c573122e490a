# SPDX-License-Identifier: GPL-3.0-or-later
"""Modules loaded by several threads are compiled once each, with cancellation and reported failures."""

import threading
import time
from collections import Counter
from itertools import count

import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.kernels import kernel_entries, kernel_setup
from hair_addon.core.long_work import Job, Stopped

SECONDS = 0.02  # time to compile a module [s]

numbers = count()


class Module:
    """A mock of Warp's modules for `kernel_setup`, which is not shipped compiled."""

    def __init__(self):
        self.name = f"tests.module_{next(numbers)}"


@pytest.fixture
def modules():
    return [Module() for _ in range(12)]


@pytest.fixture
def compiled(monkeypatch):
    """Return {name of a module: how often it was compiled}."""
    times = Counter()

    def compile_anew(_device, module):
        time.sleep(SECONDS)
        times.update([module.name])

    monkeypatch.setattr(kernel_entries, "load", lambda _device, _module: False)
    monkeypatch.setattr(kernel_entries, "compile_anew", compile_anew)
    return times


@pytest.fixture
def endless(monkeypatch, compiled):
    """Compile the first module immediately, and the others only when a stop was requested."""
    compile_one = kernel_entries.compile_anew

    def compile_anew(device, module):
        if compiled:
            for loading in kernel_setup._under_way:
                assert loading._is_stopped.wait(20.0)
        compile_one(device, module)

    monkeypatch.setattr(kernel_entries, "compile_anew", compile_anew)


def names_of(modules):
    return {module.name for module in modules}


def test_each_module_is_compiled_once(modules, compiled):
    """The first caller compiles a module, and the others wait for it."""
    seen = []

    def background():
        kernel_setup.load(modules, "cpu", most_threads=1)
        seen.append(dict(compiled))

    thread = threading.Thread(target=background)
    thread.start()
    kernel_setup.load(modules, "cpu")
    seen.append(dict(compiled))
    thread.join()
    once = dict.fromkeys(names_of(modules), 1)
    assert seen == [once, once]
    kernel_setup.load(modules, "cpu")
    assert compiled == once


def test_progress_is_reported(modules, compiled):
    told = []
    kernel_setup.load(modules, "cpu", lambda step, part: told.append((step, part)), most_threads=1)
    parts = [part for _step, part in told]
    assert parts == sorted(parts) and 0.0 <= parts[0] < parts[-1] <= 1.0
    assert kernel_setup.COMPILING in {step for step, _part in told}
    assert sum(compiled.values()) == len(modules)


@pytest.mark.usefixtures("endless")
def test_who_stops_leaves_no_thread(modules, compiled):
    def stop(_step, part):
        if part > 0.0:
            raise Stopped

    before = {*threading.enumerate()}
    with pytest.raises(Stopped):
        kernel_setup.load(modules, "cpu", stop)
    assert before.issuperset(threading.enumerate())
    assert 0 < len(compiled) < len(modules)


def test_a_failure_is_raised_and_tried_again(modules, compiled, monkeypatch):
    def fail(_device, _module):
        raise HairError("no compiler")

    with monkeypatch.context() as context:
        context.setattr(kernel_entries, "compile_anew", fail)
        with pytest.raises(HairError, match="no compiler"):
            kernel_setup.load(modules, "cpu")
    kernel_setup.load(modules, "cpu")
    assert compiled == dict.fromkeys(names_of(modules), 1)


@pytest.mark.usefixtures("endless")
def test_the_end_of_python_stops_it(modules, compiled):
    """The end of Python stops compilation, as the compiler would otherwise work while its library is unloaded."""
    job = Job(lambda progress: kernel_setup.load(modules, "cpu", progress))
    while not kernel_setup._under_way:
        time.sleep(0.001)
    kernel_setup._end_all()
    assert kernel_setup._under_way == set()
    with pytest.raises(Stopped):
        job.result()
    assert len(compiled) < len(modules)
