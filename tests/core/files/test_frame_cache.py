# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames are restored bit by bit, motion between frames is smooth, and files are written atomically."""

import dataclasses
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.files import frame_cache, frame_manifest, untrusted_file
from hair_addon.core.files.frame_cache import FrameCache, baking, between, remove
from tests.support import folder_digest
from tests.support.cached_frames import (
    DIGEST,
    ENVIRONMENT,
    ROOT,
    bake,
    check_whole,
    manifest,
    points_of,
    reported,
)


@pytest.fixture
def folder(tmp_path):
    """Return a folder with the frames -2 to 3."""
    bake(tmp_path / "cache", range(-2, 4))
    return tmp_path / "cache"


# Round trips.


def test_frames_and_states_come_back_bit_by_bit(folder):
    assert check_whole(folder) == (list(range(-2, 4)), list(range(-2, 4)))
    cache = FrameCache(folder)
    assert cache.read_frame(0).digest == DIGEST and cache.read_frame(0).key == manifest().key
    assert cache.manifest == dataclasses.replace(manifest(), state="complete")
    assert cache.read_frame(4) is None and cache.read_state(99) is None and reported(cache) == []
    assert sorted(path.name for path in folder.iterdir())[:3] == ["+00000000.npz", "+00000001.npz", "+00000002.npz"]


def test_the_manifest_comes_back(tmp_path):
    wanted = manifest(notes=(("Collider ü", "no faces"),), fps=23.976, state="part", state_layout={})
    frame_manifest.write(tmp_path, wanted)
    assert frame_manifest.read(tmp_path) == wanted


def test_a_key_follows_from_every_part():
    """A key depends on every part: on types, shapes and bits of arrays and on names of parts, but not on their
    order.
    """
    zeros = [np.zeros(4, "f4"), np.zeros((2, 2), "f4"), np.zeros(2, "f8"), np.zeros(4, "i4"), -np.zeros(4, "f4")]
    parts = [{"a": 1}, {"b": 1}, {"a": "1"}, {"a": [1]}, {"a": 1, "b": None}, *({"a": array} for array in zeros)]
    keys = [frame_manifest.key_of(frame_manifest.digests_of(part)) for part in parts]
    assert len(set(keys)) == len(keys)
    one, other = ({"a": 1, "b": zeros[0]}, {"b": np.zeros(8, "f4")[::2], "a": 1})
    assert frame_manifest.digests_of(one) == frame_manifest.digests_of(other)
    assert len({frame_manifest.key_of(frame_manifest.digests_of(parts)) for parts in (one, other)}) == 1


def test_frames_of_an_earlier_simulation_stay_and_are_told_apart(folder):
    bake(folder, [2, 3], manifest(settings=2))
    cache = FrameCache(folder)
    keys = [cache.read_frame(number).key for number in range(-2, 4)]
    assert [cache.manifest.changed_parts(key) for key in keys] == [["settings"]] * 4 + [[]] * 2
    assert cache.read_state(3) is not None and cache.read_state(1) is None
    assert len(reported(cache)) == 1
    bake(folder, [0], manifest(settings=1))
    cache = FrameCache(folder)
    assert [cache.manifest.changed_parts(cache.read_frame(n).key) for n in (-2, 0, 3)] == [[], [], ["settings"]]
    assert len(cache.manifest.keys) == 2


def test_a_folder_keeps_frames_of_one_set_of_guides(folder):
    with pytest.raises(HairError, match="other guides"), baking(folder, manifest(guide_count=4)):
        pass
    check_whole(folder)


# Between frames.


def test_cubic_motion_is_exact_between_frames(rng):
    a, b, c, d = rng.normal(size=(4, 2, 3, 3))
    frames = [(((a * t + b) * t + c) * t + d).astype(np.float32) for t in (-1.0, 0.0, 1.0, 2.0)]
    for t in (0.0, 0.2, 0.5, 0.9, 1.0):
        np.testing.assert_allclose(between(*frames, t), ((a * t + b) * t + c) * t + d, atol=2e-6)
        for ends in ((None, frames[3]), (frames[0], None), (None, None)):
            linear = frames[1] + t * (frames[2] - frames[1])
            np.testing.assert_allclose(between(ends[0], frames[1], frames[2], ends[1], t), linear, atol=1e-6)


def test_points_at_any_time(folder):
    cache = FrameCache(folder)
    np.testing.assert_array_equal(cache.points_at(2.0), points_of(2))
    np.testing.assert_array_equal(cache.points_at(-2.0), points_of(-2))
    cubic = between(*(points_of(number) for number in (-1, 0, 1, 2)), 0.25)
    np.testing.assert_array_equal(cache.points_at(0.25), cubic)
    np.testing.assert_array_equal(cache.points_at(2.5), between(None, points_of(2), points_of(3), None, 0.5))
    assert cache.points_at(3.5) is None and cache.points_at(-2.5) is None and reported(cache) == []


