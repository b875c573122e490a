# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing of guides and hair to Curves, with their settings and the keys that detect outdated data."""

from collections.abc import Sequence
from concurrent.futures import Future

import numpy as np
from bpy.types import Curves, Object

from ...core.errors import HairError, memory_as_sentence
from ...core.geometry.strands import Strands, lengths
from ...core.grooming.groom import GuideSettings
from ...core.styling.base import StyleSettings
from ..data import guide_map_readers, scene, surface_space
from ..data.maps import strand_maps
from ..data.strands import attributes, curves, curves_objects, gathered_groups, kept_shapes, kept_widths, stored_roots
from ..data.surfaces import Surface, cage_of
from ..host.notices import name_of
from ..layers import carried_layers, carried_selections
from ..materials import looks
from ..settings import animated, ramp_nodes, setting_properties, style_items
from . import bindings, hair_outside, size_fitting, staleness
from .bindings import BoundHair
from .grown_guides import GrownGuides
from .size_fitting import Fits

# Relative to the guides' length, so that guides are visible on a surface of any size.
_GUIDE_RADIUS = 1.0 / 300.0


def write_guides(
    target: Curves | None,
    surface_object: Object,
    surface: Surface,
    grown: GrownGuides,
    settings: GuideSettings,
    key: str,
    flow_key: str,
    fits: Fits,
) -> Curves:
    """Write guides to Curves, None for those of a new object; returns the Curves.

    settings: completed, so with a length; key: `staleness.root_key`; flow_key: `drawn_lines.key` of their flow lines;
    fits: settings that are fitted to the surface.
    """
    guides = grown.strands
    require_count(target, *guides.points.shape)
    target = target or curves_objects.new_object("Guides", surface_object, is_rendered=False).data
    _keep_settings(target, "GUIDES", target.vellus.guides, settings)
    size_fitting.keep(target, fits)
    target.vellus.status = grown.status
    target.vellus.root_key, target.vellus.flow_key = key, flow_key
    before, selections = carried_layers.read(target, surface), carried_selections.read(target, surface)
    radii = np.full(guides.points.shape[1], _GUIDE_RADIUS * (settings.length or 0.0) / surface.scale, np.float32)
    points = Future()
    points.set_result(surface.to_local(guides.numpy()))
    rooted_on = curves.make_strands(target, surface, guides.roots, radii, surface.identities(guides.roots))
    curves.write_points(target, points)
    if before is None:
        gathered_groups.write(target, None)
    else:
        carried_layers.write(target, surface, before, guides.roots)
    carried_selections.write(target, surface, selections)
    surface_space.keep_surface(target, rooted_on)
    return target


def write_hand_made(surface_object: Object, surface: Surface, guides: Strands) -> Curves:
    """Create an object with guides that settings do not change, such as derived guides; returns the Curves."""
    target = curves_objects.new_object("Guides", surface_object, is_rendered=False).data
    points = guides.numpy()
    length = float(np.median(lengths(points)))
    radii = np.full(points.shape[1], _GUIDE_RADIUS * length / surface.scale, np.float32)
    target.vellus.kind = "GUIDES"
    curves.make_strands(target, surface, guides.roots, radii, surface.identities(guides.roots))
    attributes.write_positions(target, surface.to_local(points))
    target.vellus.written = curves.BY_HAND
    surface_space.keep_surface(target, surface)
    return target


def write_strands(target: Curves | None, surface_object: Object, guide_curves: Curves, bound: BoundHair) -> Curves:
    """Write growing hair to Curves, None for those of a new object; returns the Curves."""
    target = target or curves_objects.new_object("Hair", surface_object).data
    curves.require_not_linked(target)
    target.vellus.guide_curves = guide_curves
    bindings.keep(target, bound)
    write_hair(target)
    looks.evaluate_shading(target)
    looks.evaluate_guides(guide_curves)
    return target


