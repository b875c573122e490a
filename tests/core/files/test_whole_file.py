# SPDX-License-Identifier: GPL-3.0-or-later
"""Files are written atomically, several of them together, without leftovers."""

import os

import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.files.atomic_file import atomic_file, atomic_files, require_writable_path


@pytest.fixture
def paths(tmp_path):
    for name in "ab":
        (tmp_path / name).write_text("before")
    return [tmp_path / "a", tmp_path / "b"]


def test_files_take_their_places_together(paths):
    with atomic_files(paths) as partials:
        for partial in partials:
            partial.write_text("after")
        assert [path.read_text() for path in paths] == ["before", "before"]
    assert [path.read_text() for path in paths] == ["after", "after"]
    assert sorted(paths[0].parent.iterdir()) == paths


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), RuntimeError("Error: no exporter")])
def test_after_an_error_all_is_as_before(paths, error):
    with pytest.raises(HairError, match=r"a cannot be written: (No space left on device|no exporter)\.$"):
        with atomic_files(paths) as partials:
            partials[0].write_text("after")
            raise error
    assert [path.read_text() for path in paths] == ["before", "before"]
    assert sorted(paths[0].parent.iterdir()) == paths


def test_a_file_that_nobody_wrote_or_that_is_empty_is_refused(paths):
    for content in (None, ""):
        with pytest.raises(HairError, match="b was not written"), atomic_files(paths) as partials:
            partials[0].write_text("after")
            if content is not None:
                partials[1].write_text(content)
    assert [path.read_text() for path in paths] == ["before", "before"]


def test_the_file_is_named_as_its_format_demands(tmp_path):
    """A file has the name extension of its format while it is written, in the folder to which its paths may be
    relative.
    """
    with atomic_file(tmp_path / "new" / "hair.usdc") as partial:
        assert partial.suffix == ".usdc" and partial.parent == tmp_path / "new"
        partial.write_text("after")
    assert os.listdir(tmp_path / "new") == ["hair.usdc"]


@pytest.mark.parametrize("name", ["folder", "pipe", "file/below", "null\0character", "x" * 300, "\udcff\ud800"])
def test_what_is_no_place_for_a_file_is_refused_before_anything_is_written(tmp_path, name):
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").touch()
    os.mkfifo(tmp_path / "pipe")
    for refuses in (require_writable_path, lambda path: atomic_file(path).__enter__()):
        with pytest.raises(HairError):
            refuses(tmp_path / name)
    assert sorted(os.listdir(tmp_path)) == ["file", "folder", "pipe"]
