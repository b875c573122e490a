# SPDX-License-Identifier: GPL-3.0-or-later
"""Compile the extension's kernels for the processors of this platform: `python tools/compile_kernels.py FOLDER`.

Warp's compiler produces code only for the platform that it runs on, so each platform's kernels are compiled there. With
`--gpus` kernels for NVIDIA GPUs are compiled too, which needs no GPU. The files contain no path, time or name of this
machine: the same sources and the same Warp give the same bytes. core/kernels/compiled_kernels.py loads those that fit.
"""

import argparse
import hashlib
import importlib
import json
import multiprocessing
import os
import platform
import shutil
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
CACHE = ROOT / "build" / "kernel-cache"  # Warp's own: after a change only what it changes is compiled again
SOURCE_SUFFIXES = {".py", ".cpp", ".h", ".strand"}
sys.path.insert(0, str(ROOT))

README = """\
Kernels of hair_addon/core, compiled by Warp with `python tools/compile_kernels.py FOLDER` from Vellus's sources.

They only save time: without this folder, or if it does not match, Warp compiles the same kernels on first use.
"""


@dataclass(frozen=True)
class Processor:
    """A processor target: its LLVM name, and its minimum features in LLVM's terms."""

    name: str
    features: tuple[str, ...]


# Warp always compiles for AVX and F16C on x86-64: its own kernels do not run on less either.
_AVX = ("avx", "crc32", "cx16", "f16c", "popcnt", "sahf", "sse3", "sse4.1", "sse4.2", "ssse3", "xsave")
_AVX2 = (*_AVX, "avx2", "bmi", "bmi2", "fma", "lzcnt", "movbe")
_X86 = (
    Processor("x86-64-v4", (*_AVX2, "avx512bw", "avx512cd", "avx512dq", "avx512f", "avx512vl")),
    Processor("x86-64-v3", _AVX2),
    Processor("x86-64-v2", _AVX),
)
# Modules whose results are compared bit for bit between processors, by tests/support/any_processor.py, which tells of
# others that it loads.
_COMPARED = {
    "dynamics.rod": ("rod_solver", "rods"),
    "geometry": ("closest_point", "fingerprint", "root_frames", "sampling"),
    "geometry.curves": ("bspline",),
    "geometry.faces": ("connected_components",),
    "geometry.search": ("counting_sort", "hash_grid"),
    "grooming": ("guide_growth",),
    "interpolation": ("clump_centers", "guide_weights", "interpolation", "sharp_edges"),
    "placement": ("exact_cells", "farthest", "preconditioner", "sampled_cells", "voronoi"),
    "styling": ("stack", "steps"),
}
COMPARED = {f"core.{package}.{name}" for package, names in _COMPARED.items() for name in names}
# Best first.
PROCESSORS = {"linux-x64": _X86, "windows-x64": _X86, "macos-arm64": (Processor("apple-m1", ()),)}
# Compute capabilities times ten, one for each generation: 7.5 Turing, 8.0 Ampere and Ada, 9.0 Hopper, 10.0 and 12.0
# Blackwell. As code for the GPU, not as PTX: drivers refuse PTX of a newer CUDA than theirs.
GPUS = (75, 80, 90, 100, 120)
_FOR_PROCESSORS_ONLY = {"core.dynamics.collision.contact_substep"}  # modules that are not launched on GPUs


def this_platform() -> str:
    """Blender's name of the platform that this Python runs on."""
    system = {"Linux": "linux", "Windows": "windows", "Darwin": "macos"}.get(platform.system(), platform.system())
    machine = {"x86_64": "x64", "AMD64": "x64", "aarch64": "arm64"}.get(platform.machine(), platform.machine())
    return f"{system}-{machine}"


def sources():
    """Return the files that compiled kernels depend on: the core, this file, and the lock file that pins Warp."""
    core = sorted(path for path in (ROOT / "hair_addon" / "core").rglob("*") if path.suffix in SOURCE_SUFFIXES)
    return [*core, ROOT / "requirements.lock", Path(__file__)]


def sources_digest():
    """SHA-256 of `sources`, names and contents."""
    total = hashlib.sha256()
    for path in sources():
        total.update(path.relative_to(ROOT).as_posix().encode() + b"\0" + path.read_bytes())
    return total.hexdigest()


