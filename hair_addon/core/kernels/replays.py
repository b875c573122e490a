# SPDX-License-Identifier: GPL-3.0-or-later
"""Recording of repeated kernel launches as a CUDA graph, which is replayed by one call.

A launch from Python takes longer than many kernels.
"""

from collections.abc import Callable, Hashable

import warp as wp

_MOST = 64  # sequences, beyond which the cache is cleared


class Replays:
    """Recorded sequences of launches on one device, by keys that include everything that a sequence depends on."""

    def __init__(self, device: wp.DeviceLike) -> None:
        self._device = wp.get_device(device)
        self._is_refused = False  # whether the driver rejected a recording
        self._known: dict[Hashable, wp.Graph | None] = {}  # None for a sequence that has run once

    def run(self, key: Hashable, launch: Callable[[], None]) -> None:
        """Run a sequence of launches: the second run is recorded, further runs replay the recording.

        key: equal only if `launch` launches the same kernels with the same values and arrays, whose contents may
        differ; launch: launches loaded kernels, and neither allocates nor copies between devices.
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
        """Whether launches are recorded: on a GPU whose driver supports it."""
        return self._device.is_cuda and not self._is_refused

    def _recorded(self, launch):
        """Return launches as a graph, recorded without running them; None if the driver does not support this."""
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
