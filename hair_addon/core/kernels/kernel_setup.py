# SPDX-License-Identifier: GPL-3.0-or-later
"""Loading of several Warp modules, compiled on several threads if needed, each module once.

Warp's compiler releases the GIL. Concurrent callers share the work: each caller compiles free modules first, and waits
for the modules of other threads last.
"""

import atexit
import os
import threading
from collections import deque
from collections.abc import Iterable
from typing import TYPE_CHECKING

from .. import kernels
from ..long_work import Progress, Stopped, no_progress

if TYPE_CHECKING:
    import warp as wp

LOADING = "Loading kernels"
COMPILING = "First-time setup (once)"

# Each compiling thread first reads Warp's headers, which takes as long as compiling eight modules.
MOST_THREADS = 4

_PATIENCE = 0.05  # [s] between progress updates

_under_way = set()


def load(
    modules: Iterable["wp.Module"],
    device: "wp.DeviceLike",
    progress: Progress = no_progress,
    most_threads: int = MOST_THREADS,
) -> None:
    """Load Warp modules on a device: takes seconds if they must be compiled, microseconds if they are already loaded.

    progress(step, part): receives the fraction of loaded modules; may raise to cancel, which ends the threads after
    their present modules. Raises `HairError` like `kernel_cache.load`, and `Stopped` if Python exits meanwhile.
    """
    import warp as wp

    device = wp.get_device(device)
    missing = [module for module in modules if not kernels.kernel_cache.is_loaded(device, module)]
    if not missing:
        return
    if not device.is_cpu:  # NVIDIA's compiler needs the context of this thread
        are_compiled = all(kernels.kernel_entries.is_whole(device, module) for module in missing)
        progress(LOADING if are_compiled else COMPILING, 0.0)
        kernels.kernel_cache.load(device, *missing)
        return
    loading = _Loading(missing, device)
    loading.begin(_thread_count(min(most_threads, len(missing))))
    try:
        while loading.is_running(_PATIENCE):
            progress(COMPILING if loading.is_compiling else LOADING, loading.part)
    finally:
        loading.end()
    if loading.errors:
        raise loading.errors[0]
    if loading.part < 1.0:  # Python exits
        raise Stopped


def is_under_way() -> bool:
    """Return whether modules are being loaded."""
    return bool(_under_way)


def processor_count() -> int:
    """Return the number of CPUs available to this process, at least one."""
    if hasattr(os, "process_cpu_count"):  # since Python 3.13
        return os.process_cpu_count() or 1
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _thread_count(most):
    """Return the number of threads to start: one for each CPU, minus threads already loading; at least one."""
    others = sum(loading.thread_count for loading in tuple(_under_way))
    return max(1, min(most, processor_count() - others))


class _Loading:
    """Modules that are loaded by several threads."""

    def __init__(self, modules, device):
        self.errors = []
        self.is_compiling = False
        self._device = device
        self._pending = deque(modules)
        self._count, self._done = len(modules), []
        self._is_stopped = threading.Event()
        self._threads = []

    @property
    def part(self):
        """Fraction of the modules that are loaded."""
        return len(self._done) / self._count

    @property
    def thread_count(self):
        """Number of threads started."""
        return len(self._threads)

    def begin(self, thread_count):
        _under_way.add(self)
        # Daemon threads: Blender would wait for other threads before it runs `_end_all`.
        for _ in range(thread_count):
            thread = threading.Thread(target=self._run, name="vellus", daemon=True)
            thread.start()
            self._threads.append(thread)

    def is_running(self, seconds):
        """Wait for a thread with a timeout [s], and return whether any thread was still running."""
        running = next((thread for thread in self._threads if thread.is_alive()), None)
        if running is not None:
            running.join(seconds)
        return running is not None

    def end(self):
        """Start no further module, and wait for the threads."""
        self._is_stopped.set()
        for thread in self._threads:
            thread.join()
        _under_way.discard(self)

    def _run(self):
        try:
            for module, lock in self._free_ones_first():
                with lock:
                    if self._is_stopped.is_set():  # while waiting for the lock
                        return
                    kernels.kernel_cache.load_locked(self._device, module, self._set_compiling)
                self._done.append(module)
        except Exception as error:  # re-raised in the caller of `load`
            self.errors.append(error)
            self._is_stopped.set()

    def _free_ones_first(self):
        """Yield modules with their locks: first free modules, then modules that other threads are loading."""

        busy = []
        while self._pending and not self._is_stopped.is_set():
            try:
                module = self._pending.popleft()
            except IndexError:  # another thread took the last one
                break
            lock = kernels.kernel_cache.lock_of(self._device, module)
            if lock.locked():
                busy.append((module, lock))
            else:
                yield module, lock
        yield from busy

    def _set_compiling(self):
        self.is_compiling = True


@atexit.register
def _end_all():
    """Stop all threads before Python exits: the compiler must not run when its library is unloaded."""
    for loading in tuple(_under_way):
        loading.end()