def compile_into(folder, processors, is_for_tests=False, gpus=()):
    """Write the folder that `compiled_kernels` reads: an index, and each Warp module for each `Processor`.

    is_for_tests: for other processors than this one, compile only the modules that tests compare. gpus: architectures
    of `GPUS`. Each processor's modules are compiled by a process of their own: a module may take half of its time, and
    has one thread. All of them run at once, also on fewer cores, as a late process would work alone at the end.
    """
    import warp as wp

    wp.config.log_level = wp.LOG_WARNING
    from hair_addon.core.kernels import compiled_kernels

    features = compiled_kernels.processor_features()
    here = next((processor for processor in processors if features.issuperset(processor.features)), None)
    cores = os.process_cpu_count() or 1
    entries, gpu_entries = {}, {}
    with ProcessPoolExecutor(len(processors), multiprocessing.get_context("spawn"), max_tasks_per_child=1) as pool:
        jobs = [
            pool.submit(
                *(_compile_for, processor, folder, is_for_tests and processor != here),
                cores if is_for_tests and processor == here else -(-cores // len(processors)),
            )
            for processor in processors
        ]
        for processor, job in zip(processors, jobs, strict=True):
            for name, (module_hash, file_digest) in job.result().items():
                entry = entries.setdefault(name, {"hash": module_hash, "files": {}})
                if file_digest:
                    entry["files"][processor.name] = file_digest
    with ProcessPoolExecutor(cores, multiprocessing.get_context("spawn"), max_tasks_per_child=1) as pool:
        for kind, compiled in pool.map(partial(_compile_for_gpu, folder), gpus):
            for name, (module_hash, file_digest) in compiled.items():
                gpu_entries.setdefault(name, {"hash": module_hash, "files": {}})["files"][kind] = file_digest
    index = {
        "sources": sources_digest(),
        "compiler": compiled_kernels.compiler(),
        "processors": [{"name": kind.name, "features": sorted(kind.features)} for kind in processors],
        "modules": entries,
        "gpus": list(gpus),
        "gpu_modules": gpu_entries,
    }
    (folder / "README.txt").write_text(README, encoding="utf-8")
    (folder / compiled_kernels.INDEX).write_text(json.dumps(index, indent=1, sort_keys=True) + "\n", encoding="utf-8")


def _compile_for(processor, folder, is_compared_only, threads):
    """Write the modules of one `Processor`: {module: (hash, digest of its files, None where it is left out)}."""
    import warp as wp

    wp.config.kernel_cache_dir = str(CACHE)
    wp.config.log_level = wp.LOG_WARNING
    wp.init()
    from hair_addon.core.kernels import compiled_kernels

    modules = [module for module in _warp_modules() if module.kernels]
    names = {module: compiled_kernels.short_name(module) for module in modules}
    # The hash that a user's Warp computes holds its flags, not the processor that those stand for.
    found = {names[module]: (module.get_module_hash(1).hex(), None) for module in modules}
    native_flags = wp.config.cpu_compiler_flags
    wp.config.cpu_compiler_flags = native_flags.replace("-march=native", f"-target-cpu {processor.name}")
    assert wp.config.cpu_compiler_flags != native_flags
    wanted = [module for module in modules if names[module] in COMPARED or not is_compared_only]
    for module in wanted:
        module.unload()
    wp.force_load("cpu", wanted, max_workers=threads)
    for module in wanted:
        made = Path(wp.config.kernel_cache_dir) / module.get_module_identifier(1)
        paths = [folder / path for path in compiled_kernels.file_names(names[module], processor.name)]
        compiled = [path for ending in (".o", ".meta") for path in made.glob(f"*{ending}")]
        for path, its in zip(paths, compiled, strict=True):
            path.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(its, path)  # the metadata of all processors, which is the same
        found[names[module]] = found[names[module]][0], compiled_kernels.digest(*compiled)
    return found


def _compile_for_gpu(folder, architecture):
    """Write the modules of one of `GPUS`. Return (its type, {module: (hash, digest of its files)})."""
    import warp as wp

    wp.config.kernel_cache_dir = str(CACHE)
    wp.config.log_level = wp.LOG_WARNING
    wp.init()
    from hair_addon.core.kernels import compiled_kernels

    kind, found = compiled_kernels.gpu_type(architecture), {}
    for module in _warp_modules():
        name = compiled_kernels.short_name(module)
        if not module.kernels or name in _FOR_PROCESSORS_ONLY:
            continue
        module._compile(None, output_arch=architecture, use_ptx=False)
        made, block_dim = Path(wp.config.kernel_cache_dir) / module.get_module_identifier(), module.options["block_dim"]
        compiled = [
            made / module._get_compile_output_name(None, architecture, use_ptx=False, block_dim=block_dim),
            made / module._get_meta_name(block_dim=block_dim),
        ]
        for path, its in zip(compiled_kernels.file_names(name, kind), compiled, strict=True):
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(its, folder / path)
        found[name] = module.get_module_hash(block_dim).hex(), compiled_kernels.digest(*compiled)
    return kind, found


def gpus_of_compiler():
    """Return the architectures that this platform's Warp compiles for, none on a Mac."""
    import warp as wp
    from warp._src import context

    wp.init()
    return set(context.runtime.nvrtc_supported_archs)


def _warp_modules():
    """Warp's modules of every file of the core, which are known to it once the files are imported."""
    import warp as wp

    core = ROOT / "hair_addon" / "core"
    paths = [path for path in sorted(core.rglob("*.py")) if "@wp.kernel" in path.read_text(encoding="utf-8")]
    names = [".".join(path.relative_to(ROOT).with_suffix("").parts) for path in paths]
    for name in names:
        importlib.import_module(name)
    return [wp.get_module(name) for name in names]


def are_up_to_date(folder):
    """Whether a folder holds the kernels of the sources as they are."""
    try:
        index = json.loads((folder / "index.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return index["sources"] == sources_digest()


def main():
    """Run the command line."""
    parser = argparse.ArgumentParser(description="Compile the extension's kernels for this platform.")
    parser.add_argument("folder", type=Path, help="output folder; its content is replaced")
    parser.add_argument("--tests", action="store_true", help="for older processors, only what tests compare")
    parser.add_argument("--gpus", action="store_true", help="also for NVIDIA GPUs, which takes many minutes")
    arguments = parser.parse_args()
    folder = arguments.folder.resolve()
    processors = PROCESSORS.get(this_platform())
    if processors is None:
        sys.exit(f"Kernels are not compiled for {this_platform()}.")
    if arguments.gpus and not gpus_of_compiler().issuperset(GPUS):
        sys.exit(f"Kernels for NVIDIA GPUs are not compiled on {this_platform()}.")
    shutil.rmtree(folder, ignore_errors=True)
    compile_into(folder, processors, arguments.tests, GPUS if arguments.gpus else ())


if __name__ == "__main__":
    main()
