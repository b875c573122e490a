# SPDX-License-Identifier: GPL-3.0-or-later
"""Precompiled kernels of the extension; if none match, Warp compiles them on first use.

`tools/compile_kernels.py` writes the folder: an index, and an object file for each Warp module and processor type. A
module is loaded only if the versions of Warp and its compiler match, the processor supports all features that the file
was compiled for, and Warp's hash of the module's sources and options matches. A release also has files for NVIDIA GPUs:
code for compute capability X.Y runs on X.Z if Z >= Y. The folder is only read.
"""

import hashlib
import json
import os
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    import warp as wp

VARIABLE = "VELLUS_KERNELS"  # environment variable with another folder, such as a checkout's build folder
FOLDER = Path(os.environ.get(VARIABLE) or Path(__file__).resolve().parents[3] / "kernels")
INDEX = "index.json"

_GPU = "sm_"  # prefix of the names of GPU types

_PACKAGE = __name__.removesuffix("core.kernels.compiled_kernels")  # prefix of Warp's names of our modules


def load(module: "wp.Module", device: "wp.Device") -> bool:
    """Load a Warp module's precompiled kernels, and return whether matching kernels were found."""
    kind, modules = _fitting(FOLDER) if device.is_cpu else _fitting_gpu(FOLDER, device.arch)
    block_dim = block_dim_of(module, device)
    module_hash, digests = modules.get(short_name(module), ("", {}))
    if kind not in digests or module_hash != module.get_module_hash(block_dim).hex():
        return False
    binary, meta = (FOLDER / path for path in file_names(short_name(module), kind))
    found = digest(binary, meta)
    if found is None or digests[kind] != found:
        return False
    files = {"binary_path": binary, "meta_path": meta}
    if device.is_cpu:
        module.load(device, block_dim=block_dim, **files)
        return True
    try:
        module.load(device, block_dim=block_dim, output_arch=architecture_of(kind), **files)
    except Exception:  # Warp raises nothing more specific if the driver refuses the code
        return False
    return True


def block_dim_of(module: "wp.Module", device: "wp.Device") -> int:
    """Return the threads of a block that a module is compiled for: one on the CPU."""
    return 1 if device.is_cpu else module.options["block_dim"]


def short_name(module: "wp.Module") -> str:
    """Return the name of a Warp module relative to the add-on, such as core.geometry.curves.bspline."""
    return module.name.removeprefix(_PACKAGE)


def file_names(module_name: str, kind: str) -> tuple[str, str]:
    """Return the relative paths of a module's compiled file and metadata. kind: a processor type or GPU type."""
    if kind.startswith(_GPU):
        return f"{kind}/{module_name}.cubin", f"{kind}/{module_name}.meta"
    return f"{kind}/{module_name}.o", f"{module_name}.meta"


def gpu_type(architecture: int) -> str:
    """Return the name of a GPU type, such as sm_80 for 80, which is compute capability 8.0."""
    return f"{_GPU}{architecture}"


def architecture_of(kind: str) -> int:
    """Return the architecture of a GPU type, such as 80 for sm_80."""
    return int(kind.removeprefix(_GPU))


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


class _Index(NamedTuple):
    compiler: dict[str, Any]
    processors: list[tuple[str, frozenset[str]]]  # (name, its features), best first
    modules: dict[str, tuple[str, dict[str, str]]]  # {name: (Warp's hash, {processor type: digest})}
    gpus: list[int]  # architectures
    gpu_modules: dict[str, tuple[str, dict[str, str]]]  # {name: (Warp's hash, {GPU type: digest})}


@cache
def _fitting(folder):
    """Return (best matching processor type, {module: (hash, {processor: digest})}); ("", {}) for none."""
    index = _index_of_this_compiler(folder)
    if index is not None:
        features = processor_features()
        for name, needed in index.processors:
            if features.issuperset(needed):
                return name, index.modules
    return "", {}


@cache
def _fitting_gpu(folder, architecture):
    """Return (best matching GPU type, {module: (hash, {GPU type: digest})}); ("", {}) for none."""
    index = _index_of_this_compiler(folder)
    if index is not None:
        fitting = [each for each in index.gpus if each // 10 == architecture // 10 and each <= architecture]
        if fitting:
            return gpu_type(max(fitting)), index.gpu_modules
    return "", {}


def _index_of_this_compiler(folder):
    """Return the folder's index, or None if it is missing, invalid, or made by another compiler."""
    import warp as wp

    try:
        index = _read_index(folder)
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return None
    is_ours = index.compiler.get("warp") == wp.config.version and index.compiler == compiler()
    return index if is_ours else None


def _read_index(folder):
    """Read the index of a folder; raises for invalid content."""
    index = json.loads((folder / INDEX).read_text(encoding="utf-8"))
    processors = [(str(kind["name"]), frozenset(kind["features"])) for kind in index["processors"]]
    modules, gpu_modules = (
        {name: (str(entry["hash"]), dict(entry["files"])) for name, entry in index[key].items()}
        for key in ("modules", "gpu_modules")
    )
    gpus = [int(architecture) for architecture in index["gpus"]]
    return _Index(dict(index["compiler"]), processors, modules, gpus, gpu_modules)
