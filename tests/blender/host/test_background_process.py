# SPDX-License-Identifier: GPL-3.0-or-later
"""One other process runs all jobs. It ends when it is idle, and with the process that started it."""

import gc
import os
import shutil
import subprocess
import sys
import tempfile
import textwrap
import threading
import time
from pathlib import Path

import pytest

from hair_addon.blender.host import background_process, cli_command
from hair_addon.blender.io.pictures import background_jobs

# A process in which jobs succeed, fail or crash as their kind says.
OTHER = """
import json, os, sys
from pathlib import Path
for line in sys.stdin:
    folder = Path(json.loads(line))
    kind = json.loads((folder / "job.json").read_text())["kind"]
    if kind == "lost":
        sys.exit(0)
    (folder / "begun").touch()
    if kind == "crash":
        os.abort()
    (folder / "ended.txt").write_text("" if kind == "works" else kind)
"""


@pytest.fixture
def job(tmp_path, monkeypatch):
    """Return a function that starts a job of a kind."""
    background_process.end()
    monkeypatch.setattr(cli_command, "words", lambda: [sys.executable, "-c", OTHER])

    def start(kind):
        return background_process.Job(Path(tempfile.mkdtemp(dir=tmp_path)), {"kind": kind})

    yield start
    background_process.end()


def test_jobs_have_one_process(job):
    """Jobs run in turn in one process. A job whose process ends before the job begins is sent to another process."""
    works, refused = job("works"), job("too bright")
    assert works._process is refused._process
    for one, complaint in ((works, ""), (refused, "too bright")):
        one.wait(20.0)
        assert one.complaint() == complaint
    shutil.rmtree(works._folder)
    assert works.is_ended()
    crash, queued = job("crash"), job("works")
    crash.wait(20.0)
    queued.wait(20.0)
    assert "ended with status" in crash.complaint() and queued.complaint() == ""
    lost = job("lost")
    lost.wait(20.0)
    assert lost.is_ended() and lost.complaint()


def test_a_process_that_cannot_start_again_ends_its_jobs(job, tmp_path, monkeypatch):
    """A job whose process was lost before the job began has ended if no other process can start, and says why."""
    monkeypatch.setattr(cli_command, "words", lambda: [sys.executable, "-c", "import time; time.sleep(60)"])
    lost = job("works")
    lost._process.end()
    monkeypatch.setattr(cli_command, "words", lambda: [str(tmp_path / "gone")])
    assert lost.is_ended() and lost.is_ended()
    assert "gone" in lost.complaint()


def test_temporary_files_are_removed(job, tmp_path, monkeypatch):
    """Files of the other process in the system's folder of temporary files are gone after its end, also if killed."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    words = [sys.executable, "-c", f"import tempfile; tempfile.mkdtemp()\n{OTHER}"]
    monkeypatch.setattr(cli_command, "words", lambda: words)
    one = job("works")
    one.wait(20.0)
    (folder,) = tmp_path.glob("vellus_*")
    assert any(each.is_dir() for each in folder.iterdir())
    background_process.end()
    del one
    gc.collect()
    assert not folder.exists()


def test_a_job_is_given_up_after_its_time(job, monkeypatch):
    monkeypatch.setattr(cli_command, "words", lambda: [sys.executable, "-c", "import time; time.sleep(60)"])
    late = job("works")
    late.wait(0.01)
    assert "seconds" in late.complaint()
    assert not late._process.is_running


def test_an_idle_process_ends(tmp_path, monkeypatch):
    """Without jobs the process returns from its work; at the end of its input it exits at once.

    Files that jobs or Blender write until then are removed with their folder.
    """
    exited, started, start = threading.Event(), [], subprocess.Popen

    def start_process(*arguments, **options):
        started.append(start(*arguments, **options))
        return started[-1]

    def write_and_exit(_status):
        (tmp_path / "blender_late").mkdir(parents=True, exist_ok=True)
        for each in started:
            each.communicate()  # closes its input, as the end of a process does
        exited.set()

    monkeypatch.setattr(subprocess, "Popen", start_process)
    monkeypatch.setattr(os, "_exit", write_and_exit)
    monkeypatch.setattr(background_process, "IDLE", 0.01)
    read, write = os.pipe()
    background_jobs.serve(read, tmp_path)
    assert not exited.is_set()
    os.close(write)
    assert exited.wait(20.0)
    os.close(read)
    assert not tmp_path.exists()


def test_a_job_that_was_dropped_is_left_out(tmp_path):
    background_jobs._run(tmp_path / "gone")


@pytest.mark.farm
def test_the_process_ends_with_its_parent(tmp_path):
    """When the parent is killed, the other process ends and leaves no folder behind, of jobs or temporary files."""
    folder = tmp_path / "job"
    folder.mkdir()
    told = tmp_path / "told"
    values = {"kind": "world", "sources": [["missing.blend", "World"]], "frame": 1.0, "is_coarse": True}
    code = f"""
        import time
        from pathlib import Path
        from hair_addon.blender.host import background_process
        job = background_process.Job(Path({str(folder)!r}), {values!r})
        Path({str(told)!r}).write_text(str(job._process._process.pid))
        time.sleep(60.0)
    """
    words = [sys.executable, "-c", textwrap.dedent(code)]
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    parent = subprocess.Popen(words, stdout=subprocess.DEVNULL, env=os.environ | {"TMPDIR": str(temporary)})
    end = time.monotonic() + 60.0
    while not (told.is_file() and told.read_text()) and time.monotonic() < end:
        time.sleep(0.05)
    other = int(told.read_text())
    assert _runs(other)
    parent.kill()
    parent.wait()
    while _runs(other) and time.monotonic() < end:
        time.sleep(0.05)
    assert not _runs(other) and _is_removed(folder)
    assert all(_is_removed(each) for each in temporary.iterdir() if not each.name.startswith("blender_"))
    assert len(list(temporary.iterdir())) <= 1  # of the parent, which was killed


def _is_removed(folder):
    """Whether a folder is gone, at the latest after some seconds."""
    end = time.monotonic() + 20.0
    while folder.exists() and time.monotonic() < end:
        time.sleep(0.02)
    return not folder.exists()


def _runs(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
