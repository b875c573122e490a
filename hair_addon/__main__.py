# SPDX-License-Identifier: GPL-3.0-or-later
"""python -m hair_addon: the command line, without a Blender executable."""

import signal
import sys


def main():
    """Run the command of this process; returns its exit status."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # until the command listens: no traceback from an import
    from . import command_line

    return command_line.main(sys.argv[1:], "python -m hair_addon")


if __name__ == "__main__":
    sys.exit(main())
