# SPDX-License-Identifier: GPL-3.0-or-later
"""Python interface: dynamics."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..core import dynamics
from ..core.dynamics.rod.presets import PRESETS, applied
from ..core.dynamics.rod.settings import DynamicsSettings
from ..core.errors import HairError
from ..core.geometry.strands import Strands, check_strands
from ..core.long_work import Progress, no_progress, run_now
from ..core.params import Param, array_of, plain_value
from .arguments import changed, checked_progress, choice, mesh_of
from .blender_access import blender

Curves = Any

__all__ = [
    "DynamicsSettings",
    "bake_dynamics",
    "deliver_dynamics",
    "dynamics_of",
    "remove_delivery",
    "set_dynamics",
    "simulate",
]

_SWITCH = Param("")
_FRAME = Param("", low=-1_048_574, high=1_048_574)  # Blender's
_RATE = Param("", above=0.0)
_COMPONENT = Param("")


def dynamics_of(guides: Curves) -> DynamicsSettings:
    """Return the simulation settings of guide Curves.

    >>> api.dynamics_of(bpy.data.objects["Guides"]).bend_stiffness
    8.0
    """
    return blender.settings.properties.own_dynamics_of(blender.data.arguments.curves_of(guides, "GUIDES").vellus)


def set_dynamics(
    guides: Curves,
    settings: DynamicsSettings | str | None = None,
    *,
    simulates: bool | None = None,
    **changes: Any,
) -> DynamicsSettings:
    """Change the simulation settings of guide Curves, and return them.

    settings: `DynamicsSettings`, the name of a preset such as "STYLED", or None for the current ones; changes: fields
    of `DynamicsSettings`; simulates: whether the guides are simulated during playback, None for no change.

    >>> guides = bpy.data.objects["Guides"]
    >>> api.set_dynamics(guides, "STYLED", simulates=True, friction=0.4).hold
    20.0
    """
    target = blender.data.arguments.curves_of(guides, "GUIDES")
    if settings is None or isinstance(settings, str):
        present = blender.settings.properties.own_dynamics_of(target.vellus)
        settings = present if settings is None else applied(present, choice(settings, "dynamics preset", PRESETS))
    wanted = changed(DynamicsSettings, settings, changes)
    if simulates is not None:
        simulates = plain_value("simulates", simulates, False, _SWITCH)
    blender.groom.transfer.groom_settings.assign_dynamics(target, wanted)
    if simulates is not None:
        target.vellus.simulates = simulates
    return wanted


def bake_dynamics(
    guides: Curves,
    last_frame: int | None = None,
    *,
    starts_over: bool = False,
    progress: Progress = no_progress,
) -> range:
    """Simulate guide Curves from their start frame on, write the frames to their cache folder, and return the range.

    last_frame: None for the scene's last; starts_over: simulate existing frames again instead of continuing after them;
    progress(step, part): callback, may raise to cancel, which keeps the frames so far. Simulation of the guides is
    switched on. Raises `HairError` if the folder cannot be written, the .blend file is not saved, or memory is
    insufficient.

    >>> guides = bpy.data.objects["Guides"]
    >>> guides.data.vellus.cache_folder = "haircache"
    >>> bpy.context.scene.frame_end = 3
    >>> api.bake_dynamics(guides)
    range(1, 4)
    """
    target = blender.data.arguments.guides_of(guides)
    scene_time = blender.host.scene_time
    last = scene_time.scene_frames()[-1] if last_frame is None else last_frame
    last = plain_value("last_frame", last, 1, _FRAME)
    starts_over = plain_value("starts_over", starts_over, False, _SWITCH)
    work = blender.groom.dynamics.guide_baking.baking([target], last, scene_time.present_scene(), starts_over)
    (baked,) = run_now(work, checked_progress(progress))
    target.vellus.simulates = True
    return range(baked.first, baked.last + 1)


def deliver_dynamics(guides: Curves, *, progress: Progress = no_progress) -> Path:
    """Write the hair of baked guides to a USD file beside the .blend file, play it in Blender, and return its path.

    The delivered hair is visible in files that link it, on render farms and in Blender without Vellus. All frames of
    the scene are written. Raises `HairError` if a frame is not baked, the .blend file is not saved, or the USD file
    cannot be written.

    >>> api.deliver_dynamics(bpy.data.objects["Guides"]).name
    'shot_Guides.usdc'
    """
    target = blender.data.arguments.guides_of(guides)
    delivery = blender.io.delivery
    work = delivery.delivering(target, delivery.path_of(target), blender.host.scene_time.present_scene())
    return run_now(work, checked_progress(progress)).path


def remove_delivery(guides: Curves) -> None:
    """Let the hair of guide Curves follow the guides again instead of the delivered frames. The file is kept.

    Raises `HairError` if no hair plays delivered frames.

    >>> api.remove_delivery(bpy.data.objects["Guides"])
    """
    blender.io.delivery.take_off(blender.data.arguments.curves_of(guides, "GUIDES"))


def simulate(
    poses: Iterable[ArrayLike],
    triangles: ArrayLike,
    guides: Strands,
    settings: DynamicsSettings | None = None,
    *,
    frame_rate: float = 24.0,
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81),
    regions: ArrayLike | None = None,
    held: ArrayLike | None = None,
    **changes: Any,
) -> Iterator[np.ndarray]:
    """Simulate guides on a moving mesh of plain arrays: yields points (G, P, 3) float32 [m] for each pose.

    poses: vertices (V, 3) [m] for each frame, read on demand; triangles: (F, 3) indices of vertices, wound so that
    normals point outward; guides: `Strands` on the first pose, as from `distribute_guides`, yielded unchanged for it;
    settings: `DynamicsSettings`; changes: its fields by name; frame_rate: of the poses [1/s]; gravity: [m/s²]; regions:
    (G,) integers; no friction or pressure acts between guides of different regions, as across a parting; None for one
    region; held: (G,) from 0 to 1, the part of each guide's length, up to its tie, that only follows the mesh, such as
    the attribute `gathered_held` of gathered guides, without effect if the settings' `holds_ties` is off; None for
    guides without ties. Raises `HairError` for invalid arguments, and during iteration for a pose with another number
    of vertices or non-finite ones.

    >>> import numpy as np
    >>> vertices = np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0]], np.float32)
    >>> triangles = np.array([[0, 1, 2], [0, 2, 3]])
    >>> guides = api.distribute_guides((vertices, triangles), guide_count=20, length=0.05)
    >>> poses = (vertices + np.float32([0.01 * frame, 0, 0]) for frame in range(3))
    >>> [points.shape for points in api.simulate(poses, triangles, guides, wetness=1.0)]
    [(20, 41, 3), (20, 41, 3), (20, 41, 3)]
    """
    wanted = changed(DynamicsSettings, settings, changes)
    if wanted.colliders:
        raise HairError("colliders names a collection of a .blend file: leave it empty for plain arrays.")
    rate = plain_value("frame_rate", frame_rate, 1.0, _RATE)
    x, y, z = plain_value("gravity", gravity, (0.0, 0.0, 0.0), _COMPONENT)
    if not isinstance(guides, Strands):
        raise HairError("guides must be Strands, as distribute_guides() returns for arrays.")
    check_strands(guides)
    try:
        remaining = iter(poses)
        first = next(remaining, None)
    except TypeError as error:
        raise HairError("poses must be an iterable of vertices (V, 3), one array for each frame.") from error
    if first is None:
        raise HairError("poses is empty: begin with the vertices that the guides were grown on.")
    mesh = mesh_of((first, triangles))
    dynamics.moving_mesh.require(mesh, guides)
    parted = None if regions is None else _regions_of(regions, len(guides))
    tied = None if held is None else _held_of(held, len(guides))
    return dynamics.moving_mesh.simulated(
        mesh, guides, remaining, wanted, 1.0 / rate, (x, y, z), regions=parted, held=tied
    )


def _held_of(given, guide_count):
    """Return parts of lengths (G,) float32. Raises `HairError`."""
    held = array_of(given, np.float32)
    if held is None or held.shape != (guide_count,) or not ((held >= 0.0) & (held <= 1.0)).all():
        raise HairError(f"held must be numbers from 0 to 1 of shape ({guide_count},), one for each guide.")
    return held


def _regions_of(given, guide_count):
    """Return consecutive regions (G,) int32 from 0. Raises `HairError`."""
    regions = array_of(given)
    if regions is None or regions.dtype.kind not in "iu" or regions.shape != (guide_count,):
        raise HairError(f"regions must be whole numbers of shape ({guide_count},), one for each guide.")
    return np.unique(regions, return_inverse=True)[1].astype(np.int32)
