# SPDX-License-Identifier: GPL-3.0-or-later
"""Values and links of shader nodes, written only if they differ: Blender evaluates the material after each write."""

import numpy as np


def assign(owner, name, value):
    """Set a numeric property of a node, socket or material, unless it has this value in single precision."""
    present = getattr(owner, name)
    if np.ndim(value) == 0:
        is_same = present == np.float32(value)
    else:
        value = tuple(value)
        is_same = tuple(present) == tuple(map(np.float32, value))
    if not is_same:
        setattr(owner, name, value)


def link(tree, output, socket):
    """Link a socket to an output, unless it is linked to this output."""
    if not any(each.from_socket == output for each in socket.links):
        tree.links.new(output, socket)
