# SPDX-License-Identifier: GPL-3.0-or-later
"""Shipped kernels give the same hair as kernels compiled here, and are not used if they do not fit."""

import json
import os
import shutil
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import pytest
import warp as wp

from hair_addon.core.geometry.curves import bspline
from hair_addon.core.kernels import compiled_kernels
from tests.support import any_processor
from tools import build_extension, compile_kernels

ROOT = build_extension.ROOT

pytestmark = pytest.mark.skipif(
    compile_kernels.this_platform() not in compile_kernels.PROCESSORS,
    reason="no kernels are compiled for this platform",
)

# Digests of guides and of hair, with the kernels of one folder after another; the first has none, so Warp compiles or
# has compiled them. What it compiles for the others lies in a cache of its own.
PROGRAM = """
import hashlib, sys
from pathlib import Path
import numpy as np
import warp as wp
from hair_addon.core.kernels import compiled_kernels, kernel_cache
from hair_addon.core.grooming import groom
from tests.support.meshes import HEAD, read_obj
from tests.support.strands.hair import generate_hair

def digest(*values):
    return hashlib.sha256(b"".join(np.ascontiguousarray(value).tobytes() for value in values)).hexdigest()

mesh = read_obj(HEAD)
cache, none, *folders = sys.argv[1:]
for folder in (none, *folders):
    compiled_kernels.FOLDER = Path(folder)
    kernel_cache._loaded.clear()
    for module in wp._src.context.user_modules.values():
        module.unload()
    guides = groom.distribute_guides(mesh, groom.GuideSettings(guide_count=200, curvature=1.0))
    hair = generate_hair(mesh, guides, groom.HairSettings(strand_count=3000))
    print(digest(guides.numpy(), guides.roots.barycentric), digest(hair.numpy(), hair.roots.triangle))
    wp.config.kernel_cache_dir = cache
"""


# Of before 2013, without AVX2 and fused multiply-add. Names that a library does not know are ignored.
OLD_PROCESSOR = {
    "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR",
    "OPENBLAS_CORETYPE": "Nehalem",
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F",
}


@pytest.fixture(scope="module")
def made():
    """Return the folder as in the extension's zip, compiled once for the same sources."""
    return build_extension.compiled_kernels("tests")


@pytest.fixture
def folder(made, tmp_path, monkeypatch):
    """Return a copy of that folder, from which kernels are loaded."""
    copy = tmp_path / "kernels"
    shutil.copytree(made, copy)
    monkeypatch.setattr(compiled_kernels, "FOLDER", copy)
    return copy


def loads():
    return compiled_kernels.load(wp.get_module(bspline.__name__), wp.get_device("cpu"))


def change_index(folder, change):
    path = folder / compiled_kernels.INDEX
    index = json.loads(path.read_text(encoding="utf-8"))
    change(index)
    path.write_text(json.dumps(index), encoding="utf-8")


def test_of_several_that_ask_for_kernels_one_compiles_them(tmp_path, monkeypatch):
    compiling, asked = [], threading.Barrier(3)

    def compile_kernels_once(folder, _scope):
        compiling.append(folder)
        folder.mkdir()

    def ask(_turn):
        asked.wait()
        return build_extension.compiled_kernels()

    monkeypatch.setattr(build_extension, "kernel_folder", lambda _scope: tmp_path / "kernels" / "here")
    monkeypatch.setattr(compile_kernels, "are_up_to_date", lambda folder: folder.exists())
    monkeypatch.setattr(build_extension, "_compile_kernels", compile_kernels_once)
    with ThreadPoolExecutor(3) as pool:
        assert set(pool.map(ask, range(3))) == set(compiling) == {tmp_path / "kernels" / "here"}
    assert len(compiling) == 1


@pytest.fixture(scope="module")
def folders(made, tmp_path_factory):
    """Return a folder with the kernels of each level that this processor supports, the best level first."""
    index = json.loads((made / compiled_kernels.INDEX).read_text(encoding="utf-8"))
    features = compiled_kernels.processor_features()
    found = []
    for kind in (kind for kind in index["processors"] if features.issuperset(kind["features"])):
        found.append(tmp_path_factory.mktemp("kinds") / kind["name"])
        shutil.copytree(made, found[-1])
        change_index(found[-1], lambda index, kind=kind: index.update(processors=[kind]))
    assert found
    return found


