# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides and hair that keep a density: their number follows the area of their surface."""

from bpy.types import Curves, Depsgraph

from ....core.grooming.groom import GuideSettings, HairSettings
from ....core.placement import densities
from ...data import masks, surface_space
from ...data.strands import attributes, curves
from ...settings import setting_properties
from .. import bindings, pipeline, read_surfaces, size_fitting


def toggle(target: Curves, depsgraph: Depsgraph) -> None:
    """Let guides or hair keep their present density, or their number if they keep a density.

    Raises `HairError` before anything changes.
    """
    curves.require_editable(target)
    pipeline.require_uncombed(target)
    group = _settings(target)
    density = densities.name_of(group)
    count = getattr(group, densities.COUNTS[density])
    kept = 0.0 if densities.is_set(group) else densities.of_count(count, _area(target, depsgraph))
    setattr(group, density, kept)


def have_other_number(target: Curves, depsgraph: Depsgraph) -> bool:
    """Whether guides or hair keep a density that now gives another number, and may be generated again.

    Also true with a status, because the number of an earlier density may have been refused. Raises
    `HairError` if the surface or its mask cannot be read.
    """
    if not _may_change(target):
        return False
    settings_class = GuideSettings if target.vellus.kind == "GUIDES" else HairSettings
    settings = setting_properties.to_settings(_settings(target), settings_class)
    return bool(target.vellus.status) or densities.counted(settings, _area(target, depsgraph)) != settings


def have_other_scale(target: Curves) -> bool:
    """Whether guides or hair keep a density, and were generated at another scale of their surface.

    Hair that was not generated since its file was opened counts, as its scale is unknown. Nothing is read.
    """
    surface_object = curves.grown_on(target)
    if surface_object is None or target.vellus.kind == "NONE" or not densities.is_set(_settings(target)):
        return False
    if surface_space.is_flattened(surface_object):
        return False
    bound, before = bindings.of(target), surface_space.to_world_before(target)
    axes = bound.surface.to_world_axes if bound is not None else None if before is None else before.axes
    return axes is None or not surface_space.has_scale(surface_object, axes)


def _may_change(target):
    """Whether the number of guides or hair follows a density: not that of linked or hand-edited ones."""
    if target.vellus.kind == "NONE" or not densities.is_set(_settings(target)) or attributes.is_from_library(target):
        return False
    bound = bindings.of(target)
    return (bound is not None and not bound.is_written) or not curves.is_combed(target)


def _area(target, depsgraph):
    surface_object = curves.grown_on(target)
    surface = read_surfaces.read(surface_object, depsgraph)
    return size_fitting.area_of(surface, masks.of_curves(target).read(surface_object, surface, depsgraph))


def _settings(target):
    return target.vellus.guides if target.vellus.kind == "GUIDES" else target.vellus.hair
