# SPDX-License-Identifier: GPL-3.0-or-later
"""Growing of guides, and draping if settings request it or hair is new."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ...core import dynamics, geometry
from ...core.errors import HairError
from ...core.geometry.faces.uv_maps import Texture
from ...core.geometry.mesh import SurfacePoints
from ...core.geometry.strands import Strands
from ...core.grooming import cost, groom, groom_defaults
from ...core.grooming.groom import GuideSettings
from ...core.long_work import Progress, part_of
from ..data.strands import drawn_lines
from ..data.surfaces import Surface
from ..settings import preferences
from ..settings.translations import error_text
from .varied_guides import VariedGuides

HANGING = 0.5  # least gravity of new hair that hangs, as on a dome; less gives standing fur
_QUICK = 1.0  # [s] limit for draping new hair
_GROWN = 0.6  # fraction of the progress


@dataclass(frozen=True)
class GrownGuides:
    """Guides, and the reason if they could not be draped."""

    strands: Strands
    status: str = ""


def draped_if_new(
    given: GuideSettings, completed: GuideSettings, surface: Surface, density: np.ndarray | None
) -> GuideSettings:
    """Return completed settings with draping on for new guides on a dome such as a scalp, if it takes at most a second.

    given: the settings before they were completed for the surface; density: their mask. With a given gravity or flow
    lines, settings do not change.
    """
    is_free = given.gravity is None and not given.flow_lines
    if not is_free or groom_defaults.known(completed.gravity) < HANGING:
        return replace(completed, drape=False)
    face_count = int(dynamics.draped_growth.within_reach(surface.mesh, completed, density).sum())
    return replace(completed, drape=cost.drape_seconds(completed.guide_count, face_count) <= _QUICK)


def grow(
    surface: Surface,
    settings: GuideSettings,
    mask: tuple[np.ndarray | None, Texture | None],
    flow: drawn_lines.Flow,
    progress: Progress,
    roots: SurfacePoints | None = None,
    varied: VariedGuides | None = None,
    random: Callable[[SurfacePoints], np.ndarray | None] | None = None,
) -> GrownGuides:
    """Return the `GrownGuides` of completed settings; mask: (density, texture); roots and random as
    in `groom.distribute_guides`; flow: at rest; varied: by maps. Guides that cannot be draped keep their grown shape.
    Raises `HairError`.
    """
    status = "" if varied is None else varied.status
    if varied is not None and not varied.maps:
        varied = None
    density, texture = mask
    device = preferences.device()
    guides = groom.distribute_guides(
        surface.mesh,
        settings,
        density=density,
        texture=texture,
        mirror=surface.mirror,
        shape=surface.shape,
        roots=roots,
        flow=flow.lines,
        lines=flow.parting,
        drawn_on=surface.drawn_on,
        varied=None if varied is None else varied.values,
        random=random,
        device=device,
        progress=part_of(progress, 0.0, _GROWN) if settings.drape else progress,
    )
    if not settings.drape:
        return GrownGuides(guides, status)
    if varied is not None:  # some may be longer than the setting
        longest = float(geometry.strands.lengths(guides.numpy()).max(initial=0.0))
        settings = replace(settings, length=max(groom_defaults.known(settings.length), longest))
    try:
        settled = dynamics.draped_growth.settled(
            guides,
            surface.mesh,
            settings,
            density=density,
            texture=texture,
            mirror=surface.mirror,
            progress=part_of(progress, _GROWN, 1.0),
        )
    except HairError as error:
        return GrownGuides(guides, error_text(error))
    return GrownGuides(settled, status)
