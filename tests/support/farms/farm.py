# SPDX-License-Identifier: GPL-3.0-or-later
"""A render farm on this machine: a `blender` for its workers, the steps of docs/farm, and checks of frames."""

import contextlib
import os
import re
import shlex
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import bpy
import OpenEXR

from tests.support.commands import ROOT
from tests.support.dynamics.swung import simulate, swing

DOCS = ROOT / "docs" / "farm"
COUNT = 8
FRAMES = [f"shot_{number:04}.exr" for number in range(1, COUNT + 1)]


def save_shot(path, samples=4):
    """Save a .blend with simulated, unbaked hair on a swinging sphere; needs the fixture `lit`."""
    scene = bpy.context.scene
    swing(bpy.data.objects["Sphere"])
    simulate(bpy.data.objects["Guides"], "//baked")
    scene.frame_start, scene.frame_end = 1, COUNT
    scene.render.resolution_x, scene.render.resolution_y, scene.vellus.sample_count = 64, 48, samples
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def write_blender(folder):
    """Write a program `blender` to a folder, which only runs the command line of Vellus; returns its path."""
    path = folder / "blender"
    words = ["exec", sys.executable, "-m", "hair_addon"]
    lines = ["#!/bin/sh", '[ "$1 $2" = "--command vellus" ] || exit 64', "shift 2"]
    lines += [f'PYTHONPATH={shlex.quote(str(ROOT))} {shlex.join(words)} "$@"']
    path.write_text("\n".join(lines) + "\n")
    path.chmod(0o755)
    return path


def documented(heading, replaced, kind="sh"):
    """Return the first code block under a heading of docs/farm; replaced: {words of the example: words of the test}."""
    section = (DOCS / "README.md").read_text(encoding="utf-8").split(f"\n## {heading}\n")[1].split("\n## ")[0]
    block = re.search(rf"```{kind}\n(.*?)```", section, re.DOTALL)[1]
    for example, here in replaced.items():
        assert example in block
        block = block.replace(example, str(here))
    return block


def require_whole(folder, names):
    """Assert that a folder has these pictures and no others, and read all pixels of each layer."""
    assert sorted(path.name for path in folder.glob("*.exr")) == sorted(names)
    for name in names:
        with OpenEXR.File(str(folder / name)) as picture:
            assert picture.parts and all(part.channels for part in picture.parts)
            for part in picture.parts:
                assert all(channel.pixels.shape[:2] == (48, 64) for channel in part.channels.values())
    assert not [path.name for path in folder.glob(".*") if not path.name.endswith(".json")]


def frames_told(text):
    """Return the numbers of frames that commands report as rendered."""
    return sorted(int(number) for number in re.findall(r"\bFrame (\d+) in \d", text))


def wait_for(found, seconds, pause=0.2):
    """Wait until `found()` returns a true value; returns it."""
    end = time.monotonic() + seconds
    while not (what := found()):
        assert time.monotonic() < end, f"waited {seconds} s for {found}"
        time.sleep(pause)
    return what


def processes_with(variable, value):
    """Return the ids of processes in whose environment a variable has a value."""
    for process in filter(str.isdigit, os.listdir("/proc")):
        if f"{variable}={value}" in _words(f"/proc/{process}/environ"):
            yield int(process)


def arguments_of(process):
    """Return the words of a process's command; none if it has ended."""
    return _words(f"/proc/{process}/cmdline")


def _words(path):
    try:
        return Path(path).read_text(errors="replace").split("\0")
    except OSError:
        return []


def parents_up_to(process, program):
    """Return the ids of a process's parent and further ancestors, up to the one of a program."""
    parents = []
    while not parents or Path(f"/proc/{parents[-1]}/comm").read_text().strip() != program:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
        process = int(state[1])
        assert process > 1, f"no {program} started it"
        parents.append(process)
    return parents


def stopped_in_mid_frame(process):
    """Stop a process while it renders and return the path of its picture; None if it does not, and it continues."""
    with contextlib.suppress(OSError):  # it has ended, or closed a file
        os.kill(process, signal.SIGSTOP)
        for number in os.listdir(f"/proc/{process}/fd"):
            claim = re.fullmatch(r"(.*)/\.(\w+\.exr)\.claim", os.readlink(f"/proc/{process}/fd/{number}"))
            if claim and not os.path.exists(f"{claim[1]}/{claim[2]}"):
                return claim[2]
    with contextlib.suppress(ProcessLookupError):
        os.kill(process, signal.SIGCONT)
    return None


def free_ports(count):
    """Return the numbers of consecutive free ports."""
    for first in range(20000 + os.getpid() % 10000, 32000, count):
        with contextlib.ExitStack() as held, contextlib.suppress(OSError):
            for port in range(first, first + count):
                held.enter_context(socket.socket()).bind(("127.0.0.1", port))
            return [*range(first, first + count)]
    raise OSError("no free ports")


def kill(processes):
    """Kill processes simultaneously, so that none can react to the end of another."""
    for number in (signal.SIGSTOP, signal.SIGKILL):
        for process in processes:
            with contextlib.suppress(ProcessLookupError):
                os.kill(process, number)


def shell(text, folder, **variables):
    """Run shell commands in a folder; returns their output."""
    given = {"cwd": folder, "env": os.environ | variables, "timeout": 1200}
    done = subprocess.run(["/bin/sh", "-eu", "-c", text], capture_output=True, text=True, check=False, **given)
    assert done.returncode == 0, done.stderr
    return done.stdout
