# SPDX-License-Identifier: GPL-3.0-or-later
"""Sizes of guides and hair fitted to the surface, and refitted when the mask or the count changes.

Other changes do not refit them, so hair keeps its thickness in all frames of a moving surface.
"""

from dataclasses import dataclass, replace
from typing import Generic, TypeVar

import numpy as np
from bpy.types import Curves, PropertyGroup

from ...core.geometry.faces.uv_maps import Texture
from ...core.geometry.mesh import TriMesh
from ...core.grooming import groom_defaults
from ...core.grooming.groom import GuideSettings, HairSettings
from ...core.params import Settings
from ...core.placement import densities
from ..data.strands import attributes
from ..data.surfaces import Surface
from ..settings import fitted_sizes, setting_properties
from . import grown_guides, staleness

S = TypeVar("S", bound=Settings)

Mask = tuple[np.ndarray | None, Texture | None]


@dataclass(frozen=True)
class Fits:
    """Names of the fitted sizes, and the key of their inputs."""

    names: frozenset[str] = frozenset()
    key: str = ""


@dataclass(frozen=True)
class Sized(Generic[S]):
    """Completed settings, their `staleness.root_key` and their `Fits`."""

    settings: S
    root_key: str
    fits: Fits


def of_guides(
    given: GuideSettings, surface: Surface, mask: Mask, target: Curves | None = None, may_drape: bool = False
) -> Sized[GuideSettings]:
    """Return `GuideSettings` with unset sizes fitted; target: updated guides, whose fitted sizes are refitted.

    may_drape: let `grown_guides.draped_if_new` choose draping. A density sets their number, as for strands.
    """
    given = _counted(given, surface, mask, target)
    key = root_key(given, surface, mask)
    unchanged = unchanged_sizes(target and target.vellus.guides, given)
    is_refitted = target is not None and target.vellus.fit_key != key
    opened = fitted_sizes.opened(given, unchanged) if is_refitted else given
    completed = groom_defaults.complete(opened, surface.posed_mesh, *mask)
    names = unchanged | fitted_sizes.open_names(given) | ({"drape"} if may_drape else set())
    if may_drape:
        completed = grown_guides.draped_if_new(opened, completed, surface, mask[0])
    elif is_refitted and "drape" in unchanged and opened.gravity is None and not opened.flow_lines:
        draped = grown_guides.draped_if_new(opened, completed, surface, mask[0]).drape
        is_hanging = groom_defaults.known(completed.gravity) >= grown_guides.HANGING
        completed = replace(completed, drape=draped or (given.drape and is_hanging))
    return Sized(completed, key, Fits(frozenset(names), key))


def of_hair(
    given: HairSettings, surface: Surface, mask: Mask, guide_count: int, target: Curves | None = None
) -> Sized[HairSettings]:
    """Return `HairSettings` with unset sizes fitted; target: as for `of_guides`."""
    given = _counted(given, surface, mask, target)
    key = root_key(given, surface, mask)
    fit_key = f"{key} {guide_count}"
    unchanged = unchanged_sizes(target and target.vellus.hair, given)
    is_refitted = target is not None and target.vellus.fit_key != fit_key
    opened = fitted_sizes.opened(given, unchanged) if is_refitted else given
    completed = groom_defaults.complete(opened, surface.posed_mesh, *mask, guide_count)
    return Sized(completed, key, Fits(frozenset(unchanged | fitted_sizes.open_names(given)), fit_key))


def area_of(surface: Surface, mask: Mask) -> float:
    """Return the area [m²] that hair grows on at rest, in the scene's units, so that no frame changes densities.

    A subdivided surface counts with its vertices on the smooth surface, the same at every level. Raises `HairError`.
    """
    mesh = surface.mesh
    if mesh.smooth_vertices is not None:
        mesh = TriMesh(mesh.smooth_vertices, mesh.triangles)
    return groom_defaults.grown_area(mesh, *mask) * setting_properties.unit_length() ** 2


def _counted(given, surface, mask, target):
    """Return settings with the number for their density; Curves of another file keep the number stored there."""
    if not densities.is_set(given) or (target is not None and attributes.is_from_library(target)):
        return given
    return densities.counted(given, area_of(surface, mask))


def root_key(settings: Settings, surface: Surface, mask: Mask) -> str:
    """Return the `staleness.root_key` of settings and their mask."""
    density, texture = mask
    return staleness.root_key(settings, surface.of_cage(density), None if texture is None else texture.values)


def keep(target: Curves, fits: Fits) -> None:
    """Store `Fits` with Curves, after their sizes were written."""
    group = target.vellus.guides if target.vellus.kind == "GUIDES" else target.vellus.hair
    target.vellus.fit_key = fits.key
    fitted_sizes.keep_flags(group, dict.fromkeys(fits.names, True))


def show(hair: Curves, settings: HairSettings, fits: Fits) -> None:
    """Show the number and the fitted sizes of hair that is written later, without marking it."""
    names = fits.names | {"strand_count"}  # a density may have changed it
    fitted_sizes.keep_values(hair.vellus.hair, {name: getattr(settings, name) for name in names})
    hair.vellus.fit_key = fits.key


def unchanged_sizes(group: PropertyGroup | None, given: Settings) -> set[str]:
    """Return the fitted sizes of a property group that `given` settings do not change."""
    if group is None:
        return set()
    stored = setting_properties.to_settings(group, type(given))
    names = fitted_sizes.names_in(group, type(given))
    return {name for name in names if getattr(stored, name) == getattr(given, name)}
