# SPDX-License-Identifier: GPL-3.0-or-later
"""Loading and launching of Warp kernels, with a cache of compiled kernels that may be damaged, read-only or full.

Matching precompiled kernels of the extension are preferred, then intact entries of the cache (`kernel_entries`). If
Warp's own folder is not writable, a private folder in the system's temporary folder is used. The cache contains native
code: its folder is never taken from a .blend file.
"""

import contextlib
import os
import stat
import tempfile
import threading
from collections import defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import warp as wp

from ..errors import HairError
from . import compiled_kernels, kernel_entries

# Free bytes required before compiling into a folder, several times the size of all kernels: Warp's compiler crashes
# on a full disk.
ROOM = 16 * 2**20

_locks = defaultdict(threading.Lock)  # (module name, device alias) → held while the module is loaded
_choosing = threading.Lock()  # held while a cache folder is chosen
_loaded = set()  # (module name, device alias)


def launch(
    kernel: wp.Kernel,
    dim: int | Sequence[int],
    inputs: Sequence[Any] = (),
    outputs: Sequence[Any] = (),
    device: wp.DeviceLike = None,
    block_dim: int = 256,
) -> None:
    """Load a kernel's module with `load`, and call `wp.launch`. Raises `HairError` like `load`."""
    load(device, kernel.module)
    wp.launch(kernel, dim, inputs=inputs, outputs=outputs, device=device, block_dim=block_dim)


def prepared(
    kernel: wp.Kernel, dim: int | Sequence[int], inputs: Sequence[Any], device: wp.DeviceLike = None
) -> wp.Launch:
    """Return a prepared launch, whose `launch` method takes a few microseconds of Python."""
    load(device, kernel.module)
    return wp.launch(kernel, dim, inputs=inputs, device=device, record_cmd=True)


def load(device: wp.DeviceLike, *modules: wp.Module) -> None:
    """Load Warp modules on a device: takes seconds if they must be compiled, microseconds if they are already loaded.

    Raises `HairError` if they can be neither loaded nor compiled.
    """
    device = wp.get_device(device)
    for module in modules:
        if not is_loaded(device, module):
            with lock_of(device, module):
                load_locked(device, module)


def default_device(name: str) -> wp.Device:
    """Make a device the default of all threads and return it.

    Otherwise, threads that change the default temporarily restore each other's defaults.
    """
    wp.set_device(name)
    return wp.get_device(name)


def is_loaded(device: wp.Device, module: wp.Module) -> bool:
    """Return whether `load` has loaded a module."""
    return (module.name, device.alias) in _loaded


def lock_of(device: wp.Device, module: wp.Module) -> threading.Lock:
    """Return the lock that is held while a module is loaded."""
    return _locks[module.name, device.alias]


def load_locked(device: wp.Device, module: wp.Module, compiling: Callable[[], None] = lambda: None) -> None:
    """Load a module whose lock the caller holds; compiling: called before a compilation."""
    if is_loaded(device, module):
        return
    if not compiled_kernels.load(module, device) and not kernel_entries.load(device, module):
        compiling()
        _compile(device, module)
    _loaded.add((module.name, device.alias))


def _compile(device, module):
    with _choosing:
        _find_room()
    # If the folder has just changed, an earlier process may have compiled the kernels there.
    if kernel_entries.load(device, module):
        return
    try:
        kernel_entries.compile_anew(device, module)
    except Exception as error:  # Warp raises nothing more specific
        raise HairError(
            "Kernels cannot be compiled in {folder} ({cause}): remove that folder, or reinstall Vellus.",
            folder=wp.config.kernel_cache_dir,
            cause=next(iter(str(error).splitlines()), type(error).__name__),
        ) from error


def _find_room():
    """Switch to the temporary folder if kernels cannot be written to the cache folder. Raises `HairError`."""
    if not _has_room(wp.config.kernel_cache_dir):
        _use_temporary_folder()


def _has_room(folder):
    """Return whether `ROOM` bytes can be written to a folder, created if missing; only writing detects quotas."""
    try:
        os.makedirs(folder, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder, buffering=0) as file:
            return file.write(bytes(ROOM)) == ROOM
    except OSError:
        return False


def _use_temporary_folder():
    before = wp.config.kernel_cache_dir
    try:
        folder = str(temporary_folder() / wp.config.version)
    except OSError:  # no temporary folder
        folder = before
    if folder == before or not _has_room(folder):
        raise HairError(
            "Kernels cannot be compiled: neither {folder} nor the temporary folder can be written, or they are full.",
            folder=before,
        )
    wp.config.kernel_cache_dir = folder


def temporary_folder() -> Path:
    """Return a folder that only this user can write: one for all processes, or a new one if that is not private."""
    folder = Path(tempfile.gettempdir()) / f"vellus_kernels_{os.getuid() if hasattr(os, 'getuid') else 'cache'}"
    with contextlib.suppress(FileExistsError):
        folder.mkdir(mode=0o700)
    status = folder.lstat()
    is_own = not hasattr(os, "getuid") or (status.st_uid == os.getuid() and not status.st_mode & 0o077)
    return folder if is_own and stat.S_ISDIR(status.st_mode) else Path(tempfile.mkdtemp(prefix="vellus_kernels_"))


def _initialize():
    """Initialize Warp, which creates its cache folder, with the temporary folder as a fallback."""
    try:
        wp.init()
    except OSError:
        try:
            wp.config.kernel_cache_dir = str(temporary_folder())  # Warp appends its version
            wp.init()
        except OSError as error:
            raise HairError("Kernels cannot be compiled: no folder for them can be written.") from error
    # Warp queries its compiler on first use, which is not thread-safe: a second thread may get empty names, and would
    # compile kernels again under another file name.
    compiled_kernels.compiler()
    compiled_kernels.processor_features()


_initialize()
