# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line, as python -m hair_addon and as blender --command vellus.

Exit status 0: done; 1: it failed, with one sentence on standard error; 2: the command was not understood; 130 and 143:
it was stopped, by Ctrl-C or a request to end.
"""

import sys

from ..core.errors import HairError
from ..core.long_work import Stopped
from . import console, groom, info, interruption, render, settings, tables
from .options import Parser

_VERBS = (groom, tables, render, info, settings)


def main(arguments, program):
    """Run a verb; returns the exit status. program: how the user calls it. The process is to end with it."""
    try:
        given = parser(program).parse_args(arguments)
    except SystemExit as end:  # argparse ends by itself: 0 after --help, 2 for what it does not understand
        return end.code
    with console.own_streams(given.verbose) as (out, errors), interruption.Interruption() as interrupted:
        return run(given, console.Console(out, errors, interrupted, given.quiet, given.json))


def parser(program):
    """The parser of all verbs."""
    made = Parser(prog=program, description="Hair on meshes, without a window.")
    verbs = made.add_subparsers(required=True, metavar="VERB")
    for verb in _VERBS:
        verb.add(verbs)
    return made


def run(given, said):
    """Run a verb whose options were understood; returns the exit status. said: its `Console`."""
    try:
        given.run(given, said)
        return 0
    except (Stopped, KeyboardInterrupt):
        pass
    except HairError as error:
        if not said.interruption.is_asked:  # else it is what Blender made of it
            said.fail(" ".join(str(error).split()))
            return 1
    except MemoryError:
        said.fail("There is not enough memory for this: ask for fewer strands, or a smaller picture.")
        return 1
    except BrokenPipeError:
        sys.stderr.close()  # nobody is left to be told
        return 1
    said.fail("stopped: what was not done yet was not written.")
    return said.interruption.status
