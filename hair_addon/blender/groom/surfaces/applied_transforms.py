# SPDX-License-Identifier: GPL-3.0-or-later
"""Transforms applied to a surface: its local coordinates change, and nothing moves in the world.

*Apply*, *Set Origin* and similar operators do this to the surface, to its parents, or to both. The change of local
coordinates follows from the former transform of the surface. It is stored in this session, in the Curves (as of the
last save), and in the transforms of the Curves' objects, as Blender keeps children in place when it applies transforms.
"""

import bpy
import numpy as np
from bpy.types import Curves, Depsgraph

from ....core.errors import HairError
from ....core.files import frame_manifest
from ....core.geometry.affine import Affine
from ...data import surface_space
from ...data.strands import (
    attributes,
    curves,
    curves_objects,
    delivered_hair,
    gathered_groups,
    kept_shapes,
    simulated_guides,
    stored_roots,
)
from ...data.surfaces import Surface, cage_of
from .. import bindings, pipeline, staleness
from . import posed_shapes

_CLOSE = 1e-5  # fraction of the surface's size
_ROUNDING = 1e-6  # fraction of coordinates: they may be far from the origin
_ROOTED = 0.9  # fraction of the strands: others may have slid since they were rooted


def find(strands: Curves, surface: Surface, to_world_before: Affine | None) -> Affine | None:
    """Return the `Affine` from the local coordinates in which strands were rooted to the present ones; None if none.

    to_world_before: the former transform of the surface's object, if it is known.
    """
    if _is_rooted_elsewhere(strands):
        return _kept_by_objects(strands, to_world_before)
    rest_before = _rest_before(strands, surface)
    for change in _candidates(strands, to_world_before):
        if rest_before is None:
            if _are_rooted(strands, surface, change) and not _are_rooted(strands, surface, Affine.identity()):
                return change
        elif rest_before.shape == surface.rest.shape and _is_close(change.points(rest_before), surface.rest, surface):
            return change
    return _fitted(strands, surface, rest_before)


def _is_rooted_elsewhere(strands):
    """Whether strands are hair between guides of another surface: its roots are on that surface."""
    guides = strands.vellus.guide_curves
    if strands.vellus.kind != "HAIR" or guides is None or curves.is_hand_made(strands):
        return False
    return guides.surface not in (None, strands.surface)


def _kept_by_objects(strands, to_world_before):
    """Return the change of the surface's transform if the objects of strands still have its former transform.

    Blender keeps children in place when it applies transforms. An artist may have placed objects elsewhere.
    """
    now, objects = surface_space.to_world(strands.surface), curves_objects.objects_of(strands)
    if not (objects and now.is_valid and to_world_before is not None and to_world_before.is_valid):
        return None
    change = now.inverse @ to_world_before
    left = surface_space.between(objects[0], strands.surface)
    is_left = is_due(strands) and np.allclose(left.matrix, change.matrix, rtol=_CLOSE, atol=_CLOSE)
    return change if is_left and not change.is_identity else None


def _fitted(strands, surface, rest_before):
    """Return the `Affine` fitted to vertices before and now, if `is_due` shows an applied transform; else None.

    Blender loses the shear of rotated and unevenly scaled parents, so such a surface moves when they are applied.
    """
    if rest_before is None or rest_before.shape != surface.rest.shape or not is_due(strands):
        return None
    before = np.hstack([rest_before.astype(np.float64), np.ones((len(rest_before), 1))])
    found, _residuals, rank, _sizes = np.linalg.lstsq(before, surface.rest.astype(np.float64), rcond=1e-6)
    change = Affine(np.vstack([found.T, [0.0, 0.0, 0.0, 1.0]]))
    # A flat mesh does not determine the direction across it.
    is_found = rank == 4 and change.is_valid and _is_close(change.points(rest_before), surface.rest, surface)
    return change if is_found else None


def shift_of(rest_before: np.ndarray, surface: Surface) -> Affine | None:
    """Return the common shift of all (V, 3) vertices of a surface, as by *Geometry to Origin*; None if there is none.

    Noise shared by neighboring strands, and everything else that depends on places on the surface, is shifted too.
    """
    shift = Affine.shift((surface.rest.astype(np.float64) - rest_before).mean(axis=0))
    return shift if _is_close(shift.points(rest_before), surface.rest, surface) else None


