# SPDX-License-Identifier: GPL-3.0-or-later
"""Launches that come again as they were: a GPU records them once, as a CUDA graph, and repeats them by one call.

From Python a launch takes longer than many a kernel does.
"""

from collections.abc import Callable, Hashable

import warp as wp

_MOST = 64  # sequences that are kept, before all are forgotten


class Replays:
    """Sequences of launches on one device, each under a key that says all that it depends on."""

    def __init__(self, device: wp.DeviceLike) -> None:
        self._device = wp.get_device(device)
        self._is_refused = False  # by the driver
        self._known: dict[Hashable, wp.Graph | None] = {}  # None for a sequence that has run once

    def run(self, key: Hashable, launch: Callable[[], None]) -> None:
        """Run a sequence of launches: from the third time on, repeat what the second one recorded.

        key: equal only where `launch` would launch the same kernels with the same values and arrays, whose contents may
        be others. launch: launches kernels that are loaded, and neither allocates nor copies between devices.
        """
        graph = self._known.get(key)
        if graph is None:
            graph = self._recorded(launch) if self.is_recording and key in self._known else None
            if len(self._known) >= _MOST:
                self._known.clear()
            self._known[key] = graph
        if graph is None:
            launch()
        else:
            wp.capture_launch(graph)

    @property
    def is_recording(self) -> bool:
        """Whether launches are recorded: on a GPU whose driver does not refuse to."""
        return self._device.is_cuda and not self._is_refused

    def _recorded(self, launch):
        """The launches as a graph, none of which has run; None where the driver does not record them."""
        try:
            wp.capture_begin(self._device, force_module_load=False)
        except RuntimeError:
            self._is_refused = True
            return None
        graph = None
        try:
            launch()
        finally:
            try:
                graph = wp.capture_end(self._device)
            except RuntimeError:
                self._is_refused = True
        return graph
