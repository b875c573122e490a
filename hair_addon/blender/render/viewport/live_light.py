# SPDX-License-Identifier: GPL-3.0-or-later
"""Light Grid in viewports: paths are followed in the background while nothing moves, one share after the other.

A share runs in a thread and starts with a redraw, so nothing is followed for a region that is not shown. On the
processor it pauses while viewports are redrawn. The picture changes from dual scattering to paths in steps. While
something moves, the measured light stays in its voxels. Its part of the picture decreases with changes of hair, lights
and looks; its weight relative to new paths also decreases with the angle by which the view has turned. After a turn
the picture also changes in steps, from its present light to the light of new paths, because the first paths are noisy.
"""

import os
import sys
import threading
import time
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ....core import kernels
from ....core.errors import HairError
from ....core.long_work import Job, Stopped
from ....core.shading import light_paths as paths
from ...data.pictures import viewport_shading
from ...gpu import light_grid
from ...host import running, scene_time
from ...host.caches import Cache
from ...host.notices import say
from ...settings import preferences
from .. import light_paths, seen_strands
from . import light_content

_REST = 0.3  # [s] without a change after which paths are followed
_INTERVAL = 0.05  # [s] between checks whether a share is done
_PASSES = 4  # of a picture, after which paths have priority: the picture starts again with each share
_MOST_ASKED = 20  # requested redraws after which a region that was not drawn counts as hidden
_SHARES = 16  # number of shares of a picture's paths, each followed between two redraws
_RAMP = 6  # shares after which paths have replaced dual scattering, at the earliest
_LEAST_SHARE, _MOST_SHARE = 1024, 16_384  # paths
# Once a picture has its paths, shares grow, so that the picture restarts less often: fraction of the paths so far, on a
# processor and on a GPU, and maximum on a GPU, which draws nothing while it traces.
_GROWTH, _GROWTH_ON_GPU, _MOST_ON_GPU = 1.0, 0.25, 131_072
_NICE = 10  # priority of the thread, if the system has priorities of threads

_OFF = "Viewports show Dual Scattering: Light Grid in Viewports is off in the preferences."

light_cache = Cache(capacity=4)  # pointer of a region → LiveLight

_jobs = []  # of all regions: at most one that is not done


class _Rest:
    """Whether viewports are at rest: none was redrawn between the last two checks of the timer."""

    def __init__(self):
        self._is_on, self._is_redrawn = threading.Event(), False
        self.begin()

    @property
    def is_on(self):
        """Whether shares go on."""
        return self._is_on.is_set()

    def begin(self):
        """Let shares go on."""
        self._is_redrawn = False
        self._is_on.set()

    def interrupt(self):
        """Let shares wait, since a viewport is redrawn."""
        self._is_redrawn = True
        self._is_on.clear()

    def check(self):
        """Begin rest if no viewport was redrawn since the last check."""
        if self._is_redrawn:
            self._is_redrawn = False
        else:
            self._is_on.set()

    def wait(self):
        """Wait until viewports are at rest, or someone waits for shares."""
        self._is_on.wait()


_rest = _Rest()


def unregister():
    """Stop following paths, wait for the share that is running, and remove the timer."""
    if bpy.app.timers.is_registered(_wake):
        bpy.app.timers.unregister(_wake)
    end()


def end():
    """Stop all shares, wait for them, and drop all light."""
    for job in _jobs:
        job.stop()
        _rest.begin()
        job.wait()
    _jobs.clear()
    light_cache.clear()


def lit(context, drawn, camera):
    """A `DrawnScene` of the context's region, lit by the paths followed so far; camera: (world to view, view to clip).

    Starts the next share at rest; none continues while viewports are drawn. Returns the scene unchanged with dual
    scattering.
    """
    key, count = context.region.as_pointer(), 0
    if drawn.hair and drawn.light.kind == viewport_shading.SCENE and preferences.has_live_light():
        count = light_paths.path_count(context.scene, (context.region.width, context.region.height))
    if not count or not running.has_window():
        drop(key)
        if not all(job.is_done for job in _jobs):
            _interrupt()
        return drawn
    _interrupt()
    live = light_cache.get(key, LiveLight)
    may_follow = not (scene_time.is_playing() or running.is_rendering())
    return live.lit(drawn, camera, count, time.monotonic(), may_follow)


