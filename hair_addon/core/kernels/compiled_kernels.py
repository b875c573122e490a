# SPDX-License-Identifier: GPL-3.0-or-later
"""Precompiled kernels of the extension; if none fit, Warp compiles them on first use as usual.

`tools/compile_kernels.py` writes the folder: an index, and an object file for each Warp module and kind of processor. A
module is loaded from it only if Warp and its compiler have the same version, the processor has every feature that the
file was compiled for, and Warp's hash of the module's sources and options is the same. Nothing is written.
"""

import hashlib
import json
import os
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import warp as wp

VARIABLE = "VELLUS_KERNELS"  # of the environment: names another folder, as of a checkout, whose build has one
FOLDER = Path(os.environ.get(VARIABLE) or Path(__file__).resolve().parents[3] / "kernels")
INDEX = "index.json"

_PACKAGE = __name__.removesuffix("core.kernels.compiled_kernels")  # prefix of Warp's names of our modules


def load(module: "wp.Module", device: "wp.Device") -> bool:
    """Load a Warp module's compiled kernels on the processor; whether there were any that fit."""
    if not device.is_cpu:
        return False
    processor, modules = _fitting(FOLDER)
    module_hash, digests = modules.get(short_name(module), ("", {}))
    if not digests or module_hash != module.get_module_hash(1).hex():
        return False
    binary, meta = (FOLDER / path for path in file_names(short_name(module), processor))
    if digests.get(processor, "") != digest(binary, meta):
        return False
    # One thread is a block on the processor.
    module.load(device, block_dim=1, binary_path=binary, meta_path=meta)
    return True


def short_name(module: "wp.Module") -> str:
    """Return the name of a Warp module relative to the add-on, such as core.geometry.bspline."""
    return module.name.removeprefix(_PACKAGE)


def file_names(module_name: str, processor: str) -> tuple[str, str]:
    """Paths in the folder of a module's object file and of its metadata."""
    return f"{processor}/{module_name}.o", f"{module_name}.meta"


def digest(binary: Path, meta: Path) -> str | None:
    """SHA-256 of a module's two files in hexadecimal digits, or None where one of them is missing."""
    try:
        return hashlib.sha256(binary.read_bytes() + meta.read_bytes()).hexdigest()
    except (OSError, ValueError):  # ValueError: a name that no file can have
        return None


def compiler() -> dict[str, Any]:
    """What must be the same where kernels are compiled and where they are loaded."""
    import warp as wp

    context = _warp_context()
    return {
        "warp": wp.config.version,
        "llvm": context._get_cpu_toolchain_version(),
        "triple": context._get_cpu_target_triple(),
    }


def processor_features() -> set[str]:
    """Names of the features of this machine's processor, as LLVM calls them."""
    return _warp_context()._get_cpu_feature_set()


def _warp_context():
    # Not public, and without a public alternative. The bundled version is pinned, and `_fitting` asks
    # for it before anything else.
    import warp as wp
    from warp._src import context

    wp.init()  # neither is known before
    return context


@cache
def _fitting(folder):
    """(best kind of processor that this one is, {module: (hash, {processor: digest})}); ("", {}) for none."""
    import warp as wp

    try:
        made_by, processors, modules = _read_index(folder)
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return "", {}  # there is none, or what there is was not written by tools/compile_kernels.py
    if made_by.get("warp") != wp.config.version or made_by != compiler():
        return "", {}
    features = processor_features()
    for name, needed in processors:
        if features.issuperset(needed):
            return name, modules
    return "", {}


def _read_index(folder):
    """(compiler, [(processor, its features)], {module: (hash, digests)}); raises what another shape brings about."""
    index = json.loads((folder / INDEX).read_text(encoding="utf-8"))
    processors = [(str(kind["name"]), frozenset(kind["features"])) for kind in index["processors"]]
    entries = {name: (str(entry["hash"]), dict(entry["files"])) for name, entry in index["modules"].items()}
    return dict(index["compiler"]), processors, entries
