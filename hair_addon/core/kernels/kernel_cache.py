# SPDX-License-Identifier: GPL-3.0-or-later
"""Loading and launching of Warp kernels, with a cache of compiled kernels that may be damaged, read-only or full.

Precompiled kernels of the extension are used if they fit, then those of the cache that are whole
(`kernel_entries`). If Warp's own folder is not writable, a folder of the user in the system's temporary folder is
used. The cache holds native code: its folder never comes from a .blend.
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

# Free bytes required in a folder before kernels are compiled into it, several times the size of all: Warp's
# compiler crashes on a full disk.
ROOM = 16 * 2**20

_locks = defaultdict(threading.Lock)  # (module name, device alias) → held while the module is loaded
_choosing = threading.Lock()  # held while another cache folder is chosen
_loaded = set()  # (module name, device alias)


def launch(
    kernel: wp.Kernel,
    dim: int | Sequence[int],
    inputs: Sequence[Any] = (),
    outputs: Sequence[Any] = (),
    device: wp.DeviceLike = None,
    block_dim: int = 256,
) -> None:
    """`wp.launch` of a kernel whose module is loaded by `load`. Raises `HairError` as that does."""
    load(device, kernel.module)
    wp.launch(kernel, dim, inputs=inputs, outputs=outputs, device=device, block_dim=block_dim)


def prepared(
    kernel: wp.Kernel, dim: int | Sequence[int], inputs: Sequence[Any], device: wp.DeviceLike = None
) -> wp.Launch:
    """`launch` with everything done but the launch itself, whose method `launch` takes some microseconds of Python."""
    load(device, kernel.module)
    return wp.launch(kernel, dim, inputs=inputs, device=device, record_cmd=True)


def load(device: wp.DeviceLike, *modules: wp.Module) -> None:
    """Load Warp modules on a device: seconds where they must be compiled, microseconds where they are loaded.

    Raises `HairError` where they can be neither loaded nor compiled.
    """
    device = wp.get_device(device)
    for module in modules:
        if not is_loaded(device, module):
            with lock_of(device, module):
                load_locked(device, module)


def is_loaded(device: wp.Device, module: wp.Module) -> bool:
    """Whether `load` has loaded a module."""
    return (module.name, device.alias) in _loaded


def lock_of(device: wp.Device, module: wp.Module) -> threading.Lock:
    """Return the lock that is held while a module is loaded."""
    return _locks[module.name, device.alias]


def load_locked(device: wp.Device, module: wp.Module, compiling: Callable[[], None] = lambda: None) -> None:
    """`load` of one module whose lock the caller holds; compiling: called before it is compiled, if it must be."""
    if is_loaded(device, module):
        return
    if not compiled_kernels.load(module, device) and not kernel_entries.load(device, module):
        compiling()
        _compile(device, module)
    _loaded.add((module.name, device.alias))


def _compile(device, module):
    with _choosing:
        _find_room()
    # Where the folder has just been left for another one, an earlier process may have compiled them there.
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
    """Leave the cache folder for the temporary one unless kernels can be written there. Raises `HairError`."""
    if not _has_room(wp.config.kernel_cache_dir):
        _use_temporary_folder()


def _has_room(folder):
    """Whether a folder, made if missing, takes `ROOM` bytes. Quotas are known to no other question."""
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
    except OSError:  # there is no temporary folder either
        folder = before
    if folder == before or not _has_room(folder):
        raise HairError(
            "Kernels cannot be compiled: neither {folder} nor the temporary folder can be written, or they are full.",
            folder=before,
        )
    wp.config.kernel_cache_dir = folder


def temporary_folder() -> Path:
    """A folder that only this user can write, the same for each process; a new one if another user created that."""
    folder = Path(tempfile.gettempdir()) / f"vellus_kernels_{os.getuid() if hasattr(os, 'getuid') else 'cache'}"
    with contextlib.suppress(FileExistsError):
        folder.mkdir(mode=0o700)
    status = folder.lstat()
    is_own = not hasattr(os, "getuid") or (status.st_uid == os.getuid() and not status.st_mode & 0o077)
    return folder if is_own and stat.S_ISDIR(status.st_mode) else Path(tempfile.mkdtemp(prefix="vellus_kernels_"))


def _initialize():
    """Initialize Warp, which makes its cache folder and fails where it cannot."""
    try:
        wp.init()
    except OSError:
        try:
            wp.config.kernel_cache_dir = str(temporary_folder())  # to which Warp adds its version
            wp.init()
        except OSError as error:
            raise HairError("Kernels cannot be compiled: no folder for them can be written.") from error
    # Warp asks its compiler once, on first use. Of two threads that ask together one may be given empty names,
    # and compiles kernels again under another file name.
    compiled_kernels.compiler()
    compiled_kernels.processor_features()


_initialize()
