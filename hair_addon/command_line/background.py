# SPDX-License-Identifier: GPL-3.0-or-later
"""The command that runs jobs in the background for viewports and renders.

blender/host/background_process.py runs this command in another process. It is for internal use and is not listed.
"""

from ..core import lazy

blender = lazy.Package("..blender", __package__)


def add(verbs):
    """Add the command and its option."""
    background = verbs.add_parser("background")
    background.add_argument("folder", help="for temporary files")
    background.set_defaults(run=run, json=True, quiet=False, verbose=False)


def run(given, _console):
    """Run jobs whose folders are lines of standard input."""
    blender.io.pictures.background_jobs.serve(0, given.folder)
