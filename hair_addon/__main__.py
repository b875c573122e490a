# SPDX-License-Identifier: GPL-3.0-or-later
"""python -m hair_addon: the command line, without a Blender executable."""

import sys

from . import command_line

if __name__ == "__main__":
    sys.exit(command_line.main(sys.argv[1:], "python -m hair_addon"))