def note(strands: list[Curves], surface: Surface, change: Affine) -> None:
    """Record a transform applied to the surface of strands, before any of them follows.

    If it mirrors, Blender has flipped the faces; a `Surface` that is read afterwards has the flipped topology too.
    """
    rest_before, vertices = _rest_before(strands[0], surface), _vertices_before(strands[0], surface)
    for one in strands:
        if change.is_mirroring and one.vellus.topology == surface.turned_topology:
            stored_roots.turn(one, surface.turned)
            # Baked frames are keyed by the faces of the cage: `guide_baking.key_of`.
            before, now = (frame_manifest.digest(cage_of(key)) for key in (one.vellus.topology, surface.topology))
            surface_space.note_same(one, before, now)
            one.vellus.topology = surface.topology
            if one.vellus.cage_topology == surface.cage.turned_topology:
                one.vellus.cage_topology = surface.cage.topology
        surface_space.note_applied(one, change, rest_before, vertices)


def _rest_before(strands, surface):
    """Return the (V, 3) vertices of the surface stored with strands, in their present order; None if not stored."""
    before, vertices = surface_space.rest_before(strands), _vertices_before(strands, surface)
    return before if before is None or vertices is None or len(before) != len(vertices) else before[vertices]


def _vertices_before(strands, surface):
    """Return the vertices of `FlippedFaces` if strands are rooted on the faces before a flip; else None."""
    return surface.turned.vertices if strands.vellus.topology == surface.turned_topology else None


def follow(strands: Curves, surface: Surface, change: Affine, depsgraph: Depsgraph) -> None:
    """Keep strands in place in the world: transform points, widths and everything else stored in local units.

    Call it after `note`, for guides before their hair.
    """
    firsts, followed = curves.first_points(strands), staleness.guides_digest(strands)
    left, baked_as = _left(strands, surface, change, firsts), _baked_as(strands)
    shown = simulated_guides.point_cache.get(strands.session_uid)
    if left is not change and _is_as_made(strands, surface, left, depsgraph):
        strands.vellus.written = staleness.guides_digest(strands)
    kept_shapes.move(strands, left.points, change.points)
    _widen(strands, change)
    if shown is not None:
        simulated_guides.show(
            strands, with_exact_roots(change.points(shown), shown, firsts, curves.first_points(strands))
        )
    for user in curves_objects.objects_of(strands):
        if delivered_hair.modifier_of(user) is not None:
            continue  # its frames stay in the former coordinates
        if user.parent == strands.surface:
            curves_objects.attach_to_surface(user, strands.surface)
        else:  # an artist placed it
            user.matrix_world = user.matrix_world @ left.inverse.as_blender()
    bindings.invalidate(strands)
    stored = stored_roots.points(strands, surface)
    if stored is not None:
        firsts = curves.first_points(strands)
        curves.write_roots(strands, surface, stored, firsts=firsts)  # normals of roots are in local coordinates
    _note_moved(strands, baked_as, followed)


def keep_posed_shape(strands: Curves, surface: Surface, change: Affine) -> None:
    """Keep the posed shape of strands whose rotation with the surface has changed; call it after `follow`."""
    stay = posed_shapes.rest_correction(strands, surface, change)
    if stay is None:
        return
    baked_as, followed, firsts = _baked_as(strands), staleness.guides_digest(strands), curves.first_points(strands)
    shown = simulated_guides.point_cache.get(strands.session_uid)
    kept_shapes.move(strands, stay)
    if shown is not None:
        moved = stay(shown.reshape(-1, 3)).reshape(shown.shape)
        simulated_guides.show(strands, with_exact_roots(moved, shown, firsts, curves.first_points(strands)))
    _note_moved(strands, baked_as, followed)


def _note_moved(strands, baked_as, followed):
    """Record that strands have moved together with their baked frames and their hair.

    baked_as: `_baked_as` before; followed: their `guides_digest` before.
    """
    for before, now in zip(baked_as, _baked_as(strands), strict=True):
        surface_space.note_same(strands, before, now)
    for hair in curves.followers(strands):
        if hair.vellus.followed == followed:
            hair.vellus.followed = staleness.guides_digest(strands)


def is_due(strands: Curves) -> bool:
    """Whether an object of strands has a transform of its own, as Blender leaves it when it applies transforms.

    Called in every frame: reads no geometry.
    """
    surface_object = strands.surface
    if surface_object is None or strands.vellus.kind == "NONE" or strands.library is not None:
        return False
    return any(curves_objects.has_own_transform(user) for user in curves_objects.objects_of(strands))


def with_exact_roots(moved: np.ndarray, points: np.ndarray, roots: np.ndarray, moved_roots: np.ndarray) -> np.ndarray:
    """Set the roots of moved (G, P, 3) points to `moved_roots`, bit for bit, where they were equal to `roots`.

    points: before; roots, moved_roots: (G, 3) of the guides, before and now.
    """
    if len(points) == len(roots) == len(moved_roots):
        is_same = (points[:, 0] == roots).all(axis=1)
        moved[is_same, 0] = moved_roots[is_same]
    return moved


