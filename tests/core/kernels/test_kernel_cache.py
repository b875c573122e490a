# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels run with any state of Warp's cache: damaged entries, unwritable folders, full disks."""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from hair_addon.core.kernels import compiled_kernels, kernel_cache

ROOT = Path(__file__).resolve().parents[3]

# Of a process that is given no compiled kernels.
ENVIRONMENT = {name: value for name, value in os.environ.items() if name != compiled_kernels.VARIABLE}

# Five modules, two of them loaded together as grooming does it, three as they are launched.
WORK = """
import numpy as np
from hair_addon.core.geometry import fingerprint
from hair_addon.core.geometry.curves import bspline
from hair_addon.core.geometry.faces import connected_components
from hair_addon.core.geometry.search import counting_sort
from hair_addon.core.grooming import groom
from hair_addon.core.interpolation import clump_centers
from hair_addon.core.geometry.mesh import TriMesh
from warp._src import context
assert context._cpu_toolchain_version_cache and context._cpu_target_triple_cache  # not first asked for by two threads
assert context._cpu_feature_set_cache is not None
mesh = TriMesh(np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32))
groom._load_kernels("cpu", [bspline, fingerprint], print)
controls = np.arange(36, dtype=np.float32).reshape(2, 6, 3)
points = bspline.evaluate(controls, 9).numpy()
np.testing.assert_allclose(points, bspline.basis_matrix(6, 9) @ controls, rtol=1e-5)
assert connected_components.connected_components(mesh).tolist() == [0]
assert fingerprint.fingerprint(np.arange(2**20)) != fingerprint.fingerprint(np.arange(1, 2**20 + 1))
assert counting_sort.rising(np.array([0.5, 0.25])).tolist() == [1, 0]
assert clump_centers.clump_centers([0], [[0, 0, 0]], [[0, 0, 0]]).tolist() == [0]
import warp
print("cache:", warp.config.kernel_cache_dir)
"""
NAMES = """
used = bspline, fingerprint, connected_components, counting_sort, clump_centers
modules = [warp.get_module(module.__name__) for module in used]
print(warp.config.version, warp.config.kernel_cache_dir, sep="\\n")
print(*(module.get_module_identifier(block_dim=1) for module in modules))
"""


