# SPDX-License-Identifier: GPL-3.0-or-later
"""Ctrl-C and SIGTERM during work end it with one message, its own exit status, and only complete files."""

import contextlib
import os
import pty
import signal
import subprocess
import time

import bpy
import pytest

from hair_addon import api
from hair_addon.command_line import helpers, render
from hair_addon.command_line.interruption import Interruption
from hair_addon.core.files.file_lock import claim
from hair_addon.core.long_work import Stopped
from tests.support.commands import HEAD, PYTHONPATH, command, run_here

LONG = ("groom", HEAD, "--guides", 4000, "--relax-iterations", 1000, "--strands", 100)
ENVIRONMENT = os.environ | {"PYTHONPATH": PYTHONPATH}


class Terminal:
    """A terminal for a command's standard error."""

    def __init__(self):
        self.reading, self.writing = pty.openpty()
        self.reported = ""

    def wait_for(self, words, seconds=300.0):
        """Read until given words were printed."""
        end = time.monotonic() + seconds
        while words not in self.reported:
            assert time.monotonic() < end, self.reported
            self.reported += os.read(self.reading, 4096).decode()

    def rest(self):
        """Return everything printed, once the command has ended."""
        os.close(self.writing)
        try:
            while part := os.read(self.reading, 4096).decode():
                self.reported += part
        except OSError:  # Linux ends a terminal that nobody writes to any more with an error
            pass
        os.close(self.reading)
        return self.reported


class AtWords:
    """A stream that calls a function when given words are written."""

    def __init__(self, stream, words, call):
        self._stream, self._words, self._call = stream, words, call

    def write(self, text):
        """Write the text, then call the function."""
        written = self._stream.write(text)
        if self._words in text and self._call:
            call, self._call = self._call, None
            call()
        return written

    def __getattr__(self, name):
        return getattr(self._stream, name)


# The line of progress is erased: only this sentence stays.
STOPPED = "vellus: stopped: unfinished results were not written.\r\n"


def left_on(terminal):
    """Return the unread output on a terminal after the command has ended."""
    return terminal.rest().rpartition("\r\x1b[K")[2]


@pytest.mark.farm
def test_long_work_ends_at_its_next_step(tmp_path):
    """Ctrl-C ends long work at its next step, with exit status and one sentence on the terminal."""
    terminal, out = Terminal(), tmp_path / "new" / "out.npz"
    process = subprocess.Popen(
        command(*LONG, "--out", out), stdout=subprocess.PIPE, stderr=terminal.writing, env=ENVIRONMENT, cwd=tmp_path
    )
    terminal.wait_for("Spreading guides: ")
    process.send_signal(signal.SIGINT)
    printed = process.communicate(timeout=600)[0]
    assert (process.returncode, printed) == (130, b"")
    assert left_on(terminal) == STOPPED
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


@pytest.mark.farm
def test_a_request_to_end_has_a_status_of_its_own(tmp_path):
    """SIGTERM ends work as Ctrl-C does, with status 143; the test runs the command in its own process."""
    terminal = Terminal()
    with open(terminal.writing, "w", closefd=False) as writing:
        asking = AtWords(writing, "Spreading guides: ", lambda: signal.raise_signal(signal.SIGTERM))
        ended = run_here(*LONG, "--out", tmp_path / "new" / "out.npz", terminal=asking)
    assert (ended.status, ended.out) == (143, "")
    assert left_on(terminal) == STOPPED
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


def test_progress_is_for_terminals_only(tmp_path):
    words = ("groom", HEAD, "--guides", 50, "--strands", 100, "--out", tmp_path / "out.npz")
    ended = run_here(*words)
    assert (ended.status, ended.errors) == (0, "")
    for quiet, expected in (((), True), (("--quiet",), False)):
        terminal = Terminal()
        with open(terminal.writing, "w", closefd=False) as writing:
            assert run_here(*words, *quiet, terminal=writing).status == 0
        reported = terminal.rest()
        assert ("Spreading guides" in reported) is expected
        assert reported.rpartition("\r\x1b[K")[2] == ""


@pytest.mark.farm
@pytest.mark.parametrize("killed", [1, 2], ids=["one", "all"])
def test_frames_of_a_killed_worker_are_rendered_by_the_other(lit, tmp_path, monkeypatch, killed):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    processes, sentence_of, real = [], render._sentence, subprocess.Popen
    (tmp_path / "out").mkdir()
    last = contextlib.ExitStack()  # the claim of the last frame, so that no worker ends before one is killed
    last.enter_context(claim(tmp_path / "out" / "f_04.png"))

    def started(*words, **details):
        processes.append(real(*words, **details))
        if killed == 2:  # before it has a frame
            processes[-1].kill()
            last.close()
        return processes[-1]

    def told(values):
        """Kill the worker when the first frame is there, whether it renders another frame or not."""
        processes[0].kill()
        last.close()
        return sentence_of(values)

    monkeypatch.setattr(helpers.subprocess, "Popen", started)
    monkeypatch.setattr(render, "_sentence", told)
    monkeypatch.setenv("PYTHONPATH", PYTHONPATH)
    words = ("render", tmp_path / "shot.blend", "--frames", "1-4", "--width", 64, "--height", 48, "--samples", 1)
    ended = run_here(*words, "--jobs", 2, "--out", tmp_path / "out" / "f_##.png")
    frames = sorted(path.name for path in (tmp_path / "out").iterdir() if not path.name.startswith("."))
    left = [path.name for path in (tmp_path / "out").glob(".vellus*")]
    if killed == 2:
        assert ended.status == 1 and ended.errors == "vellus: A worker process was killed by signal 9.\n"
        assert frames == []
        return
    assert (ended.status, frames, left) == (0, [f"f_{number:02}.png" for number in range(1, 5)], [])
    assert ended.errors == (
        "vellus: warning: all frames are rendered, but not by all processes: A worker process was killed by signal 9.\n"
    )


def test_a_second_ctrl_c_does_not_wait():
    before = signal.getsignal(signal.SIGINT)  # ignored, where a shell has put the tests in the background
    with Interruption() as interruption:
        signal.raise_signal(signal.SIGINT)
        assert interruption.is_asked
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert interruption.status == 130
    assert signal.getsignal(signal.SIGINT) is before


def test_a_progress_callback_can_stop_a_script(sphere):
    """A progress callback can stop a function of the API, which then leaves nothing in the scene."""

    def stop(_step, part):
        if part > 0.3:
            raise Stopped

    with pytest.raises(Stopped):
        api.add_hair(sphere, progress=stop)
    assert not bpy.data.hair_curves
