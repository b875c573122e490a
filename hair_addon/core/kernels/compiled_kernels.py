# SPDX-License-Identifier: GPL-3.0-or-later
"""Precompiled kernels of the extension; if none match, Warp compiles them on first use.

`tools/compile_kernels.py` writes the folder: an index, and an object file for each Warp module and processor type. A
module is loaded only if the versions of Warp and its compiler match, the processor supports all features that the file
was compiled for, and Warp's hash of the module's sources and options matches. The folder is only read.
"""

import hashlib
import json
import os
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import warp as wp

VARIABLE = "VELLUS_KERNELS"  # environment variable with another folder, such as a checkout's build folder
FOLDER = Path(os.environ.get(VARIABLE) or Path(__file__).resolve().parents[3] / "kernels")
INDEX = "index.json"

_PACKAGE = __name__.removesuffix("core.kernels.compiled_kernels")  # prefix of Warp's names of our modules


def load(module: "wp.Module", device: "wp.Device") -> bool:
    """Load a Warp module's precompiled kernels on the CPU, and return whether matching kernels were found."""
    if not device.is_cpu:
        return False
    processor, modules = _fitting(FOLDER)
    module_hash, digests = modules.get(short_name(module), ("", {}))
    if not digests or module_hash != module.get_module_hash(1).hex():
        return False
    binary, meta = (FOLDER / path for path in file_names(short_name(module), processor))
    if digests.get(processor, "") != digest(binary, meta):
        return False
    # On the CPU a block has one thread.
    module.load(device, block_dim=1, binary_path=binary, meta_path=meta)
    return True


def short_name(module: "wp.Module") -> str:
    """Return the name of a Warp module relative to the add-on, such as core.geometry.curves.bspline."""
    return module.name.removeprefix(_PACKAGE)


def file_names(module_name: str, processor: str) -> tuple[str, str]:
    """Return the relative paths of a module's object file and metadata."""
    return f"{processor}/{module_name}.o", f"{module_name}.meta"


def digest(binary: Path, meta: Path) -> str | None:
    """Return the SHA-256 of a module's two files in hexadecimal digits, None if a file is missing."""
    try:
        return hashlib.sha256(binary.read_bytes() + meta.read_bytes()).hexdigest()
    except (OSError, ValueError):  # ValueError: an invalid file name
        return None


def compiler() -> dict[str, Any]:
    """Return the versions that must match between compiling and loading kernels."""
    import warp as wp

    context = _warp_context()
    return {
        "warp": wp.config.version,
        "llvm": context._get_cpu_toolchain_version(),
        "triple": context._get_cpu_target_triple(),
    }


def processor_features() -> set[str]:
    """Return LLVM's names of this processor's features."""
    return _warp_context()._get_cpu_feature_set()


def _warp_context():
    # A private API without a public alternative. The bundled version is pinned, and `_fitting` checks it first.
    import warp as wp
    from warp._src import context

    wp.init()  # before this call, versions and features are unknown
    return context


@cache
def _fitting(folder):
    """Return (best matching processor type, {module: (hash, {processor: digest})}); ("", {}) for none."""
    import warp as wp

    try:
        made_by, processors, modules = _read_index(folder)
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return "", {}  # missing, or not written by tools/compile_kernels.py
    if made_by.get("warp") != wp.config.version or made_by != compiler():
        return "", {}
    features = processor_features()
    for name, needed in processors:
        if features.issuperset(needed):
            return name, modules
    return "", {}


def _read_index(folder):
    """Return (compiler, [(processor, its features)], {module: (hash, digests)}); raises for invalid content."""
    index = json.loads((folder / INDEX).read_text(encoding="utf-8"))
    processors = [(str(kind["name"]), frozenset(kind["features"])) for kind in index["processors"]]
    entries = {name: (str(entry["hash"]), dict(entry["files"])) for name, entry in index["modules"].items()}
    return dict(index["compiler"]), processors, entries