# Writing.


def test_a_frame_that_is_not_the_manifests_is_refused(folder):
    with baking(folder, manifest()) as writer:
        for points in (points_of(1, 4), points_of(1)[:, :4], points_of(1) * np.float32(np.inf)):
            with pytest.raises(HairError), np.errstate(all="ignore"):
                writer.write_frame(1, points, DIGEST)
        with pytest.raises(HairError):
            writer.write_state(1, {"x": np.zeros((2, 4), np.float32)})
    check_whole(folder)
    assert FrameCache(folder).manifest.state == "part"


def test_disk_full_at_fifty_places(folder):
    """A disk that becomes full at any of fifty places keeps the frames; a limit on the size of files stands in for
    it.
    """
    _, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    largest = max(path.stat().st_size for path in folder.iterdir()) + 66_000
    refused = 0
    for limit in [*range(0, 1500, 50), *range(1500, largest, (largest - 1500) // 20)]:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, hard))
        try:
            bake(folder, [1, 2, 4])
        except HairError as error:
            refused += "File too large" in str(error)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))
        check_whole(folder)
        assert [path.name for path in folder.glob(".*")] == [frame_cache.MARKER]
    assert refused > 40
    bake(folder, [4])
    assert check_whole(folder)[0] == list(range(-2, 5))


def test_a_folder_that_goes_away_is_reported(folder):
    with pytest.raises(HairError, match="lost its manifest"), baking(folder, manifest()) as writer:
        remove_all(folder)
        writer.write_frame(1, points_of(1), DIGEST)
    assert not folder.exists()
    (folder.parent / "file").touch()
    for place in (folder.parent / "file", folder.parent / "file" / "below", Path("null\0character")):
        with pytest.raises(HairError), baking(place, manifest()):
            pass


def remove_all(folder):
    for path in folder.iterdir():
        path.unlink()
    folder.rmdir()


KILLED = """
import os, random, signal, sys, time
from pathlib import Path
from tests.support.cached_frames import bake
folder, count, seed = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
chance = random.Random(seed)
for _ in range(count):
    child = os.fork()
    if not child:
        while True:
            bake(folder, range(-2, 4))
    time.sleep(chance.uniform(0.001, 0.05))
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
"""


def check_killed(folder, rounds, kills):
    for seed in range(rounds):
        line = [sys.executable, "-c", KILLED, str(folder), str(kills), str(seed)]
        subprocess.run(line, env=ENVIRONMENT, cwd=ROOT, check=True, timeout=1200)
        check_whole(folder)
    bake(folder, range(-2, 4))
    assert check_whole(folder)[0] == list(range(-2, 4))
    assert [path.name for path in folder.glob(".*")] == [frame_cache.MARKER]


def test_frames_are_whole_after_kills(tmp_path):
    check_killed(tmp_path / "cache", 1, 10)


@pytest.mark.long
def test_frames_are_whole_after_each_of_two_hundred_kills(tmp_path):
    check_killed(tmp_path / "cache", 200, 1)


HOLD = """
import sys, time
from pathlib import Path
from tests.support.cached_frames import *
with baking(Path(sys.argv[1]), manifest()) as writer:
    writer.write_frame(1, points_of(1), DIGEST)
    print("baking", flush=True)
    time.sleep(60)
"""


def test_one_process_bakes_while_others_read(folder):
    line = [sys.executable, "-c", HOLD, str(folder)]
    with subprocess.Popen(line, env=ENVIRONMENT, cwd=ROOT, stdout=subprocess.PIPE) as holder:
        assert holder.stdout.readline() == b"baking\n"
        cache = FrameCache(folder)
        assert cache.manifest.state == "baking"
        assert cache.read_frame(1) is not None
        for change in (lambda: bake(folder, [1]), lambda: remove(folder)):
            with pytest.raises(HairError, match="another process"):
                change()
        holder.send_signal(signal.SIGKILL)
    assert cache.read_manifest().state == "baking"
    bake(folder, [1])
    assert cache.read_manifest().state == "complete"


def test_a_file_that_another_program_holds_is_tried_three_times(folder, monkeypatch):
    """A file that another program holds is read three times, as virus scanners on Windows block access briefly."""
    monkeypatch.setattr(time, "sleep", lambda _seconds: None)
    tries = []

    def held(function, busy):
        def call(*arguments):
            tries.append(arguments)
            if len(tries) % 3 != busy:
                raise PermissionError(13, "Permission denied")
            return function(*arguments)

        return call

    cache = FrameCache(folder)
    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", held(os.replace, 0))
        bake(folder, [1])
    assert len(tries) == 12
    with monkeypatch.context() as patch:
        patch.setattr(untrusted_file.os, "open", held(os.open, 0))
        assert cache.read_frame(1) is not None
    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", held(os.replace, 4))
        with pytest.raises(HairError, match="Permission denied"):
            bake(folder, [1])
    check_whole(folder)


