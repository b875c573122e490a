# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines in pixels of the window."""

import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader


def draw_loop(places: np.ndarray, color: tuple[float, float, float, float], width: float) -> None:
    """Draw a closed line through places (N, 2) with a width, both in pixels of the window."""
    shader = gpu.shader.from_builtin("POLYLINE_UNIFORM_COLOR")
    corners = np.pad(places, ((0, 0), (0, 1))).astype(np.float32)
    batch = batch_for_shader(shader, "LINE_LOOP", {"pos": corners})
    gpu.state.blend_set("ALPHA")
    shader.uniform_float("viewportSize", gpu.state.viewport_get()[2:])
    shader.uniform_float("lineWidth", width)
    shader.uniform_float("color", color)
    batch.draw(shader)
    gpu.state.blend_set("NONE")
