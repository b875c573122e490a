# SPDX-License-Identifier: GPL-3.0-or-later
"""Damaged, foreign and hostile files in a folder of frames count as missing frames, reported once."""

import dataclasses
import json
import os
import random
import zipfile
from pathlib import Path

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.files import array_file, frame_manifest
from hair_addon.core.files.frame_cache import FrameCache, remove
from tests.support.cached_frames import bake, frame_bytes, manifest, points_of, reported
from tests.support.mutants.changes import mutated


@pytest.fixture
def folder(tmp_path):
    """Return a folder with the frames -2 to 3."""
    bake(tmp_path / "cache", range(-2, 4))
    return tmp_path / "cache"


def test_a_frame_cut_at_any_byte_is_missing(folder):
    path = folder / "+00000001.npz"
    data = path.read_bytes()
    assert data == frame_bytes()
    layout = manifest().frame_layout
    for length in range(len(data)):
        assert array_file.decoded(data[:length], layout) is None
    for length in (0, 1, 60, len(data) // 2, len(data) - 1):
        path.write_bytes(data[:length])
        cache = FrameCache(folder)
        assert cache.read_frame(1) is None and cache.read_frame(1) is None
        assert len(reported(cache)) == 1  # once
    path.write_bytes(data + b"\0")
    assert FrameCache(folder).read_frame(1) is None


def check_mutants(count, seed):
    """Assert that a mutant is refused and never read as another frame."""
    source = random.Random(seed)
    data, layout = frame_bytes(), manifest().frame_layout
    manifest_data = json.dumps(
        {"format": frame_manifest.FORMAT, "version": 1} | dataclasses.asdict(manifest())
    ).encode()
    assert array_file.decoded(data, layout) is not None
    assert frame_manifest.parsed(manifest_data, Path("m")) == manifest()
    for _ in range(count):
        mutant = mutated(data, source)
        assert mutant == data or array_file.decoded(mutant, layout) is None
        try:
            found = frame_manifest.parsed(mutated(manifest_data, source), Path("m"))
        except HairError:
            continue
        assert array_file.size_of(found.frame_layout) <= array_file.MOST_BYTES
        assert array_file.size_of(found.state_file_layout) <= array_file.MOST_BYTES


def test_mutants_are_refused():
    check_mutants(3_000, 1)


@pytest.mark.long
def test_a_million_mutants_are_refused():
    check_mutants(1_000_000, 2)


def foreign(kind, path):
    """Replace a frame by another file."""
    data = path.read_bytes()
    path.unlink()
    if kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind in ("link", "link to itself", "link to nothing"):
        targets = {"link": path.with_name("+00000002.npz"), "link to itself": path}
        os.symlink(targets.get(kind, "/nowhere"), path)
    elif kind == "future":
        path.write_bytes(data.replace(b"'<f4'", b"'<f8'"))
    elif kind == "other frame":
        path.write_bytes(frame_bytes(2))
    elif kind == "other key":
        path.write_bytes(frame_bytes(1, manifest(settings=9)))
    elif kind == "sparse":
        with open(path, "wb") as file:
            file.truncate(2**40)
    elif kind == "bomb":
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("points.npy", bytes(2**24))
    elif kind == "huge header":
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("points.npy", b"\x93NUMPY\x02\x00" + (2**20).to_bytes(4, "little") + b"[" * 2**20)
    elif kind == "pickle":
        np.savez(path, points=np.array([{"a": 1}]))
    elif kind == "NumPy's own":
        np.savez(path, key=np.zeros(16, np.uint8), points=points_of(1))
    elif kind == "NaN":
        forged = array_file.decoded(data, manifest().frame_layout) | {"points": points_of(1) * np.float32(np.nan)}
        parts = array_file._file_of(manifest().frame_layout, {k: v.tobytes() for k, v in forged.items()})
        path.write_bytes(b"".join(parts))


FOREIGN = [
    "folder",
    "pipe",
    "link",
    "link to itself",
    "link to nothing",
    "future",
    "other frame",
    "other key",
    "sparse",
]
FOREIGN += ["bomb", "huge header", "pickle", "NumPy's own", "NaN"]


@pytest.mark.parametrize("kind", FOREIGN)
def test_whatever_else_stands_there_is_a_missing_frame(folder, kind):
    foreign(kind, folder / "+00000001.npz")
    cache = FrameCache(folder)
    assert cache.read_frame(1) is None and cache.points_at(0.5) is None
    assert len(reported(cache)) == 1
    assert cache.points_at(-1.5) is not None and cache.points_at(2.5) is not None and reported(cache) == []


@pytest.mark.parametrize("kind", [kind for kind in [*FOREIGN, "gone"] if kind not in {"future", "NaN"}])
def test_without_a_manifest_nothing_is_read_or_removed(folder, kind):
    foreign(kind, folder / frame_manifest.NAME)
    names = sorted(os.listdir(folder))
    cache = FrameCache(folder)
    assert cache.manifest is None and cache.read_frame(1) is None and cache.read_state(1) is None
    with pytest.raises(HairError):
        remove(folder)
    assert sorted(os.listdir(folder)) == names


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("guide_count", 0),
        ("guide_count", 10**30),
        ("guide_count", 3.0),
        ("guide_count", True),
        ("point_count", 258),
        ("first", 10),
        ("first", -(10**9)),
        ("fps", float("nan")),
        ("fps", 0),
        ("fps", 10**400),
        ("fps", "24"),
        ("state", "baked"),
        ("keys", []),
        ("keys", [{"a": 1}]),
        ("keys", [{}] * 65),
        ("keys", None),
        ("state_layout", {"x": ["|O", [1]]}),
        ("state_layout", {"x": ["<f4", [2**28]]}),
        ("state_layout", {"frame": ["<f4", [1]]}),
        ("state_layout", {"x": ["<f4", 3]}),
        ("notes", [["a"]]),
        ("notes", [["\ud800", "b"]]),
        ("version", 2),
        ("another", 1),
    ],
    ids=lambda value: str(value)[:16],
)
def test_manifests_of_no_simulation_are_refused(folder, name, value):
    path = folder / frame_manifest.NAME
    found = json.loads(path.read_text())
    path.write_text(json.dumps(found | {name: value}))
    cache = FrameCache(folder)
    assert cache.manifest is None and len(reported(cache)) == 1
