# SPDX-License-Identifier: GPL-3.0-or-later
"""Each file that several processes create is created once, and killed processes block no others."""

import errno
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from hair_addon.core.files import file_lock
from hair_addon.core.files.file_lock import claim, claim_of

ROOT = Path(__file__).resolve().parents[3]
ENVIRONMENT = os.environ | {"PYTHONPATH": str(ROOT)}

HOLD = """
import sys, time
from hair_addon.core.files.file_lock import claim
with claim(sys.argv[1]) as is_ours:
    print(is_ours, flush=True)
    time.sleep(60)
"""

SHARE = """
import os, random, sys, time
from pathlib import Path
from hair_addon.core.files.file_lock import claim
paths = [Path(sys.argv[1]) / str(number) for number in range(40)]
random.shuffle(paths)
left = list(paths)
while left:
    for path in list(left):
        with claim(path) as is_ours:
            if not is_ours:
                continue
            if not path.exists():
                time.sleep(0.002 * random.random())
                with open(path, "a") as made:
                    made.write("once")
                with open(Path(sys.argv[1]) / "log", "a") as log:
                    log.write(f"{path.name}\\n")
            left.remove(path)
"""


def start(script, path):
    return subprocess.Popen([sys.executable, "-c", script, str(path)], stdout=subprocess.PIPE, env=ENVIRONMENT)


def test_a_file_is_one_process_s_at_a_time(tmp_path):
    with start(HOLD, tmp_path / "frame") as holder:
        assert holder.stdout.readline() == b"True\n"
        with claim(tmp_path / "frame") as is_ours:
            assert not is_ours
        with claim(tmp_path / "another") as is_ours:
            assert is_ours
        holder.send_signal(signal.SIGKILL)
    assert claim_of(tmp_path / "frame").exists()  # it had no time to take it away
    with claim(tmp_path / "frame") as is_ours:
        assert is_ours
    assert list(tmp_path.iterdir()) == []


def test_a_claim_ends_with_what_goes_wrong(tmp_path):
    with pytest.raises(ZeroDivisionError), claim(tmp_path / "frame"):
        raise ZeroDivisionError
    with claim(tmp_path / "frame") as is_ours:
        assert is_ours
    assert list(tmp_path.iterdir()) == []


def test_of_many_processes_one_makes_each_file(tmp_path):
    helpers = [start(SHARE, tmp_path) for _ in range(6)]
    for helper in helpers:
        helper.communicate(timeout=600)
    assert [helper.returncode for helper in helpers] == [0] * 6
    log = (tmp_path / "log").read_text().split()
    assert sorted(log, key=int) == [str(number) for number in range(40)]
    assert {(tmp_path / str(number)).read_text() for number in range(40)} == {"once"}
    assert not list(tmp_path.glob(".*"))


def test_without_locks_everybody_may(tmp_path, monkeypatch):
    def refuse(_descriptor):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(file_lock, "_lock", refuse)
    with claim(tmp_path / "frame") as is_ours, claim(tmp_path / "frame") as is_ours_too:
        assert is_ours and is_ours_too


def test_a_folder_that_is_not_there_is_an_error(tmp_path):
    with pytest.raises(OSError, match="No such file"), claim(tmp_path / "none" / "frame"):
        pass


@pytest.mark.parametrize("is_link", [True, False])
def test_what_others_have_put_in_place_of_a_claim_is_left_alone(tmp_path, is_link):
    """A link or a pipe in the place of a claim is left alone: no file is made behind it, and nobody waits for it."""
    beside = claim_of(tmp_path / "frame")
    if is_link:
        os.symlink(tmp_path / "victim", beside)
    else:
        os.mkfifo(beside)
    with pytest.raises(OSError, match=r"link|not a file"), claim(tmp_path / "frame"):
        pass
    assert [path.name for path in tmp_path.iterdir()] == [beside.name]