def is_next(context, pass_count):
    """Whether the context's region should not be redrawn before more paths are followed; pass_count: of its picture."""
    live = light_cache.get(context.region.as_pointer())
    if live is None or pass_count < _PASSES or scene_time.is_playing() or running.is_rendering():
        return False
    return live.is_waiting and not live.is_slow


def _interrupt():
    """Let shares wait until viewports are at rest."""
    _rest.interrupt()
    if not bpy.app.timers.is_registered(_wake):
        bpy.app.timers.register(_wake, first_interval=_INTERVAL, persistent=True)


def drop(key):
    """Forget the light of a region, by its pointer."""
    live = light_cache.get(key)
    if live is not None:
        live.stop()
        light_cache.invalidate(key)


def obstacles(blender_scene):
    """Return the reasons, as sentences, why viewports show dual scattering although a scene's setting is Light Grid."""
    if not light_paths.path_count(blender_scene, (1, 1)):
        return []
    if not preferences.has_live_light():
        return [_OFF]
    return sorted({live.obstacle for live in light_cache.values()} - {""})


def _wake():
    """For `bpy.app.timers`: let shares go on at rest, and redraw regions whose share is done, or due."""
    _rest.check()
    waiting = [live for live in light_cache.values() if live.is_waiting]
    # Redraws for nothing would interrupt the share of another region.
    is_free = all(job.is_done for job in _jobs)
    due = {id(live) for live in waiting if is_free and live.is_due(time.monotonic())}
    for window in bpy.context.window_manager.windows if due else ():
        for area in window.screen.areas:
            for region in area.regions if area.type == "VIEW_3D" else ():
                live = light_cache.get(region.as_pointer())
                if live is not None and id(live) in due:
                    region.tag_redraw()
    for live in waiting:
        live.asked += id(live) in due
    return _INTERVAL if waiting or not _rest.is_on else None


@dataclass(frozen=True, eq=False)
class _Request:
    """A share of paths. systems: arguments of `strand_grid.build` for other hair; surroundings: `Surroundings` of other
    hair or light; shown: `seen_strands.Drawn` of these, or in another view; weight, shift [m]: of the sums so far.
    """

    content: light_content.LightContent
    camera: tuple
    count: int
    seed: int
    systems: tuple | None = None
    surroundings: Any = None
    shown: Any = None
    weight: float = 1.0
    shift: Any = 0.0


