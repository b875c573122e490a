# SPDX-License-Identifier: GPL-3.0-or-later
"""Progress of a rendered frame in Blender's bar and text, and requests to stop.

In a window Blender draws nothing and reads no input until the view layer is done: drawing waits for the engine that
has the GPU context.
"""

import bpy

from ....core.long_work import Progress, Stopped
from ...settings.translations import status_text

_LEAST = 1e-3  # fraction that is not visible in a bar


class FrameProgress:
    """A `Progress` of a render engine's view layer within its share of the whole bar; it never decreases.

    listener: also called, and may raise `Stopped`. Raises `Stopped` after Esc.
    """

    def __init__(self, engine: bpy.types.RenderEngine, share: tuple[float, float], listener: Progress) -> None:
        self._engine, self._share, self._listener = engine, share, listener
        self._shown, self._text = -1.0, ""
        self.moment = ""  # text of the current motion step

    def __call__(self, step: str, part: float) -> None:
        first, last = self._share
        shown = max(first + (last - first) * min(max(part, 0.0), 1.0), self._shown)
        text = " | ".join(filter(None, (self.moment, status_text(step))))
        if shown < self._shown + _LEAST and text == self._text:
            return
        self._shown, self._text = shown, text
        self._engine.update_progress(shown)
        self._engine.update_stats("", text)
        self._listener("Rendering", shown)
        if self._engine.test_break():
            raise Stopped


def share_of(depsgraph: bpy.types.Depsgraph) -> tuple[float, float]:
    """Return (start, end) of a view layer in the bar: Blender renders all enabled view layers one after another."""
    scene, layer = depsgraph.scene, depsgraph.view_layer
    names = [one.name for one in scene.view_layers if one.use]
    is_alone = scene.render.use_single_layer and not bpy.app.background
    if is_alone or layer.name not in names:
        return 0.0, 1.0
    index = names.index(layer.name)
    return index / len(names), (index + 1) / len(names)
