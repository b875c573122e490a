# SPDX-License-Identifier: GPL-3.0-or-later
"""All nodes of a source's syntax tree."""

import ast


def nodes_of(tree):
    """Return all nodes of a tree in any order; `ast.walk` takes twice as long."""
    found, ahead = [], [tree]
    while ahead:
        found.append(node := ahead.pop())
        for value in vars(node).values():
            if isinstance(value, list):
                ahead += (item for item in value if isinstance(item, ast.AST))
            elif isinstance(value, ast.AST):
                ahead.append(value)
    return found