def work(cache, temporary, before=()):
    """Do the work in a separate process, and return the folder from which its kernels came."""
    environment = ENVIRONMENT | {"PYTHONPATH": str(ROOT), "WARP_CACHE_PATH": str(cache), "TMPDIR": str(temporary)}
    line = [*before, sys.executable, "-c", WORK]
    done = subprocess.run(line, env=environment, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert "Traceback" not in done.stderr
    return Path(done.stdout.splitlines()[-1].removeprefix("cache: "))


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """Return a cache that holds exactly the five modules."""
    folder = tmp_path_factory.mktemp("compiled")
    # In a process of its own, as all others here: a name follows from all that Warp has seen in its process.
    line = [sys.executable, "-c", WORK + NAMES]
    done = subprocess.run(line, cwd=ROOT, env=ENVIRONMENT, capture_output=True, text=True, check=True)
    *_, version, cached, names = done.stdout.splitlines()
    for name in names.split():
        shutil.copytree(Path(cached) / name, folder / version / name)
    return folder


@pytest.fixture
def cache(compiled, tmp_path):
    """Return a copy of the cache, which a test may damage."""
    return shutil.copytree(compiled, tmp_path / "cache")


def file_of(cache, module, ending):
    return next(cache.rglob(f"wp_hair_addon.core.*.{module}_*/*{ending}"))


def digest(cache):
    return {path: path.read_bytes() for path in cache.rglob("*.o")}


@pytest.mark.farm
def test_damaged_entries_are_compiled_again(cache, tmp_path):
    """Damaged entries are compiled again, one of them while another thread compiles a different one."""
    code = file_of(cache, "bspline", ".o")
    code.write_bytes(code.read_bytes()[:700])
    file_of(cache, "counting_sort", ".meta").write_text("")
    entry = file_of(cache, "clump_centers", ".o").parent
    shutil.rmtree(entry)
    entry.write_text("no folder")
    damaged = digest(cache)
    assert work(cache, tmp_path).parent == cache
    mended = digest(cache)
    assert len(mended) == 5 and mended[code] != damaged[code]
    assert len(list(cache.rglob("*.sha256"))) == 5 and not list(cache.rglob("vellus_*"))
    assert work(cache, tmp_path).parent == cache
    assert digest(cache) == mended


FLIPS = """
from pathlib import Path
from hair_addon.core.kernels import kernel_entries
module, device = warp.get_module(bspline.__name__), warp.get_device("cpu")
place = next(Path(warp.config.kernel_cache_dir).glob("*.bspline_*"))
assert kernel_entries.load(device, module)
for path in sorted(path for path in place.iterdir() if path.suffix != ".cpp"):
    whole = path.read_bytes()
    for flip in range(15):
        bit = len(whole) * 8 * flip // 15
        damaged = bytearray(whole)
        damaged[bit // 8] ^= 1 << bit % 8
        path.write_bytes(damaged)
        module.unload()
        if kernel_entries.load(device, module):
            print("loaded", path.suffix, bit)
            bspline.evaluate(controls, 9).numpy()
    path.write_bytes(whole)
module.unload()
assert kernel_entries.load(device, module)
next(place.glob("*.sha256")).unlink()
print("without digest:", kernel_entries.is_whole(device, module))
"""


@pytest.mark.farm
def test_a_flipped_bit_is_noticed(cache, tmp_path):
    """No file with a flipped bit is loaded: its code could end the process or compute something else."""
    environment = os.environ | {"PYTHONPATH": str(ROOT), "WARP_CACHE_PATH": str(cache), "TMPDIR": str(tmp_path)}
    line = [sys.executable, "-c", WORK + FLIPS]
    done = subprocess.run(line, env=environment, capture_output=True, text=True, timeout=600, check=False)
    assert (done.returncode, done.stdout.splitlines()[-1]) == (0, "without digest: False"), (
        done.stdout + done.stderr[-2000:]
    )
    assert "loaded ." not in done.stdout


@pytest.fixture
def temporary(compiled, tmp_path):
    """Return a temporary folder in which an earlier process has compiled the kernels."""
    folder = tmp_path / "temporary"
    kept = folder / f"vellus_kernels_{os.getuid()}"
    shutil.copytree(compiled, kept)
    kept.chmod(0o700)
    return folder


@pytest.mark.farm
def test_a_folder_that_cannot_be_made_is_left_for_a_temporary_one(temporary, tmp_path):
    (tmp_path / "file").write_text("")
    before = digest(temporary)
    assert work(tmp_path / "file" / "cache", temporary).is_relative_to(temporary)
    assert digest(temporary) == before


needs_mounts = pytest.mark.skipif(
    not shutil.which("unshare") or subprocess.run(["unshare", "-m", "true"], capture_output=True).returncode != 0,
    reason="mounts a small disk, which only root may",
)


@pytest.mark.farm
@needs_mounts
@pytest.mark.parametrize("options", ["size=64k", "size=64m,ro"], ids=["full", "read-only"])
def test_a_disk_that_takes_no_kernel_is_left_for_a_temporary_folder(temporary, tmp_path, options):
    """If a disk takes no kernel, a temporary folder is used, as Warp's compiler ends the process when the disk is
    full.
    """
    (tmp_path / "disk").mkdir()
    mounting = f'mount -t tmpfs -o {options} small {tmp_path / "disk"} && exec "$@"'
    before = ["unshare", "-m", "bash", "-c", mounting, "bash"]
    assert work(tmp_path / "disk", temporary, before=before).is_relative_to(temporary)


@pytest.mark.farm
@needs_mounts
def test_a_cache_that_may_only_be_read_is_read(cache, tmp_path):
    mounting = f'mount --bind {cache} {cache} && mount -o remount,bind,ro {cache} && exec "$@"'
    assert work(cache, tmp_path, before=["unshare", "-m", "bash", "-c", mounting, "bash"]).parent == cache


def test_a_folder_that_others_may_write_is_not_trusted(tmp_path, monkeypatch):
    """A folder that others may write to is not trusted, as its kernels would be other people's code."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    own = kernel_cache.temporary_folder()
    assert own == kernel_cache.temporary_folder() and own.parent == tmp_path
    own.chmod(0o777)
    assert kernel_cache.temporary_folder() != own
    own.rmdir()
    (tmp_path / "elsewhere").mkdir(mode=0o700)
    own.symlink_to(tmp_path / "elsewhere")
    assert kernel_cache.temporary_folder() != own
    own.unlink()
    own.write_text("")
    assert kernel_cache.temporary_folder() != own


@pytest.mark.farm
def test_without_any_folder_one_sentence(tmp_path):
    (tmp_path / "file").write_text("")
    blocked = tmp_path / "file" / "cache"
    program = (
        "import tempfile\n"
        f"tempfile.tempdir = {str(blocked)!r}\n"
        "from hair_addon.core.errors import HairError\n"
        "try:\n"
        "    from hair_addon.core.geometry.faces import connected_components\n"
        "except HairError as error:\n"
        "    print(error)\n"
    )
    environment = os.environ | {"PYTHONPATH": str(ROOT), "WARP_CACHE_PATH": str(blocked)}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=False)
    assert done.stdout.splitlines()[-1] == "Kernels cannot be compiled: no folder for them can be written."
