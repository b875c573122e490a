# SPDX-License-Identifier: GPL-3.0-or-later
"""Entries of Warp's cache: a module's compiled kernels beside a digest of them.

Kernels are native code: where a bit of them is another one they may end the process, or compute anything. So an entry
is loaded if its digest is that of its files, and compiled again otherwise, as is one without a digest. A digest
guards against damage alone: who may write the cache is trusted.

A module is compiled into a folder of its own, loaded from there, and then moved to its place, file by file, the digest
last. No process removes what another may be about to load.
"""

import tempfile
from pathlib import Path

import warp as wp

from . import compiled_kernels

_DIGEST = ".sha256"  # beside the compiled file, whose name tells its processor, its GPU and its compiler


def is_whole(device: wp.Device, module: wp.Module) -> bool:
    """Whether the cache has kernels of a module as they were compiled for a device."""
    return _is_whole(*_files(device, module, _place(device, module)))


def load(device: wp.Device, module: wp.Module) -> bool:
    """Load a module's kernels from the cache; whether it had any, whole, that Warp takes."""
    files = _files(device, module, _place(device, module))
    if not _is_whole(*files):
        return False
    try:
        _load(device, module, *files)
    except Exception:  # Warp raises nothing more specific
        module.unload()
        return False
    return True


def compile_anew(device: wp.Device, module: wp.Module) -> None:
    """Compile a module, load it, and put it into the cache if that takes it. Raises whatever Warp does."""
    place = _place(device, module)
    with tempfile.TemporaryDirectory(dir=place.parent, prefix="vellus_", ignore_cleanup_errors=True) as folder:
        made = Path(folder) / place.name
        binary, meta = _files(device, module, made)
        try:
            # `force_load` would compile into the place itself, which another process may be reading.
            module._compile(
                device, made, binary.name, module._get_compile_arch(device), options=_options(device, module)
            )
            _digest_of(binary).write_text(compiled_kernels.digest(binary, meta) or "", encoding="ascii")
            _load(device, module, binary, meta)
        except Exception:
            module.unload()  # it keeps the failure, and would raise it again once the cause is gone
            raise
        _publish(made, place)


def _publish(made, place):
    """Move files to where other processes find them; they stay where they are if they cannot be moved."""
    try:
        if place.is_symlink() or (place.exists() and not place.is_dir()):
            place.unlink()
        place.mkdir(exist_ok=True)
        for path in sorted(made.iterdir(), key=lambda path: path.suffix == _DIGEST):
            path.replace(place / path.name)
    except OSError:
        return  # they are loaded; the next process compiles them again


def _load(device, module, binary, meta):
    module.load(
        device,
        block_dim=_block_dim(device, module),
        binary_path=binary,
        output_arch=module._get_compile_arch(device),
        meta_path=meta,
    )


def _is_whole(binary, meta):
    try:
        written = _digest_of(binary).read_text(encoding="ascii")
    except (OSError, ValueError):
        return False
    return written == compiled_kernels.digest(binary, meta)


def _place(device, module):
    """The folder of a module's compiled kernels, of all devices that have blocks of the same size."""
    return Path(wp.config.kernel_cache_dir) / module.get_module_identifier(_block_dim(device, module))


def _files(device, module, folder):
    """Paths of the compiled file and of its metadata in a module's folder."""
    block_dim = _block_dim(device, module)
    return folder / module._get_compile_output_name(device, block_dim=block_dim), folder / module._get_meta_name(
        block_dim
    )


def _digest_of(binary):
    return binary.with_name(binary.name + _DIGEST)


def _options(device, module):
    module.get_module_hash(_block_dim(device, module))  # which resolves them
    return module.resolved_options[_block_dim(device, module)]


def _block_dim(device, module):
    # One thread is a block on the processor.
    return 1 if device.is_cpu else module.options["block_dim"]
