# SPDX-License-Identifier: GPL-3.0-or-later
"""Folders of known frames, as written by simulations."""

import os
from pathlib import Path

import numpy as np

from hair_addon.core.files import array_file, frame_manifest
from hair_addon.core.files.frame_cache import FrameCache, baking
from hair_addon.core.files.frame_manifest import Manifest

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENT = os.environ | {"PYTHONPATH": str(ROOT)}
DIGEST = "0123456789abcdef" * 2


def manifest(guide_count=3, settings=1, **changes):
    given = {
        "keys": (frame_manifest.digests_of({"settings": [settings], "guides": np.arange(guide_count)}),),
        "guide_count": guide_count,
        "point_count": 5,
        "first": -2,
        "last": 9,
        "fps": 24.0,
        "state_layout": {"x": ("<f4", (2, 4)), "substep": ("<i8", ())},
    }
    return Manifest(**given | changes)


def points_of(number, guide_count=3):
    """Return the points of a frame, different in each frame."""
    return np.random.default_rng(number + 100).random((guide_count, 5, 3), dtype=np.float32)


def state_of(number):
    return {"x": np.full((2, 4), number, np.float32), "substep": np.array(number * 7, np.int64)}


def bake(folder, numbers, wanted=None):
    with baking(folder, wanted or manifest()) as writer:
        for number in numbers:
            writer.write_frame(number, points_of(number), DIGEST)
            writer.write_state(number, state_of(number))
        writer.complete()


def reported(cache):
    return [str(error) for error in cache.take_errors()]


def check_whole(folder, most_complaints=0):
    """Check that every listed frame and state equals what was written; returns their numbers."""
    cache = FrameCache(folder)
    for number in cache.frame_numbers():
        frame = cache.read_frame(number)
        assert frame is not None and frame.points.tobytes() == points_of(number).tobytes()
    for number in cache.state_numbers():
        state = cache.read_state(number)
        assert state is not None and {name: array.tobytes() for name, array in state.items()} == {
            name: array.tobytes() for name, array in state_of(number).items()
        }
    assert len(reported(cache)) <= most_complaints
    return cache.frame_numbers(), cache.state_numbers()


def frame_bytes(number=1, of=None):
    arrays = {
        "key": np.frombuffer(bytes.fromhex((of or manifest()).key), np.uint8),
        "frame": np.array(number, np.int64),
        "digest": np.frombuffer(bytes.fromhex(DIGEST), np.uint8),
        "points": points_of(number),
    }
    return b"".join(map(bytes, array_file.encoded(arrays)))