# Removing.


def test_only_names_of_ours_are_removed_and_never_through_links(folder, tmp_path):
    kept = tmp_path / "kept.npz"
    kept.write_bytes(b"kept")
    others = ["00000001.npz", "+0000001.npz", "+00000001.npz.bak", "-00000000.npz", "x+00000001.npz", "state.npz"]
    for name in others:
        (folder / name).touch()
    os.symlink(kept, folder / "+00000050.npz")
    (folder / "+00000051.npz").mkdir()
    (folder / ".vellus_0123abcd.npz").touch()
    assert remove(folder, [1, 2, 50, 51]) == 4
    assert FrameCache(folder).frame_numbers() == [-2, -1, 0, 3, 50, 51]
    assert remove(folder) == 4 * 2 + 1
    assert sorted(os.listdir(folder)) == sorted([*others, "+00000050.npz", "+00000051.npz", frame_cache.MARKER])
    assert kept.read_bytes() == b"kept"


def test_a_folder_of_frames_alone_is_removed_with_them(folder):
    assert remove(folder) == 12 and not folder.exists()


def test_a_folder_that_is_a_link_keeps_its_frames(folder, tmp_path):
    os.symlink(folder, tmp_path / "link", target_is_directory=True)
    with pytest.raises(HairError, match="is a link"):
        remove(tmp_path / "link")
    check_whole(folder)


def linked(folder, victim):
    os.symlink(victim, folder)


def with_files(folder, victim):
    shutil.copytree(victim, folder)


def with_claim_link(folder, victim):
    folder.mkdir()
    os.symlink(victim / "made", folder / ".manifest.json.claim")


def with_marker_link(folder, victim):
    with_files(folder, victim)
    (victim / "marker").write_bytes(b"Baked frames of Vellus\n")
    os.symlink(victim / "marker", folder / frame_cache.MARKER)


def with_other_marker(folder, victim):
    with_files(folder, victim)
    (folder / frame_cache.MARKER).write_bytes(b"mine")


PREPARED = [linked, with_files, with_claim_link, with_marker_link, with_other_marker]


@pytest.mark.parametrize("prepare", PREPARED, ids=lambda prepare: prepare.__name__)
def test_nothing_is_written_to_a_folder_that_others_have_prepared(tmp_path, prepare):
    """Nothing is written to a folder of others, such as a web application with its own manifest.json and numbered
    files.
    """
    victim, folder = tmp_path / "application", tmp_path / "cache"
    victim.mkdir()
    (victim / "manifest.json").write_text('{"name": "application"}')
    (victim / "+00000001.npz").write_bytes(b"mine")
    prepare(folder, victim)
    before = [folder_digest.of_folder(one) for one in (victim, folder)], sorted(os.listdir(folder))
    with pytest.raises(HairError, match=r"is a link|another program|cannot be written"):
        bake(folder, [1, 2])
    assert ([folder_digest.of_folder(one) for one in (victim, folder)], sorted(os.listdir(folder))) == before
    with pytest.raises(HairError):
        remove(folder)
    assert folder_digest.of_folder(victim) == before[0][0]


def test_a_folder_is_identified_by_its_marker(folder):
    """The marker identifies the folder with a damaged manifest, and with a foreign file in place of the frames."""
    (folder / "manifest.json").write_bytes(b"damaged")
    bake(folder, [1])
    assert check_whole(folder)[0][:1] == [-2]
    (folder / "notes.txt").write_text("mine")
    remove(folder)
    assert sorted(os.listdir(folder)) == [frame_cache.MARKER, "notes.txt"]
    bake(folder, [1])
    (folder / "notes.txt").unlink()
    (folder / frame_cache.MARKER).unlink()  # as older versions leave it
    bake(folder, [2])
    assert frame_cache.is_marked(folder) and check_whole(folder)[0] == [1, 2]
    remove(folder)
    assert not folder.exists()


def test_folders_are_named_by_identities_alone(tmp_path):
    identity = frame_cache.new_identity()
    assert frame_cache.folder_of(tmp_path, identity) == tmp_path / identity
    for other in ("", "..", "../0123456789abcdef", identity + "\n", identity.upper() + "A", "0" * 15, "٠" * 16):
        with pytest.raises(HairError):
            frame_cache.folder_of(tmp_path, other)
