# SPDX-License-Identifier: GPL-3.0-or-later
"""Python interface: styles."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import HairError
from ..core.files import style_presets
from ..core.files.settings_file import require_styles
from ..core.geometry.mesh import TriMesh
from ..core.geometry.strands import Strands
from ..core.grooming import following, groom, style_binding
from ..core.grooming.groom import HairSettings
from ..core.long_work import Progress, no_progress, part_of, run_now
from ..core.params import Param, array_of, declared, described, plain_value
from ..core.styling import lean, trim
from ..core.styling.base import StyleSettings, guide_set
from ..core.styling.kinds import OFFERS, kind_of
from ..core.styling.masks import Inputs, Mask
from ..core.styling.program import mask_keys
from . import systems
from .arguments import changed, checked_progress, choice
from .blender_access import blender

Curves = Any

__all__ = ["add_style", "apply_style_preset", "set_styles", "styles_of"]

_SWITCH = Param("")


def add_style(
    hair: Curves,
    style: str | StyleSettings,
    *,
    name: str = "",
    fit: bool = True,
    progress: Progress = no_progress,
    **changes: Any,
) -> StyleSettings:
    """Add a style after the other styles of hair Curves; returns its settings.

    style: a name in the menu such as "CURL" or "WAVE", or settings such as `Curl(…)`; name: in the list, by default the
    menu's; changes: fields of the style's settings; fit: whether the menu's lengths, which are for a human head, are
    scaled to the surface; values of `Curl(…)` and changes are never scaled; progress(step, part): callback for the
    placement of locks, may raise to cancel without a change. Without a `seed`, a style of the menu gets one that is
    unique among the hair's styles.

    >>> hair = bpy.data.objects["Hair"]
    >>> api.add_style(hair, "CURL", radius=0.004).radius
    0.004
    >>> [style.seed for style in api.styles_of(hair)]
    [0]
    """
    if isinstance(style, str):
        offer = OFFERS[choice(style, "style", OFFERS)]
        settings, name, kept = offer.settings, name or offer.label, tuple(changes)
    else:
        kind_of(style)
        settings, kept = style, [details[0] for details in declared(type(style))]
    settings = changed(type(settings), settings, changes)
    fit, name = plain_value("fit", fit, False, _SWITCH), plain_value("name", name, "", _SWITCH)
    target = blender.data.arguments.curves_of(hair, "HAIR")
    work = blender.groom.styles.hair_styles.adding(target, settings, name, is_fitted=fit, kept=kept)
    return run_now(work, checked_progress(progress))


def styles_of(hair: Curves) -> tuple[StyleSettings, ...]:
    """Return the styles of hair Curves in order, including disabled ones.

    >>> [type(style) is api.Curl for style in api.styles_of(bpy.data.objects["Hair"])]
    [True]
    """
    return blender.settings.style_items.styles_of(blender.data.arguments.curves_of(hair, "HAIR").vellus)


def set_styles(hair: Curves, styles: Sequence[StyleSettings], *, progress: Progress = no_progress) -> None:
    """Replace the styles of hair Curves; a style inherits the name and the keyframes of a previous style of its kind.

    progress: as in `add_style`.

    >>> api.set_styles(bpy.data.objects["Hair"], [api.Clump(size=0.5), api.Curl(radius=0.006), api.Frizz()])
    >>> len(api.styles_of(bpy.data.objects["Hair"]))
    3
    """
    styles, _names = require_styles(styles)
    target = blender.data.arguments.curves_of(hair, "HAIR")
    run_now(blender.groom.styles.hair_styles.assigning(target, styles), checked_progress(progress))


def apply_style_preset(
    hair: Curves, preset: str, *, fit: bool = True, keep_styles: bool = False, progress: Progress = no_progress
) -> None:
    """Replace the styles of hair Curves with those of a preset, a name of `style_preset_names` such as "CURLY".

    fit: whether lengths, which are for a human head, are scaled to the surface; keep_styles: append the preset's styles
    to the present ones instead of replacing them; progress: as in `add_style`.

    >>> api.apply_style_preset(bpy.data.objects["Hair"], "FRIZZY")
    >>> [style.octaves for style in api.styles_of(bpy.data.objects["Hair"])]
    [3]
    """
    name = choice(preset, "style preset", systems.style_preset_names())
    found = style_presets.read(name) if name in style_presets.PRESETS else blender.settings.saved_styles.read(name)
    fit, keep = plain_value("fit", fit, False, _SWITCH), plain_value("keep_styles", keep_styles, False, _SWITCH)
    target = blender.data.arguments.curves_of(hair, "HAIR")
    work = blender.groom.styles.hair_styles.applying_preset(target, found, is_fitted=fit, keeps_styles=keep)
    run_now(work, checked_progress(progress))


def styled_strands(
    mesh: TriMesh,
    guides: Strands,
    settings: HairSettings,
    styles: Sequence[StyleSettings],
    masks: Mapping[str, ArrayLike] | None,
    progress: Progress,
) -> Strands:
    """Return styled strands between guides on a mesh of arrays; arguments as in `api.interpolate_hair`."""
    styles, _names = require_styles(styles)
    if not isinstance(masks, Mapping | None):
        raise HairError(f"masks must be a dictionary of weights by their names, not {described(masks)}.")
    inputs = Inputs({key: _mask(mesh, masks or {}, key) for key in mask_keys(styles)})
    for style in styles:
        _require_arrays(style)
    binding = groom.bind_hair(mesh, guides, settings, progress=part_of(progress, 0.0, 0.5))
    trees = style_binding.clump_trees(mesh, guides.roots, settings)
    placing = part_of(progress, 0.5, 1.0)
    styling = style_binding.bind_styles(binding, guides, settings, styles, trees, inputs, progress=placing)
    return following.follow_guides(binding, guides, styling)


def _mask(mesh, masks, key):
    name, image, is_inverted = key
    if image:
        raise HairError("Images mask styles in Blender only: pass weights of vertices as masks={name: weights}.")
    if name not in masks:
        raise HairError(f"There is no mask {name!r}: pass weights of vertices as masks={{name: weights}}.")
    weights = array_of(masks[name], np.float32)
    if weights is None or weights.shape != (len(mesh.vertices),) or not np.isfinite(weights).all():
        raise HairError(f"The mask {name!r} must have a finite weight for each of {len(mesh.vertices)} vertices.")
    return Mask(weights[mesh.triangles], is_inverted=is_inverted)


def _require_arrays(style):
    if (isinstance(style, trim.Settings) and style.cutter) or (
        isinstance(style, lean.Settings) and style.direction == "OBJECT"
    ):
        raise HairError("Styles can refer to objects only in Blender: clear the object's name.")
    if guide_set(style):
        raise HairError("Selections of guides exist only in Blender: clear the name of the selection.")
