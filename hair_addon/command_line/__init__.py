# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line, as python -m hair_addon and as blender --command vellus.

Exit status 0: success; 1: failure, with one sentence on standard error; 2: invalid arguments; 130 and 143: stopped by
Ctrl-C or SIGTERM.
"""

import sys

from ..api.blender_access import NO_BLENDER
from ..core.errors import HairError
from ..core.long_work import Stopped
from . import (
    background,
    cards,
    console,
    export,
    groom,
    import_mesh,
    info,
    interruption,
    paths,
    render,
    settings,
    simulate,
    tables,
    transfer,
    tubes,
)
from .options import Parser

_VERBS = (groom, tables, transfer, simulate, render, export, cards, tubes, info, settings, import_mesh, background)


def main(arguments, program):
    """Run a command; returns the process's exit status. program: the command's name for messages."""
    console.occupy_closed_streams()
    try:
        given = parser(program).parse_args(arguments)
    except SystemExit as end:  # argparse exits by itself: 0 after --help, 2 for invalid arguments
        return end.code
    except OSError:  # writing the help failed
        console.discard(sys.stdout)
        return 1
    with console.own_streams(given.verbose) as (out, errors), interruption.Interruption() as interrupted:
        return run(given, console.Console(out, errors, interrupted, given.quiet, given.json))


def parser(program):
    """Return the parser of all commands."""
    made = Parser(prog=program, description="Create and render hair on meshes, without a window.")
    verbs = made.add_subparsers(required=True, metavar="VERB")
    for verb in _VERBS:
        verb.add(verbs)
    return made


def run(given, console):
    """Run a command with parsed options; returns the exit status. console: its `Console`."""
    try:
        paths.resolve(given)
        given.run(given, console)
        return 0
    except (Stopped, KeyboardInterrupt):
        pass
    except HairError as error:
        if not console.interruption.is_asked:  # otherwise a consequence of the interruption
            console.fail(" ".join(str(error).split()))
            return 1
    except ModuleNotFoundError as error:
        if error.name != "bpy":
            raise
        console.fail(NO_BLENDER)
        return 1
    except MemoryError:
        console.fail("Not enough memory: use fewer strands or points, or a smaller picture.")
        return 1
    except BrokenPipeError:  # the reader has closed the pipe
        return 1
    except OSError as error:  # a path that passed the checks may be too long, or removed in the meantime
        console.fail(f"{error.filename}: {error.strerror}." if error.filename else f"{error.strerror or error}.")
        return 1
    console.fail("stopped: unfinished results were not written.")
    return console.interruption.status
