# SPDX-License-Identifier: GPL-3.0-or-later
"""Truncated pictures are detected without decoding, wherever they were cut."""

import io
import os

import numpy as np
import OpenEXR
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.imaging import picture_checks

COMPRESSIONS = (
    OpenEXR.NO_COMPRESSION,
    OpenEXR.RLE_COMPRESSION,
    OpenEXR.ZIPS_COMPRESSION,
    OpenEXR.ZIP_COMPRESSION,
    OpenEXR.PIZ_COMPRESSION,
    OpenEXR.PXR24_COMPRESSION,
    OpenEXR.B44_COMPRESSION,
    OpenEXR.DWAA_COMPRESSION,
    OpenEXR.DWAB_COMPRESSION,
)


def write_exr(path, rng, compression=OpenEXR.ZIP_COMPRESSION, parts=1, height=70):
    header = {"compression": compression, "type": OpenEXR.scanlineimage}
    planes = {name: rng.random((height, 40), dtype=np.float32) for name in "RGB"}
    made = [OpenEXR.Part(dict(header, name=f"part {index}"), dict(planes), f"part {index}") for index in range(parts)]
    OpenEXR.File(made).write(str(path))
    return path


def cuts(size):
    """Return lengths to which a file may have been cut: a few bytes less, few bytes left, and some between."""
    return sorted({0, 1, 7, 8, 9, size // 3, size // 2, size - 100, size - 2, size - 1} | set(range(10, size, 997)))


def assert_cuts_are_found(path):
    content = path.read_bytes()
    assert picture_checks.is_whole(path) and not picture_checks.is_broken(path)
    for length in cuts(len(content)):
        path.write_bytes(content[:length])
        assert not picture_checks.is_whole(path), length
    path.write_bytes(content)
    picture_checks.require_whole(path, path)


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_a_cut_exr_is_found(tmp_path, rng, compression):
    assert_cuts_are_found(write_exr(tmp_path / "f.exr", rng, compression))


def test_a_cut_exr_of_many_parts_is_found(tmp_path, rng):
    """A truncated EXR of many parts is detected, although its headers are longer than what is read first."""
    path = write_exr(tmp_path / "f.exr", rng, parts=300)
    content = path.read_bytes()
    assert picture_checks.is_whole(path) and content.rindex(b"part 299") > 65_536
    for length in (65_536, 70_000, len(content) // 2, len(content) - 1):
        path.write_bytes(content[:length])
        assert not picture_checks.is_whole(path), length


def test_an_exr_that_was_never_finished_is_found(tmp_path, rng):
    """An EXR that was never finished is detected, as OpenEXR writes the table of chunks last."""
    path = write_exr(tmp_path / "f.exr", rng, OpenEXR.NO_COMPRESSION, height=2)
    content = bytearray(path.read_bytes())
    place = len(content) - 2 * (8 + 40 * 12) - 16
    assert int.from_bytes(content[place : place + 8], "little") == place + 16
    content[place : place + 8] = bytes(8)
    path.write_bytes(content)
    assert not picture_checks.is_whole(path) and picture_checks.is_broken(path)


def test_what_is_no_picture_is_not_whole(tmp_path):
    for name in ("f.png", "f.exr"):
        path = tmp_path / name
        assert not picture_checks.is_whole(path) and not picture_checks.is_broken(path)
        path.write_bytes(b"")
        assert not picture_checks.is_whole(path) and picture_checks.is_broken(path)
        path.write_text("A text of somebody's.")
        assert not picture_checks.is_whole(path) and not picture_checks.is_broken(path)
        with pytest.raises(HairError, match="is incomplete"):
            picture_checks.require_whole(path, name)
        path.unlink()
        path.mkdir()
        assert not picture_checks.is_whole(path) and not picture_checks.is_broken(path)
        path.rmdir()
        os.mkfifo(path)
        assert not picture_checks.is_whole(path) and not picture_checks.is_broken(path)


def test_a_small_part_of_a_frame_is_read_to_check_it(tmp_path, rng, monkeypatch):
    """Only a small part of a frame is read to check it, as a sequence of a thousand frames is checked at its start."""
    path, counts = write_exr(tmp_path / "f.exr", rng, height=4320), []

    class Counted(io.BufferedReader):
        def read(self, size=-1):
            found = super().read(size)
            counts.append(len(found))
            return found

    def opened(path, mode, **details):
        return Counted(io.FileIO(path, mode, **details))

    monkeypatch.setattr(picture_checks, "open", opened, raising=False)
    assert picture_checks.is_whole(path)
    assert 0 < sum(counts) < 0.1 * path.stat().st_size
