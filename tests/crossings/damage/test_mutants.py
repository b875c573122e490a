# SPDX-License-Identifier: GPL-3.0-or-later
"""Damaged files make every reader raise one message or return valid values, without traceback, hang or crash."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.mutants import native, run, shares
from tests.support.mutants.readers import readers

ROOT = Path(__file__).resolve().parents[3]
ADDON = ROOT / "hair_addon"

# Calls that read what somebody else may have written.
READING = re.compile(
    r"(?:\bjson\.loads?|\bnp\.load|\bnp\.frombuffer|\btomllib\.loads|\bplain_file\.read|\bstruct\.unpack(?:_from)?"
    r"|\bZipFile|\bOpenEXR\.File|\bStage\.Open|\bimages\.load|\blibraries\.load|\.read_bytes|\.read_text|(?<![.\w])open)\("
)

# Modules that have no reader of `readers.py`, and why.
OTHERS = {
    # Read by native code, or by Blender: `native.py`, test_hostile_files.py, test_groom_library.py.
    "blender/data/maps/image_pixels.py": "Blender's images",
    "blender/data/pictures/rendered_files.py": "Blender's images",
    "blender/io/curve_files.py": "a .blend",
    "blender/io/groom_files.py": "what was just written",
    "core/files/glb.py": "what was just written",
    "blender/io/groom_library.py": "a .blend, whose settings are read by settings_file.py",
    "blender/io/mesh_files.py": "a USD or FBX file that was opened",
    "blender/io/usd/usd_stage.py": "USD",
    "blender/render/library_picture.py": "a picture that was just drawn",
    "core/files/light_images.py": "OpenEXR",
    "core/files/table_exr.py": "OpenEXR",
    # Files written by Vellus for itself, or by the system.
    "blender/gpu/programs/shaders.py": "the add-on's own shaders",
    "blender/data/strands/follow_nodes.py": "the add-on's own .blend",
    "blender/host/memory.py": "the system's",
    "blender/host/paths.py": "the add-on's own manifest",
    "blender/live/first_setup.py": "compared, not parsed",
    "blender/settings/fitted_sizes.py": "a property of an operator",
    "command_line/helpers.py": "lines of a process that was started, left out where they are not JSON",
    "core/files/frame_cache.py": "arrays that array_file.py has read",
    "core/files/untrusted_file.py": "bytes for the readers",
    "core/files/table_cache.py": "a number, 0 for anything else",
    "core/files/alembic/unreal_groom.py": "writes",
    "core/files/strands/writers.py": "writes",
    "core/files/atomic_file.py": "writes",
    "core/kernels/kernel_entries.py": "compared with a digest: test_kernel_cache.py",
    "core/kernels/native_code.py": "the add-on's own sources",
    # Written by this process, or by another for it, and read at once.
    "blender/host/background_process.py": "the errors of a process that it started",
    "blender/data/pictures/picture_jobs.py": "the reasons that another process has written for it",
    "blender/data/pictures/unsaved_images.py": "pixels that another process has written for it",
    "blender/data/pictures/surface_bakes.py": "pictures that another process has written; damaged ones are removed",
    "blender/io/pictures/background_jobs.py": "jobs of the process that started it",
    "blender/io/pictures/surface_bake.py": "the surfaces that another process has written for it",
    "blender/data/pictures/light_panoramas.py": "panoramas that another process has written; damaged ones are removed",
    "blender/io/pictures/world_panorama.py": "the world or light that another process has written for it",
}


def reading_modules():
    """Return the modules of the add-on that call one of `READING`."""
    paths = ADDON.rglob("*.py")
    return {path.relative_to(ADDON).as_posix() for path in paths if READING.search(path.read_text(encoding="utf-8"))}


def test_every_reader_has_mutants():
    """Every reader of the add-on has a file to damage in `readers.py`, or a reason why not."""
    known, reading = {reader.module for reader in readers().values()}, reading_modules()
    assert reading - known - OTHERS.keys() == set()
    assert OTHERS.keys() - reading == set()
    assert known & OTHERS.keys() == set() and all((ADDON / module).is_file() for module in known)


def test_a_few_mutants():
    read, refused, found = run.faults(930, seed=1)
    assert read == 930 and found == []
    # Readers of files with a checksum refuse all mutants except copies of the whole file.
    assert all(refused[name] >= 27 for name in ("settings", "frame", "arrays", "record of a sequence"))


def test_shares_of_a_campaign_are_all_of_it():
    whole = list(shares.numbers(1003, seed=4))
    assert [number for place in range(16) for number in shares.numbers(1003, 4, (place, 16))] == whole
    assert len(whole) == len(set(whole)) == 1003 and whole[0] == 4 * 10**9


@pytest.mark.long
def test_a_million_mutants():
    """A million mutants are read in a process with limited memory."""
    words = [sys.executable, "-m", "tests.support.mutants.run", "1000000", "2"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=7200, check=False)
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]


@pytest.mark.long
@pytest.mark.parametrize("name", native.NAMES)
def test_mutants_for_native_code(name):
    _told, found = native.faults(name, 50_000 // len(native.NAMES), seed=3)
    assert found == []
