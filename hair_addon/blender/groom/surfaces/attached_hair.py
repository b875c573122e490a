# SPDX-License-Identifier: GPL-3.0-or-later
"""Attachment of guides and hair to another mesh object, without moving them in the world."""

from collections.abc import Callable, Iterable

import numpy as np
from bpy.types import Curves, Depsgraph, Object

from ....core.errors import HairError
from ....core.geometry.affine import Affine
from ....core.geometry.mesh import positions
from ...data import scene, surface_space, usable_surfaces
from ...data.strands import (
    attributes,
    curves,
    curves_objects,
    gathered_groups,
    kept_shapes,
    posed_strands,
    stored_roots,
)
from ...data.surfaces import Surface
from ...host.notices import name_of
from .. import bindings, staleness


def attach(
    parts: Iterable[Curves],
    surface_object: Object,
    depsgraph: Depsgraph,
    place_before: Callable[[Curves], Affine | None] = lambda _part: None,
) -> None:
    """Attach guides and hair to a mesh object, as its children and in its coordinates.

    Combed and kept strands keep their posed positions in the world and are rooted at the nearest points; others are
    regenerated. place_before: transform of a surface that is deleted. Raises `HairError` before anything changes.
    """
    parts = sorted(parts, key=lambda part: part.vellus.kind)  # guides before hair
    for part in parts:
        curves.require_editable(part)
    moved = [part for part in parts if surface_object not in (None, _surface_before(part))]
    to_world = surface_space.to_world(surface_object) if moved else Affine.identity()
    if not to_world.is_valid:
        raise HairError('"{name}" has a scale of zero: change its scale.', name=name_of(surface_object))
    changes = {part: to_world.inverse @ _place(part, place_before) for part in moved}
    staying = {part for part in moved if len(part.curves) and _stays(part)}
    carried, surface = {}, None
    if staying:
        curves.require_overridable(surface_object)
        usable_surfaces.require_evaluated(surface_object)
        curves_objects.store_rest_positions(surface_object)
        surface = scene.read_surface(surface_object, depsgraph)
        carried = {part: _Carried(part, changes[part], surface, depsgraph) for part in staying}
    followed = {part for part in parts if part.vellus.followed == staleness.guides_digest(part.vellus.guide_curves)}
    for part in parts:
        part.surface = surface_object
        for user in curves_objects.objects_of(part):
            curves_objects.attach_to_surface(user, surface_object)
        if part in changes:
            surface_space.note_applied(part, changes[part])
            bindings.invalidate(part)
        if part in staying and surface is not None:
            carried[part].write(surface)
        if part in changes:
            part.vellus.is_stale = part not in staying
        if part in staying and part in followed and curves.is_hand_made(part):
            part.vellus.followed = staleness.guides_digest(part.vellus.guide_curves)
        part.update_tag()


def _stays(part):
    """Whether Curves keep their positions: combed and kept ones, and those without automatic updates."""
    return curves.is_combed(part) or not part.vellus.is_live


def _place(part, place_before):
    """Return the `Affine` from local to world coordinates, also of a surface that is deleted."""
    users, surface_object = curves_objects.objects_of(part), _surface_before(part)
    if surface_object is not None:
        return surface_space.to_world(surface_object)
    known = place_before(part) or surface_space.to_world_before(part)
    if known is not None and known.is_valid:
        return known
    return surface_space.to_world(users[0]) if users else Affine.identity()


def _surface_before(part):
    """Return the mesh object that strands grow on; None if it is deleted."""
    found = surface_space.surface_before(part)
    return None if found is None or usable_surfaces.is_deleted(found) else found


class _Carried:
    """Strands on another surface, computed before anything changes."""

    def __init__(self, part: Curves, change: Affine, surface: Surface, depsgraph: Depsgraph) -> None:
        self._part, self._change = part, change
        self._counts = curves.point_counts(part)
        self._motion_before = _motion_of(part, depsgraph)
        firsts = self._seen(curves.read_points(part))[curves.curve_offsets(part)[:-1]]
        if not np.isfinite(firsts).all():
            raise HairError('"{name}" has non-finite coordinates: undo, or delete those strands.', name=name_of(part))
        self._pose = posed_strands.pose_of(surface)
        seen_mesh = surface.posed_mesh
        self._roots = curves.nearest_roots(surface, surface.from_local(firsts), seen_mesh)
        apart = np.linalg.norm(surface.from_local(firsts) - positions(seen_mesh, self._roots), axis=1)
        if apart.max() > np.ptp(seen_mesh.vertices, axis=0).max():
            sentence = '"{name}" is too far from "{mesh}": move the mesh to the hair, or transfer the groom.'
            raise HairError(sentence, name=name_of(part), mesh=surface.name)
        self._places = surface.places(self._roots)
        at_rest = self._to_rest(firsts, np.ones(len(firsts), np.int32))
        on_surface = np.einsum("nc,ncx->nx", self._places[1], surface.rest[self._places[0]])
        # Hand-made strands may start off their surface; all others are rooted on it.
        self._apart = np.linalg.norm(surface.from_local(at_rest - on_surface), axis=1)
        self._slide = np.zeros_like(at_rest) if curves.is_hand_made(part) else on_surface - at_rest

    def write(self, surface: Surface) -> None:
        """Write points, kept shapes, widths and roots."""
        kept_shapes.move(self._part, self._moved)
        curves.widen(self._part, self._change)
        gathered_groups.scale(self._part, self._change)
        if curves.is_hand_made(self._part):
            attributes.write(self._part, "root_distance", "FLOAT", "CURVE", self._apart / surface.scale)
        curves.write_roots(self._part, surface, self._roots)
        surface_space.keep_surface(self._part, surface)

    def _seen(self, points):
        """Return the posed positions of (N, 3) points, in the new surface's coordinates."""
        if self._motion_before is not None:
            motion, (*places, slides) = self._motion_before
            points = points + np.repeat(slides, self._counts, axis=0)
            points = posed_strands.carried(points, motion, places, self._counts)
        return self._change.points(points)

    def _to_rest(self, points, counts):
        if not self._pose.is_deformed:
            return points
        motion = self._pose.motion_at(self._places[0])
        return posed_strands.carried(points, motion, self._places, counts, is_back=True)

    def _moved(self, points):
        moved = self._to_rest(self._seen(points), self._counts)
        return moved + np.repeat(self._slide, self._counts, axis=0)


def _motion_of(part, depsgraph):
    """Return (`SurfaceMotion` of the strands' surface, their places and slides as from `Pose.rooted`).

    None at rest, and if the surface is deleted.
    """
    surface_object = _surface_before(part)
    if surface_object is None:
        return None
    pose = posed_strands.read_pose(surface_object, depsgraph)
    if pose.surface is None or not pose.is_deformed:
        return None
    firsts = curves.first_points(part)
    vertices, weights, *slides = pose.rooted(part.vellus.topology, stored_roots.slid_places(part), firsts)
    return pose.motion_at(vertices), (vertices, weights, slides[0] if slides else np.zeros_like(firsts))