class LiveLight:
    """The light of paths in one region. obstacle: why there is none, as a sentence; asked: redraws since the last."""

    def __init__(self):
        self.obstacle, self.asked = "", 0
        self._job = self._drawn = self._content = self._camera = None
        self._paths = None  # `PathSums`; the thread's while a job runs
        self._former = None  # (`PathSums` of other hair or light, weight, shift), used until paths replace them
        self._followed = None  # (`light_content.LightContent`, camera) of the sums, likewise the thread's
        self._known = None  # (`light_content.LightContent`, part) of the textures
        self._grid, self._textures, self._scene = None, (), (None, None)
        self._texels, self._of_voxels = (), ()  # of the textures; textures of voxels alone
        self._means = self._turned = None  # of the present textures; of the textures when the view turned
        self._acted, self._tried, self._goal, self._seed = -np.inf, 0, 0, 0
        self._faded = 0.0  # part of the weight of former paths that the last turn of the view removed
        self._is_done = False

    @property
    def is_busy(self):
        """Whether a share is running."""
        return self._job is not None and not self._job.is_done

    @property
    def is_waiting(self):
        """Whether a redraw would show new paths, now or later."""
        return (self._job is not None or not self._is_done) and self.asked < _MOST_ASKED

    @property
    def is_slow(self):
        """Whether the picture has its paths, and a processor traces further paths, which takes long."""
        return 0 < self._goal <= self._tried and self._paths is not None and self._paths.grid.device.is_cpu

    @property
    def is_done(self):
        """Whether all paths of the picture are followed."""
        return self._is_done and self._job is None

    def is_due(self, now):
        """Whether a redraw would show new paths now."""
        return not self.is_busy and (self._job is not None or now - self._acted >= _REST)

    def stop(self):
        """Ask the running share to end."""
        if self._job is not None:
            self._job.stop()
            _rest.begin()

    def wait(self):
        """Wait until no share is running."""
        if self._job is not None:
            _rest.begin()
            self._job.wait()

    def lit(self, drawn, camera, count, now, may_follow=True):
        """Return a `DrawnScene` lit by the paths followed so far. count: as of `light_paths.path_count`; now: a time
        [s].
        """
        self.asked = 0
        self._turn_to(drawn, camera, now)
        self._take()
        is_due = not self._is_done and self._job is None and now - self._acted >= _REST
        if may_follow and is_due and all(job.is_done for job in _jobs):
            self._begin(drawn, camera, count)
        return self._shown(drawn)

    def _turn_to(self, drawn, camera, now):
        is_first = self._content is None
        content = self._content if drawn is self._drawn else light_content.content_of(drawn)
        is_same = not is_first and (content is self._content or content.is_same(self._content))
        is_turned = is_first or not all(map(np.array_equal, camera, self._camera))
        self._drawn = drawn
        if is_same and not is_turned:
            return
        self._content, self._camera = self._content if is_same else content, camera
        self._acted, self._is_done = now, False
        self.obstacle = light_paths.obstacle(drawn)
        self.stop()

    def _begin(self, drawn, camera, count):
        window = None if self.obstacle else light_paths.window_of(drawn.hair, *camera)
        if window is None or not all(strands.has_points for strands, *_ in drawn.hair):
            self._is_done = True
            return
        content, before = self._content, self._followed
        request = {"content": content, "camera": camera, "seed": self._seed}
        device = kernels.kernel_cache.default_device(preferences.device())
        is_other = self._paths is None or self._paths.grid.device != device or not content.has_hair_of(before[0])
        if is_other:
            request["systems"] = (*light_paths.strands_of(drawn), device)
        if is_other or content is not before[0]:
            request["surroundings"] = light_paths.surroundings_of(drawn)
            self._means = None  # of other hair, or of other lights
        if "surroundings" in request or not all(map(np.array_equal, camera, before[1])):
            samples = light_paths.SAMPLES_A_PATH * count
            request["shown"] = seen_strands.draw(drawn, camera, window, samples, self._seed)
            self._tried = self._goal = 0
            self._turned = self._means
            if before is not None:
                of_view = light_content.view_weight(camera, before[1], content.centre)
                request["weight"] = content.part_since(before[0]) * of_view
                request["shift"] = content.centre - before[0].centre
        work = _Request(count=self._share_of(self._goal or count), **request)
        if work.shown is not None:
            self._faded = 1.0 - work.weight
        self._seed += 1
        self._job = Job(lambda progress: self._follow(work, progress))
        _jobs[:] = [self._job]

    def _share_of(self, goal):
        """Return the number of paths of the next share; goal: paths of the picture."""
        share = min(max(goal // _SHARES, _LEAST_SHARE), _MOST_SHARE)
        is_on_gpu = self._paths is not None and not self._paths.grid.device.is_cpu
        if is_on_gpu:
            share = _MOST_SHARE  # fewer paths would take as long
        if self._tried < goal or self._paths is None:
            return share
        grown = int(_GROWTH * self._tried)
        if is_on_gpu:
            grown = min(int(_GROWTH_ON_GPU * self._tried), _MOST_ON_GPU)
        return max(share, min(grown, int(self._most - self._tried)))

    def _follow(self, work, progress):
        """In the thread: (paths of the share, texels of the light); None if no strand is in sight."""
        if sys.platform == "linux":
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICE)

        def pause():
            _rest.wait()
            progress(paths.gather.FOLLOWING, 0.0)

        with kernels.parallel.on_one_core(pause):
            found, former = self._paths, self._former
            if work.surroundings is not None:
                grid = self._paths.grid if work.systems is None else _grid_of(*work.systems)
                if grid is None:
                    return None
                found, former = paths.gather.PathSums(grid, work.surroundings), None
                if self._paths is not None and _are_alike(self._paths.grid, grid):
                    former = self._paths, work.weight, work.shift
                weight = 1.0
            else:
                weight = work.weight
            if work.shown is not None:
                seen = work.shown.seen(found.grid)
                found.see(seen, weight)
                self._paths, self._former, self._followed = found, former, (work.content, work.camera)
                self._goal = -(-len(seen.segments) // light_paths.SAMPLES_A_PATH)
            if not self._goal:
                return None
            taken = found.taken
            found.follow(work.count, work.seed, progress)
            if not found.taken:
                return None
            if former is None:
                return found.taken - taken, found.texels()
            sums, weight, shift = former
            # Light measured under other lights takes no part in the final picture.
            left = max(1.0 - found.taken / self._goal, 0.0)
            return found.taken - taken, found.texels(sums, left * weight, shift)

    def _take(self):
        """Show the paths of the share that has ended, if any."""
        if self._job is None or not self._job.is_done:
            return
        job, self._job = self._job, None
        try:
            result = job.result()
        except Stopped:
            return
        except HairError as error:
            say(str(error))
            result = None
        if result is None:
            self._is_done = True
            return
        taken, means = result
        part = min(self._part() + min(taken * _SHARES / self._goal, 1.0) / _RAMP, 1.0)
        self._known, self._scene = (self._content, part), (None, None)
        self._tried += taken
        if self._paths.taken >= self._goal:
            self._former = None
        is_known = self._paths.taken >= self._goal and self._paths.wanted_for(light_paths.NOISE) < 1.0
        is_spent = self._tried >= self._most
        new_part = 1.0 if is_spent or self._turned is None else self._new_part()
        self._is_done = part == 1.0 and (is_spent or (is_known and new_part == 1.0))
        if new_part < 1.0:
            before = {id(now): then for then, now in zip(self._turned, means, strict=True)}
            means = paths.gather.of_each(
                lambda now: before[id(now)] + np.float32(new_part) * (now - before[id(now)]), means
            )
        self._textures, self._grid = tuple(paths.gather.of_each(light_grid.upload, means)), self._paths.grid
        self._texels, self._of_voxels, self._means = means, (), means

    def _new_part(self):
        """Return the part of the shown light that comes from paths since the view turned, from 0 to 1.

        The part is 1 after a fraction of the paths that suffice for the light. The fraction is the weight that the turn
        removed from former paths.
        """
        known = max(self._goal, self._paths.taken * self._paths.wanted)
        return min(self._tried / max(self._faded * min(known, self._most), 1.0), 1.0)

    @property
    def _most(self):
        """The maximum number of paths of the picture."""
        return light_paths.most_paths_at_rest(self._paths.grid.device, self._goal)

    def _part(self):
        """Return the part of the picture's light that is measured light, from 0 to 1."""
        if self._known is None:
            return 0.0
        content, part = self._known
        return part if content is self._content else part * self._content.part_since(content)

    def _shown(self, drawn):
        """Return the scene lit by the measured light: the same object if nothing has changed."""
        if self._scene[0] is drawn:
            return self._scene[1]
        found, part = drawn, 0.0 if self.obstacle else self._part()
        if part > 0.0 and len(self._textures) == len(drawn.hair):
            shift = self._content.centre - self._known[0].centre
            found = light_paths.lit_by(drawn, self._grid, self._textures_of(drawn.hair), part, shift)
        self._scene = drawn, found
        return found

    def _textures_of(self, hair):
        """Return the textures for hair: those of voxels alone if the number of strands has changed."""
        pairs = zip(hair, self._known[0].hair, strict=True)
        if all(now[0].strand_count == then[0].strand_count for now, then in pairs):
            return self._textures
        if not self._of_voxels:
            layers = paths.light_texels.sides_of(self._grid.shape)[2]
            alone = paths.gather.of_each(lambda texels: texels[:layers], self._texels)
            self._of_voxels = tuple(paths.gather.of_each(light_grid.upload, alone))
        return self._of_voxels


def _grid_of(systems, fibres, device):
    """Return the `StrandGrid` of hair; None if paths cannot be followed in it."""
    if not paths.strand_grid.has_area(systems):
        return None
    grid = paths.strand_grid.build(systems, fibres, device=device)
    return grid if grid.is_resolved else None


def _are_alike(grid, other):
    """Whether sums of a grid can be added to those of another."""
    return grid.device == other.device and grid.sums_of_systems == other.sums_of_systems
