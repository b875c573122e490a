# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides on an edited mesh: deformation with the surface, and new roots on changed faces."""

import enum
from collections.abc import Callable

import numpy as np
from bpy.types import Curves, Depsgraph, Object

from ....core.errors import HairError
from ....core.geometry.affine import Affine
from ....core.geometry.mesh import require_finite
from ...data import scene, surface_space
from ...data.strands import attributes, curves, stored_roots
from ...data.surfaces import cage_of, faces_of
from .. import bindings, frame_faces
from . import applied_transforms, edited_faces

_ROOTED_AGAIN = {
    "GUIDES": 'Faces of "{name}" were deleted: {guides} guides and {strands} strands moved to the nearest points.',
    "HAIR": 'Faces of "{name}" were deleted: {strands} strands moved to the nearest points.',
}

# Voxel Remesh makes two walls of a surface with holes: hair would grow on the inner wall too.
_CLOSED = 'The holes of "{name}" were closed by an inner wall, as by Voxel Remesh: undo, fill them, and remesh again.'


class Followed(enum.Enum):
    """The change that strands followed: none, an applied transform, which moves nothing in the world, or an edit.

    After an applied transform, the hair between guides has followed too and keeps its posed shape.
    """

    NOTHING = enum.auto()
    APPLIED = enum.auto()
    EDITED = enum.auto()


def follow_surface(
    guide_curves: Curves, depsgraph: Depsgraph, to_world_before: Affine | None = None, follows_edits: bool = True
) -> Followed:
    """Move guides, combed or not, or kept hair with an edited surface.

    to_world_before: transform of the surface's object before the edit, None if unknown. Shape keys and modifiers are
    not edits: strands are stored on the surface at rest. Roots of deleted faces move to the nearest points.
    follows_edits: if false, follow only applied transforms. Raises `HairError`, for linked guides only if they would
    change.
    """
    if surface_space.has_other_surface(guide_curves):
        return Followed.NOTHING  # they are about to be attached to it
    state = guide_curves.vellus
    surface = scene.read_surface(guide_curves.surface, depsgraph)
    if state.topology == surface.turned_topology:
        change = applied_transforms.find(guide_curves, surface, to_world_before)
        if change is not None and change.is_mirroring:
            _carry(guide_curves, surface, change, depsgraph)
            return Followed.APPLIED
    before, is_same = surface_space.rest_before(guide_curves), state.topology == surface.topology
    if not is_same and _is_divided_alone(guide_curves, surface, before):
        if follows_edits:
            edited_faces.change_level(guide_curves, surface)
        return Followed.NOTHING
    roots = stored_roots.places(guide_curves, len(surface.rest))
    stored = stored_roots.points(guide_curves, surface)
    if faces_of(state.topology) != faces_of(surface.topology) or roots is None or stored is None:
        if not follows_edits or frame_faces.differs_by_frame(guide_curves, surface):
            return Followed.NOTHING
        _reroot(guide_curves, surface, depsgraph)
        return Followed.EDITED
    if before is not None and before.shape != surface.rest.shape:
        before = surface.rest
    if is_same and before is not None and np.array_equal(before, surface.rest):
        return Followed.NOTHING
    change = applied_transforms.find(guide_curves, surface, to_world_before)
    if change is not None:
        if before is not None:
            edited_faces.root_on_present_level(guide_curves, surface, before)
        _carry(guide_curves, surface, change, depsgraph)
        return Followed.APPLIED
    if before is not None and follows_edits:
        _follow_moved(guide_curves, surface, before)
        return Followed.EDITED
    return Followed.NOTHING


def _reroot(guide_curves, surface, depsgraph):
    """Root strands on the edited faces; the status reports strands of deleted faces."""
    curves.require_not_linked(guide_curves)
    state = guide_curves.vellus
    was_open = state.is_on_open
    lost, lost_between = edited_faces.reroot(guide_curves, surface, depsgraph)
    if lost or lost_between:
        strand_count = lost_between if state.kind == "GUIDES" else lost
        is_remeshed = was_open and lost == len(guide_curves.curves) and not surface.is_open
        sentence = _CLOSED if is_remeshed else _ROOTED_AGAIN[state.kind]
        state.status = sentence.format(name=surface.name, guides=lost, strands=strand_count)


def _follow_moved(guide_curves, surface, before):
    """Move strands with the vertices of their surface; before: (V, 3), former positions of the vertices."""
    curves.require_not_linked(guide_curves)
    require_finite(surface.rest)
    shift = applied_transforms.shift_of(before, surface)
    if shift is not None:
        for one in (guide_curves, *applied_transforms.followed_by(guide_curves)):
            surface_space.note_applied(one, shift, before)
    edited_faces.follow_moved(guide_curves, surface, before)
    surface_space.keep_surface(guide_curves, surface)


def _is_divided_alone(guide_curves, surface, before):
    """Whether the former faces exist unchanged, with another level of subdivision."""
    if before is None or cage_of(guide_curves.vellus.topology) != cage_of(surface.topology):
        return False
    if faces_of(guide_curves.vellus.topology) == faces_of(surface.topology) or attributes.is_from_library(guide_curves):
        return False
    return np.array_equal(before[: surface.cage_size], surface.rest[: surface.cage_size])


def _carry(guide_curves, surface, change, depsgraph):
    """Keep guides and the hair between them in place after an `Affine` was applied to their surface."""
    curves.require_not_linked(guide_curves)
    require_finite(surface.rest)
    between = applied_transforms.followed_by(guide_curves)
    for hair in between:
        bound = bindings.of(hair)
        if bound is not None and not bound.is_written:
            hair.vellus.is_stale = True  # only data stored in the Curves is transformed
    targets = [guide_curves, *between]
    applied_transforms.note(targets, surface, change)
    surface = scene.read_surface(guide_curves.surface, depsgraph)
    for target in targets:
        applied_transforms.follow(target, surface, change, depsgraph)
    for target in targets:
        applied_transforms.keep_posed_shape(target, surface, change)
    surface_space.keep_surface(guide_curves, surface)


def follow_alone(
    surface_object: Object, depsgraph: Depsgraph, place_before: Callable[[Curves], Affine | None] = lambda _hair: None
) -> None:
    """Keep hair without guides on its surface in place, if a transform was applied to the surface.

    place_before: former transform of the surface of Curves, if known. Errors become the hair's status.
    """
    for hair in applied_transforms.hair_without_guides(surface_object):
        try:
            surface = scene.read_surface(surface_object, depsgraph)
            change = applied_transforms.find(hair, surface, place_before(hair))
            if change is not None:
                curves.require_not_linked(hair)
                applied_transforms.note([hair], surface, change)
                surface = scene.read_surface(surface_object, depsgraph)
                applied_transforms.follow(hair, surface, change, depsgraph)
                applied_transforms.keep_posed_shape(hair, surface, change)
        except HairError as error:
            hair.vellus.status = str(error)