@pytest.mark.farm
def test_the_same_hair_and_nothing_is_compiled(folders, tmp_path):
    """Each processor level that this machine supports gives the same hair and compiles nothing."""
    cache = tmp_path / "cache"
    command = [sys.executable, "-c", PROGRAM, cache, tmp_path / "none", *folders]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    hair, *compiled = (line.split() for line in done.stdout.splitlines() if len(line) == 129)
    assert compiled == [hair] * len(folders)
    assert list(cache.rglob("*.o")) == []


@pytest.mark.farm
def test_strands_are_the_same_bits_on_every_processor(folders):
    """Kernels of each level give the same bits, also if NumPy, OpenBLAS and the C library run on old processors."""
    best, *others = made_by(*folders)
    assert [made["compiled here"] for made in (best, *others)] == [[]] * len(folders), "see compile_kernels.COMPARED"
    assert all(sizes == [] for made in (best, *others) for sizes in made["laws"].values())
    for made in (*others, *made_by(folders[-1], environment=os.environ | OLD_PROCESSOR)):
        assert made["digests"] == best["digests"]


def made_by(*folders, environment=None):
    """Return what any_processor.py prints for folders of kernels."""
    command = [sys.executable, any_processor.__file__, *folders]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    found = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    assert len(found) == len(folders)
    return found


def test_no_kernel_is_compiled_for_gradients():
    """No kernel is compiled for gradients, which nothing uses and which take as long to compile as everything else."""
    assert [module.name for module in compile_kernels._warp_modules() if module.options["enable_backward"]] == []


def test_native_code_is_among_the_sources():
    native = {path for path in (ROOT / "hair_addon").rglob("*") if path.suffix in {".cpp", ".h"}}
    assert native and native <= set(compile_kernels.sources())


@pytest.mark.parametrize(("named", "expected"), [("/elsewhere", "/elsewhere"), ("", ROOT / "kernels")])
def test_a_folder_is_named_by_the_environment(named, expected):
    """The environment variable names the folder of kernels, so that processes of tests load what `make build` has
    compiled.
    """
    program = "from hair_addon.core.kernels import compiled_kernels; print(compiled_kernels.FOLDER)"
    environment = os.environ | {compiled_kernels.VARIABLE: named}
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == str(expected)


@pytest.mark.usefixtures("folder")
def test_kernels_that_fit_are_loaded():
    assert loads()


def test_no_folder(folder):
    shutil.rmtree(folder)
    assert not loads()


def test_an_empty_folder(folder):
    shutil.rmtree(folder)
    folder.mkdir()
    assert not loads()


def test_a_damaged_index(folder):
    path = folder / compiled_kernels.INDEX
    path.write_bytes(path.read_bytes()[:100])
    assert not loads()


@pytest.mark.parametrize("part", ["warp", "llvm", "triple"])
def test_another_compiler(folder, part):
    change_index(folder, lambda index: index["compiler"].update({part: "0"}))
    assert not loads()


def test_other_sources(folder):
    change_index(folder, lambda index: index["modules"]["core.geometry.curves.bspline"].update(hash="0" * 64))
    assert not loads()


def test_other_options(folder, monkeypatch):
    """Compiled kernels are not loaded if options change the code that Warp would compile, such as checks of numbers."""
    module = wp.get_module(bspline.__name__)
    monkeypatch.setattr(wp.config, "verify_fp", True)
    module.mark_modified()
    try:
        assert not loads()
    finally:
        module.mark_modified()


def test_a_lesser_processor(folder):
    """A processor without a feature of every level loads no kernels; one without a feature of the best level, the
    next level's.
    """
    first, *others = json.loads((folder / compiled_kernels.INDEX).read_text(encoding="utf-8"))["processors"]
    change_index(folder, lambda index: index["processors"][0]["features"].append("another"))
    assert loads() == bool(others)
    assert compiled_kernels._fitting(folder)[0] != first["name"]
    compiled_kernels._fitting.cache_clear()
    change_index(folder, lambda index: [kind["features"].append("another") for kind in index["processors"]])
    assert not loads()


