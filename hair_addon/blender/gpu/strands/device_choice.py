# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether the GPU makes strands where they are drawn, decided by one measurement on first use.

Otherwise Warp computes points, and they are uploaded. With software rendering an upload is a copy, and a compute
program is slower than Warp; on GPUs it is the other way round.
"""

import time

import gpu
import numpy as np

from ....core.errors import HairError
from .. import strand_textures
from ..programs import shaders
from . import strand_maker

_STRANDS, _GUIDES, _POINTS, _SLOTS = 4096, 64, 41, 8
_RUNS = 3


@shaders.cached
def times() -> tuple[float, float]:
    """Seconds that the GPU takes to generate strands, infinite if it cannot, and seconds to upload as many."""
    try:
        maker = _maker()
    except HairError:
        return np.inf, 0.0  # unsupported by the driver, which needs no message
    points = np.zeros((_STRANDS, _POINTS, 3), np.float32)
    radii = np.zeros(points.shape[:2], np.float32)
    strands = [strand_textures.upload_strands(points, radii)]

    def upload():
        strands[0] = strand_textures.upload_strands(points, radii)

    def make():
        strands[0] = maker.make(strands[0], points[:_GUIDES])

    return _seconds(make, strands), _seconds(upload, strands)


def is_faster() -> bool:
    """Whether the GPU makes strands in half the time of their upload, which is only a part of the alternative."""
    makes, uploads = times()
    return makes < 0.5 * uploads


def can_make() -> bool:
    """Whether the GPU can make strands at all."""
    return times()[0] < np.inf


def _maker():
    """Return a maker of strands that follow different guides, like neighbors on a surface."""
    slots = (np.arange(_STRANDS)[:, None] * _GUIDES // _STRANDS + np.arange(_SLOTS)) % _GUIDES
    up = np.tile(np.float32([0.0, 0.0, 1.0]), (_STRANDS, 1))
    weights = np.full(slots.shape, 1.0 / _SLOTS, np.float32)
    bound = strand_maker.BoundStrands(
        np.zeros_like(up), up, up[:_GUIDES], up[:_GUIDES, 0], slots, weights, (-3.0, 1.0, 200.0, 0.01), 1.0
    )
    return strand_maker.new_maker(bound, _POINTS, np.eye(3))


def _seconds(work, strands):
    """Least time of some runs, each completed on the GPU, after a warm-up run."""
    found = []
    for _ in range(1 + _RUNS):
        started = time.perf_counter()
        work()
        end = gpu.types.GPUFrameBuffer(color_slots=strands[0].texture)
        with end.bind():
            end.read_color(0, 0, 1, 1, 4, 0, "FLOAT")  # reading waits for completion
        found.append(time.perf_counter() - started)
    return min(found[1:])
