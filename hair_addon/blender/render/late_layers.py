# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables for strands that differ in radial roughness, which viewports bake in the background.

A redraw bakes at most one layer of tables, as for hair without such a map, and draws all strands with the radial
roughness of this layer. Viewports mix the first and the last layer as soon as both are baked, and finally all layers.
"""

import os
import sys
import threading
from dataclasses import dataclass, field, replace
from typing import Any

import bpy

from ...core.errors import HairError
from ...core.long_work import Job, Progress, Stopped
from ...core.shading.tables import look_tables, radial_tables
from ...core.shading.tables.look_tables import LookTables
from ...core.shading.tables.radial_tables import Layers, RadialTables
from ..host.caches import Cache
from ..host.notices import say

_LOOK = 0.1  # [s] between checks for baked tables
_NICE = 10  # priority of the thread, if the system has priorities of threads
_LAYERS = 17  # layers of the whole range of radial roughness
_FEW = 2  # layers that may be missing at the ends of the range while the others are shown
_STEP = "Baking Tables"

layer_cache = Cache(capacity=2 * _LAYERS)  # arguments of `look_tables.bake` → `LookTables`
request_cache = Cache(capacity=16)  # purpose of tables → `_Request`, while layers are missing

_jobs: list["_Baking"] = []  # at most one


@dataclass(eq=False)
class _Request:
    """Tables for which layers are missing; wanted: arguments of all layers; shown: key of the tables in viewports."""

    wanted: tuple
    layers: Layers
    shown: tuple


@dataclass(eq=False)
class _Baking:
    """A thread that bakes layers."""

    wanted: tuple  # arguments of all layers of a request
    missing: list
    done: list = field(default_factory=list)  # (arguments, `LookTables`), appended by the thread
    job: Any = None

    def start(self) -> None:
        """Start the thread."""
        self.job = Job(self._bake)

    def _bake(self, progress: Progress) -> None:
        if sys.platform == "linux":
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICE)
        for index, arguments in enumerate(self.missing):
            progress(_STEP, index / len(self.missing))
            self.done.append((arguments, look_tables.bake(*arguments)))


def tables(
    purpose: Any, settings: Any, variation: Any, covered: tuple[float, float], layers: Layers, mean: float, device: str
) -> tuple[LookTables | RadialTables, tuple]:
    """Return the best baked tables for strands that differ in radial roughness, and their key; a thread bakes the rest.

    purpose: key of the request; settings, variation, covered, layers, device: as for `radial_tables.bake`; mean: mean
    radial roughness of the strands. Raises `HairError`.
    """
    wanted = tuple(
        (replace(settings, radial_roughness=radial), variation, covered, device)
        for radial in radial_tables.values_of(layers)
    )
    _take()
    found = _present(wanted, layers)
    if found is None:
        middle = wanted[min(max(round((mean - layers.low) / layers.step), 0), len(wanted) - 1)]
        found = layer_cache.get(middle, lambda: look_tables.bake(*middle)), middle[:3]
    request_cache.keep(purpose, _Request(wanted, layers, found[1]))
    if not _missing(wanted):
        forget(purpose)
    _begin()
    return found


def forget(purpose: Any) -> None:
    """Forget a request whose tables are all baked or no longer needed."""
    if len(request_cache):
        request_cache.invalidate(purpose)


def has_new() -> bool:
    """Whether newer tables are baked than viewports have shown; true once for each change."""
    _take()
    is_new = False
    for request in request_cache.values():
        found = _present(request.wanted, request.layers)
        if found is not None and found[1] != request.shown:
            request.shown, is_new = found[1], True
    return is_new


def look() -> float | None:
    """Timer: redraw viewports and panels. Returns the time to the next check [s], None after the last."""
    for window in bpy.context.window_manager.windows if _jobs and (_jobs[0].done or _jobs[0].job.is_done) else ():
        for area in window.screen.areas:
            if area.type in {"PROPERTIES", "VIEW_3D"}:
                area.tag_redraw()
    _take()
    _begin()
    return _LOOK if _jobs else None


def _present(wanted, layers):
    """Return (`RadialTables`, key) of all layers, all but a few, or the first and the last; None if these are not
    baked.
    """
    layer_cache.make_room(len(wanted))
    made = [layer_cache.get(arguments) for arguments in wanted]
    most = len(wanted)
    # Painted values may exceed the baked range by a layer: strands beyond the range have its nearest layer.
    runs = [(first, count) for count in range(most, max(most - _FEW, 2) - 1, -1) for first in range(most - count + 1)]
    for first, stride, some in (
        *((first, 1, made[first : first + count]) for first, count in runs),
        (0, most - 1, [made[0], made[-1]]),
    ):
        if None not in some:
            kept = Layers(layers.low + first * layers.step, layers.step * stride, float(len(some)))
            return RadialTables(tuple(some), kept), (*wanted[first][:3], kept)
    return None


def _missing(wanted):
    """Return arguments of the layers that are not baked: the first and the last before others."""
    return [one for one in (wanted[0], wanted[-1], *wanted[1:-1]) if layer_cache.get(one) is None]


def _begin():
    """Start a thread that bakes missing layers, unless one runs; a thread without a request ends after its layer."""
    wanted = [request.wanted for request in request_cache.values()]
    for baking in _jobs:
        if baking.wanted not in wanted:
            baking.job.stop()
    if not _jobs:
        for one in reversed(wanted):
            if missing := _missing(one):
                _jobs.append(_Baking(one, missing))
                _jobs[0].start()
                break
    if _jobs and not bpy.app.timers.is_registered(look):
        bpy.app.timers.register(look, first_interval=_LOOK, persistent=True)


def _take():
    """Store the layers that the thread has baked."""
    if not _jobs:
        return
    baking = _jobs[0]
    is_done = baking.job.is_done  # read before the layers are stored, so that none is missed
    while baking.done:
        layer_cache.keep(*baking.done.pop(0))
    if is_done:
        _jobs.clear()
        try:
            baking.job.result()
        except Stopped:
            pass
        except HairError as error:
            say(str(error))
            request_cache.clear()


def parts() -> tuple[int, int] | None:
    """Return (number of baked layers, number of layers) of the request in work; None without a thread."""
    if not _jobs:
        return None
    wanted = _jobs[0].wanted
    return len(wanted) - len(_missing(wanted)) + len(_jobs[0].done), len(wanted)


def end() -> None:
    """Stop the thread, wait for it, and forget all requests."""
    if bpy.app.timers.is_registered(look):
        bpy.app.timers.unregister(look)
    for baking in _jobs:
        baking.job.stop()
        baking.job.wait()
    _jobs.clear()
    request_cache.clear()