@memory_as_sentence()
def write_hair(target: Curves) -> None:
    """Write the `BoundHair` of a hair Curves datablock, if there is one: all writes of hair go through here."""
    bound, state = bindings.of(target), target.vellus
    if bound is None or bound.is_written:
        return
    bound.update_points()
    if not bound.has_moved_only:
        _keep_settings(target, "HAIR", state.hair, bound.settings)
        state.status = bound.map_status
        state.thickness_key = ramp_nodes.text_of(state.thickness_ramp)
        size_fitting.keep(target, bound.fits)
        kept_shapes.forget(target)
        kept_widths.forget(target)
        state.root_key, state.parting_key = bound.root_key, bound.parting_key
        state.style_images_key = bound.styles.read.images_key
        binding, radii = bound.binding, bound.radii
        normals = binding.normals.numpy()
        curves.make_strands(
            target,
            bound.surface,
            binding.roots,
            radii,
            binding.identities,
            leaders=binding.leaders,
            normals=normals,
        )
        curves.write_clumps(target, bound.styles.clumps)
        if curves.write_wetness(target, bound.wetness) or strand_maps.has_looks(state):
            looks.evaluate_shading(target)
    if not bound.is_map_written and not attributes.is_from_library(target):
        curves.write_guide_map(target, bound.guide_map if _is_map_wanted(target, bound.settings) else None)
    hair_outside.keep_outside(target, bound)
    curves.write_points(target, bound.growing)
    state.is_stale = False  # choosing other guides has marked it
    state.followed = staleness.guides_digest(state.guide_curves)
    bound.is_written = bound.has_moved_only = bound.is_map_written = True
    _store_roots(state.guide_curves, bound)


def _is_map_wanted(target, settings):
    """Whether hair Curves store their guide map; exporters compute it if necessary (`guide_maps.of`)."""
    return settings.guide_map or guide_map_readers.are_read(target)


def fits(target: Curves, bound: BoundHair) -> bool:
    """Whether a hair Curves datablock has as many points as its binding.

    Raises `HairError` if it has not and belongs to another file, as Blender would not save its new size.
    """
    if bound.points.size == 3 * len(target.points):
        return True
    if attributes.is_from_library(target):
        raise _other_count(target)
    return False


def require_count(target: Curves | None, strand_count: int, point_count: int) -> None:
    """Raise `HairError` if changed settings would resize Curves of another file, as Blender would not save that.

    Animated settings may resize them: a shot plays them as the file does.
    """
    if target is None or not attributes.is_from_library(target) or animated.are_keyed(target):
        return
    if strand_count * point_count != len(target.points):
        raise _other_count(target)


def _other_count(target):
    is_hair, name, count = target.vellus.kind == "HAIR", name_of(target), len(target.curves)
    if is_hair:
        return HairError('"{name}" keeps the {count} strands of its file: change them there.', name=name, count=count)
    return HairError('"{name}" keeps the {count} guides of its file: change them there.', name=name, count=count)


def keep_styles(target: Curves, styles: Sequence[StyleSettings], names: Sequence[str] = ()) -> None:
    """Store the styles that new hair was generated with; names: of the styles, empty for default names."""
    style_items.assign(target.vellus, styles, names)
    target.vellus.is_stale = False
    looks.evaluate_shading(target)


def _store_roots(guide_curves, bound):
    """Store the roots of guides that were drawn or slid by a brush, so that they follow their surface."""
    if guide_curves is None or attributes.is_from_library(guide_curves) or guide_curves.session_uid != bound.guide_uid:
        return
    roots, surface = bound.guides.roots, bound.surface
    present, firsts, stored = guide_curves.vellus.topology, None, stored_roots.cage_points(guide_curves, surface)
    if stored is None and present != surface.topology and cage_of(present) == cage_of(surface.topology):
        # They are rooted on the subdivided surface, and were not placed on its cage.
        surface = scene.shown_surface(guide_curves.surface, surface)
        if present != surface.topology:
            return
        firsts, stored = curves.first_points(guide_curves), stored_roots.points(guide_curves, surface, is_complete=True)
        roots = curves.read_roots(guide_curves, surface, surface.from_local(firsts))
    if stored is None or not stored.is_same(roots):
        curves.write_roots(guide_curves, surface, roots, firsts=firsts)


def _keep_settings(target, kind, group, settings):
    curves.require_not_linked(target)
    setting_properties.assign(group, settings)
    target.vellus.kind = kind
    target.vellus.is_stale = False
    target.vellus.status = ""
