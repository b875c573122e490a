# SPDX-License-Identifier: GPL-3.0-or-later
"""Counters of searches, uploads and writes of hair, and of uploaded bytes."""

import gpu
import numpy as np

from hair_addon.blender.data.strands import curves
from hair_addon.blender.gpu import strand_textures
from hair_addon.core.geometry.search import hash_grid

_COUNTED = {
    "searches": [(hash_grid, "neighbours")],
    "uploads": [(strand_textures, "upload_strands")],
    "moves": [(strand_textures, "move_strands")],
    "writes": [(curves, "write_points")],
}


def counts_of(monkeypatch):
    """Return live counts {searches, uploads, moves, writes}, from now on."""
    counts = dict.fromkeys(_COUNTED, 0)

    def counted(kind, real):
        def wrapper(*args, **kwargs):
            counts[kind] += 1
            return real(*args, **kwargs)

        return wrapper

    for kind, functions in _COUNTED.items():
        for module, name in functions:
            monkeypatch.setattr(module, name, counted(kind, getattr(module, name)))
    return counts


class Traffic:
    """Context that counts the bytes uploaded to textures in `sent`."""

    def __enter__(self):
        self.sent, self._buffer = 0, gpu.types.Buffer

        def buffer(kind, size, values):
            self.sent += int(np.prod(size)) * (1 if kind == "UBYTE" else 4)
            return self._buffer(kind, size, values)

        gpu.types.Buffer = buffer
        return self

    def __exit__(self, *_error):
        gpu.types.Buffer = self._buffer