def _candidates(strands, to_world_before):
    """Yield possible changes of local coordinates from the transforms of objects, the most exact first."""
    now = surface_space.to_world(strands.surface)
    if not now.is_valid:
        return
    of_objects = [surface_space.to_world(user) for user in curves_objects.objects_of(strands)]
    for before in (to_world_before, surface_space.to_world_before(strands), *of_objects):
        if before is None or not before.is_valid:
            continue
        change = now.inverse @ before
        if not change.is_identity:
            yield change


def _left(strands, surface, change, firsts):
    """Return the remaining part of a change: Blender has already applied it to selected strands."""
    places = _root_places(strands, surface)
    objects = curves_objects.objects_of(strands)
    if places is None or not objects:
        return change
    of_object = surface_space.to_world(strands.surface).inverse @ surface_space.to_world(objects[0])
    is_rooted, wanted = places

    def distance(candidate):
        return np.linalg.norm(candidate.points(firsts[is_rooted]) - wanted[is_rooted], axis=1).mean()

    best, tolerance = change, distance(change) + _tolerance(surface)
    for candidate in (Affine.identity(), of_object):
        if distance(candidate) + _tolerance(surface) < tolerance:
            best, tolerance = candidate, distance(candidate) + _tolerance(surface)
    return best


def _baked_as(strands):
    """Return the digests of guides that key baked frames: of their points, which `follow` moves."""
    if strands.vellus.kind != "GUIDES" or not len(strands.curves):
        return []
    return [frame_manifest.digest(curves.even_local_points(strands))]


def _is_as_made(hair, surface, left, depsgraph):
    """Whether hair equals the strands interpolated from its guides, apart from a transform that Blender applied."""
    if hair.vellus.kind != "HAIR" or curves.is_hand_made(hair):
        return False
    try:
        made = pipeline.bind_hair(*pipeline.inputs_of(hair), depsgraph, hair).points.reshape(-1, 3)
    except HairError:
        return False
    present = left.points(curves.read_points(hair))
    return len(made) == len(present) and np.allclose(present, made, rtol=0.0, atol=10.0 * _tolerance(surface))


def _are_rooted(strands, surface, change):
    """Whether most strands start at their stored roots after a change."""
    places = _root_places(strands, surface)
    if places is None:
        return False
    is_rooted, wanted = places
    apart = np.linalg.norm(change.points(curves.first_points(strands)[is_rooted]) - wanted[is_rooted], axis=1)
    return np.mean(apart <= 10.0 * _tolerance(surface)) >= _ROOTED


def _root_places(strands, surface):
    """Return (mask (S,) of strands with stored roots, (S, 3) local positions of these at rest); None if none has."""
    places = stored_roots.places(strands, len(surface.rest))
    if places is None or len(places[0]) != len(strands.curves) or _is_rooted_elsewhere(strands):
        return None
    vertices, barycentric = places
    is_rooted = barycentric.any(axis=1)
    if not is_rooted.any():
        return None
    return is_rooted, np.einsum("nc,ncx->nx", barycentric, surface.rest[vertices])


def _is_close(points, others, surface):
    return np.allclose(points, others, rtol=0.0, atol=_tolerance(surface))


def _tolerance(surface):
    return _CLOSE * surface.extent + _ROUNDING * float(abs(surface.rest).max(initial=0.0))


def _widen(strands, change):
    """Scale the widths and distances that strands store in local units."""
    curves.widen(strands, change)
    gathered_groups.scale(strands, change)
    apart = attributes.read(strands, "root_distance", "FLOAT", "CURVE")
    if apart is not None:
        attributes.write(strands, "root_distance", "FLOAT", "CURVE", change.widths(apart))


def followed_by(strands: Curves) -> list[Curves]:
    """Return the hair that is transformed with its guides; hand-made hair is excluded, as it follows by itself."""
    return [
        hair for hair in curves.followers(strands) if hair.surface == strands.surface and not curves.is_hand_made(hair)
    ]


def hair_without_guides(surface_object: bpy.types.Object) -> list[Curves]:
    """Return hair on a mesh object without guides on the same object: they are deleted or elsewhere."""

    def is_alone(hair):
        guides = hair.vellus.guide_curves
        return guides is None or guides.surface != surface_object

    found = [hair for hair in bpy.data.hair_curves if hair.surface == surface_object and hair.vellus.kind == "HAIR"]
    return [hair for hair in found if not curves.is_hand_made(hair) and is_alone(hair)]
