# SPDX-License-Identifier: GPL-3.0-or-later
"""Python interface: distribution of guides, interpolation of hair, shading, and settings of a groom."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..core import dynamics
from ..core.errors import HairError
from ..core.files import settings_file
from ..core.files.settings_file import GroomSettings, require_styles
from ..core.geometry.mesh import TriMesh
from ..core.geometry.strands import Strands, check_strands
from ..core.grooming import groom_defaults
from ..core.grooming.groom import GuideSettings, HairSettings
from ..core.long_work import Progress, no_progress, run_now
from ..core.params import require_class
from ..core.placement import densities
from ..core.shading import presets
from ..core.shading.appearance import Appearance, shown_changes
from ..core.styling.base import StyleSettings
from . import systems
from .arguments import are_arrays, changed, checked_progress, choice, mesh_of, path_of, require_no_names
from .blender_access import blender
from .styles import styled_strands

# Blender's types exist only in Blender. Functions that accept Curves also accept their object.
Curves = Any
MeshObject = Any
Arrays = TriMesh | tuple[ArrayLike, ArrayLike]  # vertices (V, 3) [m] and triangles (F, 3)


# Growing.


def distribute_guides(
    surface: MeshObject | Arrays,
    settings: GuideSettings | None = None,
    *,
    progress: Progress = no_progress,
    **changes: Any,
) -> Curves | Strands:
    """Distribute guides evenly on a surface.

    surface: a mesh object, for which new guide Curves are returned, or (vertices (V, 3) [m], triangles (F, 3)), for
    which `Strands` are returned; settings: `GuideSettings`; changes: its fields by name; progress(step, part):
    callback. The length is computed from the surface unless given. guide_density, in guides per square centimeter,
    sets their number.

    >>> surface = bpy.data.objects["Scalp"]
    >>> guides = api.distribute_guides(surface, guide_count=50, length=0.3)
    >>> guides.name, len(guides.curves)
    ('Guides', 50)
    """
    settings, progress = changed(GuideSettings, settings, changes), checked_progress(progress)
    if are_arrays(surface):
        require_no_names(settings)
        mesh = mesh_of(surface)
        return dynamics.draped_growth.grow(mesh, _counted(settings, mesh), progress=progress)
    work = blender.groom.pipeline.distributing_guides(_grown_on(surface), settings, _depsgraph())
    return run_now(work, progress)


def interpolate_hair(
    guides: Curves | Strands,
    settings: HairSettings | None = None,
    *,
    mesh: Arrays | None = None,
    styles: Sequence[StyleSettings] = (),
    masks: Mapping[str, ArrayLike] | None = None,
    progress: Progress = no_progress,
    **changes: Any,
) -> Curves | Strands:
    """Interpolate strands between guides, and style them.

    guides: guide Curves, for which new hair Curves are returned, or `Strands` of guides on a `mesh` of arrays, for
    which `Strands` are returned; settings: `HairSettings`; styles: in the order of application; masks: for plain
    arrays, weights (V,) of vertices by the names that styles use; changes and progress: as in `distribute_guides`.
    Radius and influence distance are computed from the surface unless given. strand_density, in strands per square
    centimeter, sets their number. Strands use the mask of their guides
    unless `density_group` is set; with plain arrays, they cover the whole mesh.

    >>> hair = api.interpolate_hair(bpy.data.objects["Guides"], strand_count=2000, radius=0.001)
    >>> hair.vellus.hair.strand_count
    2000
    """
    settings, progress = changed(HairSettings, settings, changes), checked_progress(progress)
    if isinstance(guides, Strands):
        check_strands(guides)
        if mesh is None:
            raise HairError("Guides given as arrays need their surface: pass its arrays as mesh=.")
        require_no_names(settings)
        ground = mesh_of(mesh)
        return styled_strands(ground, guides, _counted(settings, ground), styles, masks, progress)

    if masks is not None:
        raise HairError("masks are for plain arrays: name a vertex group of the surface in the style.")
    styles, _names = require_styles(styles)
    growing = blender.groom.pipeline.interpolating_hair(
        blender.data.arguments.guides_of(guides), settings, _depsgraph(), styles=styles
    )
    hair = run_now(growing, progress)
    blender.groom.writing.keep_styles(hair, styles)
    return hair


def add_hair(
    surface: MeshObject, settings: GroomSettings | None = None, *, progress: Progress = no_progress
) -> tuple[Curves, Curves]:
    """Add guides and hair to a mesh object, with their look; returns the Curves of both. settings: `GroomSettings`.

    >>> settings = api.GroomSettings(api.GuideSettings(guide_count=30), api.HairSettings(strand_count=900))
    >>> guides, hair = api.add_hair(bpy.data.objects["Scalp"], settings)
    >>> len(guides.curves), len(hair.curves)
    (30, 900)
    """
    settings = GroomSettings() if settings is None else settings
    require_class(settings, GroomSettings, "settings")
    work = blender.groom.transfer.groom_settings.adding_hair(_grown_on(surface), settings, _depsgraph())
    return run_now(work, checked_progress(progress))


def points(strands: Curves | Strands) -> np.ndarray:
    """Return the points (S, P, 3) float32 [m] of guides or hair.

    Points of Curves are in world space, with Z up, deformed with their surface; points of `Strands` are unchanged.

    >>> api.points(bpy.data.objects["Hair"]).shape
    (2000, 41, 3)
    """
    if isinstance(strands, Strands):
        check_strands(strands)
        return strands.numpy()
    return blender.io.strand_arrays.world_points(_curves(strands))


# Shading.


def shade(hair: Curves, look: Appearance | str | None = None, *, model: str | None = None, **changes: Any) -> None:
    """Set the look of hair, for the viewport and for Cycles.

    look: an `Appearance`, a name of `look_names` such as "BLOND", or None for the current one; changes: fields of
    `Appearance`; model: "MARSCHNER" or "KAJIYA_KAY", None for the current one. Changing melanin, redness or tint,
    color, or absorption also selects that parametrization.

    >>> api.shade(bpy.data.objects["Hair"], "AUBURN", roughness=0.25)
    >>> api.settings_of(bpy.data.objects["Hair"]).appearance.roughness
    0.25
    """
    target = _curves(hair, "HAIR")
    present = blender.settings.properties.own_look_of(target.vellus)
    if isinstance(look, str):
        look = replace(_look(look), mode=present.mode)  # the mode is not part of a preset
    wanted = changed(Appearance, present if look is None else look, shown_changes(changes))
    if model is not None:
        choice(model, "model", [identifier for identifier, _label, _description in blender.settings.properties.MODELS])
    blender.groom.transfer.groom_settings.assign_look(target, wanted)
    if model is not None:
        target.vellus.model = model


def _look(name):
    """Return the built-in or saved `Appearance` of a name. Raises `HairError`."""
    if name in presets.PRESETS:
        return presets.PRESETS[name][1]
    return blender.settings.saved_looks.read(choice(name, "preset", systems.look_names()))


# Settings.


def settings_of(hair: Curves) -> GroomSettings:
    """Return the `GroomSettings` of hair Curves and their guides."""
    return blender.groom.transfer.groom_settings.settings_of(_curves(hair, "HAIR"))


def save_settings(path: str | os.PathLike, settings: GroomSettings) -> None:
    """Write `GroomSettings` as JSON.

    >>> api.save_settings("groom.json", api.settings_of(bpy.data.objects["Hair"]))
    """
    require_class(settings, GroomSettings, "settings")
    settings_file.write(path_of(path), settings)


def load_settings(path: str | os.PathLike) -> GroomSettings:
    """Read `GroomSettings` from a JSON file; omitted settings have their defaults.

    >>> api.load_settings("groom.json").hair.strand_count
    2000
    """
    return settings_file.read(path_of(path))


def apply_settings(hair: Curves, settings: GroomSettings) -> None:
    """Apply `GroomSettings` to hair Curves and their guides; combed guides are not changed.

    >>> settings = api.load_settings("groom.json")
    >>> api.apply_settings(bpy.data.objects["Hair"], settings)
    >>> bpy.context.view_layer.update()  # the strands are made here
    """
    require_class(settings, GroomSettings, "settings")
    blender.groom.transfer.groom_settings.apply_settings(_curves(hair, "HAIR"), settings)


# Arguments.


def _curves(given, kind=None):
    return blender.data.arguments.curves_of(given, kind)


def _counted(settings, mesh):
    """Return settings with the number for their density on a whole `TriMesh`. Raises `HairError`."""
    return densities.counted(settings, groom_defaults.grown_area(mesh)) if densities.is_set(settings) else settings


def _grown_on(given):
    """Return the mesh object for hair; prints a warning about inverted normals."""
    surface = blender.data.arguments.surface_object(given)
    warning = blender.data.usable_surfaces.inside_out_warning(surface)
    if warning is not None:
        blender.host.notices.say(warning[0].format(**warning[1]))
    return surface


def _depsgraph():
    return blender.data.scene.present_depsgraph()