def test_a_damaged_file(folder):
    processor, _modules = compiled_kernels._fitting(folder)
    binary, _meta = compiled_kernels.file_names("core.geometry.curves.bspline", processor)
    content = bytearray((folder / binary).read_bytes())
    content[len(content) // 2] ^= 1
    (folder / binary).write_bytes(content)
    assert not loads()
    (folder / binary).unlink()
    assert not loads()


@pytest.fixture
def gpu_folder(folder, monkeypatch):
    """Return a folder with the kernels of one module for two GPU types."""
    if not set(compile_kernels.GPUS) <= compile_kernels.gpus_of_compiler():
        pytest.skip("this platform's Warp does not compile for GPUs")
    module = wp.get_module(bspline.__name__)
    monkeypatch.setattr(compile_kernels, "_warp_modules", lambda: [module])
    monkeypatch.setattr(wp.config, "kernel_cache_dir", wp.config.kernel_cache_dir)
    monkeypatch.setattr(wp.config, "log_level", wp.config.log_level)
    entry = {"hash": module.get_module_hash().hex(), "files": {}}
    for architecture in (80, 90):
        kind, compiled = compile_kernels._compile_for_gpu(folder, architecture)
        ((name, (module_hash, entry["files"][kind])),) = compiled.items()
        assert module_hash == entry["hash"]
    change_index(folder, lambda index: index.update(gpus=[80, 90], gpu_modules={name: entry}))
    return folder


def loaded_on_gpu(monkeypatch, architecture):
    """Return (whether kernels were loaded on a GPU of an architecture, [(GPU type, architecture of the file)])."""
    module, calls = wp.get_module(bspline.__name__), []

    def load(_device, block_dim, output_arch, binary_path, meta_path):
        assert block_dim == module.options["block_dim"]
        assert json.loads(meta_path.read_text(encoding="utf-8"))
        calls.append((binary_path.parent.name, output_arch))

    monkeypatch.setattr(module, "load", load)
    return compiled_kernels.load(module, SimpleNamespace(is_cpu=False, arch=architecture)), calls


@pytest.mark.parametrize(
    ("architecture", "expected"), [(75, None), (80, 80), (89, 80), (90, 90), (100, None)], ids=lambda value: str(value)
)
@pytest.mark.usefixtures("gpu_folder")
def test_kernels_of_a_gpu_of_the_same_generation_are_loaded(monkeypatch, architecture, expected):
    """Code for a GPU runs on GPUs with the same major and the same or a higher minor compute capability."""
    expected_calls = [] if expected is None else [(f"sm_{expected}", expected)]
    assert loaded_on_gpu(monkeypatch, architecture) == (expected is not None, expected_calls)


def test_kernels_of_gpus_that_do_not_fit(gpu_folder, monkeypatch):
    """Damaged files, other sources, and code that the driver refuses are left out."""
    module = wp.get_module(bspline.__name__)

    def refuse(*_arguments, **_options):
        raise Exception("CUDA error")

    monkeypatch.setattr(module, "load", refuse)
    monkeypatch.setitem(module.execs, "of the CPU", None)
    assert not compiled_kernels.load(module, SimpleNamespace(is_cpu=False, arch=90))
    assert "of the CPU" in module.execs
    path = gpu_folder / "sm_90" / "core.geometry.curves.bspline.cubin"
    path.write_bytes(path.read_bytes()[:-1])
    assert loaded_on_gpu(monkeypatch, 90) == (False, [])
    change_index(gpu_folder, lambda index: index["gpu_modules"]["core.geometry.curves.bspline"].update(hash="0"))
    compiled_kernels._fitting_gpu.cache_clear()
    assert loaded_on_gpu(monkeypatch, 80) == (False, [])


def test_nothing_of_this_machine(made):
    """The files of kernels contain no path of this machine."""
    for path in filter(os.path.isfile, made.rglob("*")):
        assert not [word for word in (str(ROOT), os.path.expanduser("~")) if word.encode() in path.read_bytes()]
