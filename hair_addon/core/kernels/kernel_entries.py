# SPDX-License-Identifier: GPL-3.0-or-later
"""Entries of Warp's cache: a module's compiled kernels with a digest.

Kernels are native code: a damaged file may crash the process or compute wrong results. An entry is therefore loaded
only if its digest matches its files; otherwise, and without a digest, it is compiled again. The digest guards against
damage only: users with write access to the cache are trusted.

A module is compiled into a temporary folder, loaded from there, and then moved to its place, file by file, the digest
last. No process removes files that another one may be about to load.
"""

import tempfile
from pathlib import Path

import warp as wp

from . import compiled_kernels

_DIGEST = ".sha256"  # appended to the compiled file's name, which includes processor or GPU, and compiler


def is_whole(device: wp.Device, module: wp.Module) -> bool:
    """Return whether the cache has intact kernels of a module for a device."""
    return _is_whole(*_files(device, module, _place(device, module)))


def load(device: wp.Device, module: wp.Module) -> bool:
    """Load a module's kernels from the cache, and return whether they were intact and Warp accepted them."""
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
    """Compile a module, load it, and move it to the cache if possible. Raises Warp's exceptions."""
    place = _place(device, module)
    with tempfile.TemporaryDirectory(dir=place.parent, prefix="vellus_", ignore_cleanup_errors=True) as folder:
        temporary = Path(folder) / place.name
        binary, meta = _files(device, module, temporary)
        try:
            # `force_load` would compile into the final place, which another process may be reading.
            module._compile(
                device, temporary, binary.name, module._get_compile_arch(device), options=_options(device, module)
            )
            _digest_of(binary).write_text(compiled_kernels.digest(binary, meta) or "", encoding="ascii")
            _load(device, module, binary, meta)
        except Exception:
            module.unload()  # otherwise the module would raise the same error again after the cause is gone
            raise
        _publish(temporary, place)


def _publish(temporary, place):
    """Move files to their place in the cache, if possible."""
    try:
        if place.is_symlink() or (place.exists() and not place.is_dir()):
            place.unlink()
        place.mkdir(exist_ok=True)
        for path in sorted(temporary.iterdir(), key=lambda path: path.suffix == _DIGEST):
            path.replace(place / path.name)
    except OSError:
        return  # the kernels are loaded; the next process compiles them again


def _load(device, module, binary, meta):
    module.load(
        device,
        block_dim=compiled_kernels.block_dim_of(module, device),
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
    """Return the folder of a module's compiled kernels, shared by devices with the same block size."""
    return Path(wp.config.kernel_cache_dir) / module.get_module_identifier(
        compiled_kernels.block_dim_of(module, device)
    )


def _files(device, module, folder):
    """Return the paths of the compiled file and of its metadata in a module's folder."""
    block_dim = compiled_kernels.block_dim_of(module, device)
    return folder / module._get_compile_output_name(device, block_dim=block_dim), folder / module._get_meta_name(
        block_dim
    )


def _digest_of(binary):
    return binary.with_name(binary.name + _DIGEST)


def _options(device, module):
    module.get_module_hash(compiled_kernels.block_dim_of(module, device))  # resolves the options
    return module.resolved_options[compiled_kernels.block_dim_of(module, device)]
