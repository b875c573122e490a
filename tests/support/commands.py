# SPDX-License-Identifier: GPL-3.0-or-later
"""Running of commands: in a separate process, as users do, or in this process, which is faster."""

import contextlib
import io
import json
import os
import resource
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

import numpy as np

from hair_addon import command_line
from hair_addon.blender.io import mesh_files
from hair_addon.command_line import import_mesh
from hair_addon.command_line.console import Console
from hair_addon.command_line.interruption import Interruption

ROOT = Path(__file__).resolve().parents[2]
HEAD = ROOT / "blend_samples" / "head.obj"
# For processes that import the add-on from the checkout and draw small pictures.
PYTHONPATH = os.pathsep.join([str(ROOT), str(Path(__file__).with_name("child_processes"))])

TETRAHEDRON = (
    np.array([[0.1, 0.2, 0.3], [1.1, 0.2, 0.4], [0.2, 2.4, 0.5], [0.4, 0.6, 3.7]]),
    np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]),
)


@dataclass(frozen=True)
class Ended:
    """Result of a command: exit status and output."""

    status: int
    out: str
    errors: str

    @property
    def results(self):
        """Standard output as lines of JSON."""
        return [json.loads(line) for line in self.out.splitlines()]


def command(*arguments):
    """Return the arguments for running a command in a separate process."""
    return [sys.executable, "-m", "hair_addon", *map(str, arguments)]


def run(*arguments, **details):
    """Run a command in a separate process."""
    details = {"cwd": ROOT, "timeout": 1200, "env": os.environ | {"PYTHONPATH": PYTHONPATH}} | details
    done = subprocess.run(command(*arguments), capture_output=True, text=True, check=False, **details)
    return Ended(done.returncode, done.stdout, done.stderr)


def run_here(*arguments, terminal=None, reads_apart=False):
    """Run a command in this process, where Blender is loaded; terminal: receives errors and progress.

    reads_apart: whether importers that crash on damaged files run in a separate process, as they do for users.
    """
    out, errors = io.StringIO(), io.StringIO()
    try:
        given = command_line.parser("vellus").parse_args(list(map(str, arguments)))
    except SystemExit as end:
        return Ended(end.code, "", "")
    with contextlib.nullcontext() if reads_apart else _importers_here(), Interruption() as interruption:
        status = command_line.run(given, Console(out, terminal or errors, interruption, given.quiet, given.json))
    return Ended(status, out.getvalue(), errors.getvalue())


def _importers_here():
    """Context in which this process imports files, as starting another process takes two seconds."""
    return mock.patch.multiple(
        import_mesh,
        open_apart=lambda path, up, *_others: mesh_files.open_file(path, up=up),
        try_curves=lambda *_given: None,
    )


@contextlib.contextmanager
def largest_file(size):
    """Context that limits the size of written files [bytes], so that writing fails halfway, as on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def write_obj(path, vertices, triangles, name="Tetrahedron"):
    """Write a mesh as text."""
    lines = [f"o {name}", *("v {} {} {}".format(*vertex) for vertex in vertices)]
    lines += ["f {} {} {}".format(*(triangle + 1)) for triangle in np.asarray(triangles)]
    path.write_text("\n".join(lines) + "\n")
    return path


def load(path):
    """Return {name: array} of an .npz file."""
    with np.load(path) as arrays:
        return dict(arrays)


def distance_to(points, vertices, triangles):
    """Return the distances (N,) of points from the nearest triangle, by brute force."""
    best = np.full(len(points), np.inf)
    for a, b, c in vertices[triangles]:
        ab, ac, ap = b - a, c - a, points - a
        u, v = np.linalg.solve(np.array([[ab @ ab, ab @ ac], [ab @ ac, ac @ ac]]), np.stack([ap @ ab, ap @ ac]))
        inside = (u > -1e-4) & (v > -1e-4) & (u + v < 1.0 + 1e-4)
        away = np.linalg.norm(ap - u[:, None] * ab - v[:, None] * ac, axis=1)
        best = np.where(inside, np.minimum(best, away), best)
    return best
