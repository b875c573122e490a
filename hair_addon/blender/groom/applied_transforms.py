# SPDX-License-Identifier: GPL-3.0-or-later
"""Transforms that were applied to a surface: its local coordinates changed, and nothing moved in the world.

*Apply*, *Set Origin* and their like do so, of the surface, of its parents, or of both. What has become of the local
coordinates follows from where the surface was, which three know: this session, the Curves themselves (as of the last
save), and the Curves' objects, as Blender keeps the children of what it applies where they are.
"""

import bpy
import numpy as np
from bpy.types import Curves, Depsgraph

from ...core.errors import HairError
from ...core.files import frame_manifest
from ...core.geometry.affine import Affine
from ..data import surface_space
from ..data.strands import (
    attributes,
    curves,
    curves_objects,
    delivered_hair,
    kept_shapes,
    simulated_guides,
    stored_roots,
)
from ..data.surfaces import Surface, cage_of
from . import bindings, pipeline, seen_shapes, staleness

_CLOSE = 1e-5  # parts of the surface's size
_ROUNDING = 1e-6  # parts of coordinates: they may be far from the origin
_ROOTED = 0.9  # of the strands: others may have slid since they were rooted


def find(strands: Curves, surface: Surface, to_world_before: Affine | None) -> Affine | None:
    """The `Affine` from the local coordinates that strands were rooted in to those of now; None where none was applied.

    to_world_before: where the surface's object was before, if that is known.
    """
    rest_before = _rest_before(strands, surface)
    for change in _candidates(strands, to_world_before):
        if rest_before is None:
            if _are_rooted(strands, surface, change) and not _are_rooted(strands, surface, Affine.identity()):
                return change
        elif rest_before.shape == surface.rest.shape and _is_close(change.points(rest_before), surface.rest, surface):
            return change
    return _fitted(strands, surface, rest_before)


def _fitted(strands, surface, rest_before):
    """The `Affine` from vertices before to those of now, where Blender shows that it applied something; else None.

    Of parents that are turned and unevenly scaled it loses the shear, and the surface moves when it is applied.
    """
    if rest_before is None or rest_before.shape != surface.rest.shape or not is_due(strands):
        return None
    before = np.hstack([rest_before.astype(np.float64), np.ones((len(rest_before), 1))])
    found, _residuals, rank, _sizes = np.linalg.lstsq(before, surface.rest.astype(np.float64), rcond=1e-6)
    change = Affine(np.vstack([found.T, [0.0, 0.0, 0.0, 1.0]]))
    # A flat mesh says nothing of the direction across it.
    is_found = rank == 4 and change.is_valid and _is_close(change.points(rest_before), surface.rest, surface)
    return change if is_found else None


def shift_of(rest_before: np.ndarray, surface: Surface) -> Affine | None:
    """The `Affine` by which all (V, 3) vertices of a surface were moved alike, as *Geometry to Origin* does; else None.

    What follows places on the surface, as noise that neighboring strands share, goes along.
    """
    shift = Affine.shift((surface.rest.astype(np.float64) - rest_before).mean(axis=0))
    return shift if _is_close(shift.points(rest_before), surface.rest, surface) else None


def note(strands: list[Curves], surface: Surface, change: Affine) -> None:
    """Note that a transform was applied to what strands are rooted on, before any of them follows.

    Of a scale that mirrors: Blender has turned the faces, and a `Surface` that is read afterwards knows it.
    """
    rest_before, vertices = _rest_before(strands[0], surface), _vertices_before(strands[0], surface)
    for one in strands:
        if change.is_mirroring and one.vellus.topology == surface.turned_topology:
            stored_roots.turn(one, surface.turned)
            # As baked frames know them, by the faces of the cage: `guide_baking.key_of`.
            before, now = (frame_manifest.digest(cage_of(key)) for key in (one.vellus.topology, surface.topology))
            surface_space.note_same(one, before, now)
            one.vellus.topology = surface.topology
            if one.vellus.cage_topology == surface.cage.turned_topology:
                one.vellus.cage_topology = surface.cage.topology
        surface_space.note_applied(one, change, rest_before, vertices)


def _rest_before(strands, surface):
    """(V, 3) vertices of the surface as strands know it, in their present order; None if they do not."""
    before, vertices = surface_space.rest_before(strands), _vertices_before(strands, surface)
    return before if before is None or vertices is None or len(before) != len(vertices) else before[vertices]


def _vertices_before(strands, surface):
    """The vertices of `FlippedFaces` if strands are rooted on the faces before a flip that renumbered others."""
    return surface.turned.vertices if strands.vellus.topology == surface.turned_topology else None


def follow(strands: Curves, surface: Surface, change: Affine, depsgraph: Depsgraph) -> None:
    """Keep strands where they are in the world: their points, widths and what else is stored in local units.

    Guides before their hair, and all when `note` has noted it.
    """
    firsts, followed = curves.first_points(strands), staleness.guides_digest(strands)
    left, baked_as = _left(strands, surface, change, firsts), _baked_as(strands)
    shown = simulated_guides.point_cache.get(strands.session_uid)
    if left is not change and _is_as_made(strands, surface, left, depsgraph):
        strands.vellus.written = staleness.guides_digest(strands)
    kept_shapes.move(strands, left.points, change.points)
    _widen(strands, change)
    if shown is not None:
        simulated_guides.show(strands, rooted_as(change.points(shown), shown, firsts, curves.first_points(strands)))
    for user in curves_objects.objects_of(strands):
        if delivered_hair.modifier_of(user) is not None:
            continue  # its frames stay in the coordinates of before
        if user.parent == strands.surface:
            curves_objects.attach_to_surface(user, strands.surface)
        else:  # its place in the world is the artist's
            user.matrix_world = user.matrix_world @ left.inverse.as_blender()
    bindings.invalidate(strands)
    stored = stored_roots.points(strands, surface)
    if stored is not None:
        firsts = curves.first_points(strands)
        curves.write_roots(strands, surface, stored, firsts=firsts)  # whose normals are in local coordinates
    _note_moved(strands, baked_as, followed)


def keep_seen(strands: Curves, surface: Surface, change: Affine) -> None:
    """Keep strands as they are seen where they turn with their surface by other angles now; when all have followed."""
    stay = seen_shapes.kept_by(strands, surface, change)
    if stay is None:
        return
    baked_as, followed, firsts = _baked_as(strands), staleness.guides_digest(strands), curves.first_points(strands)
    shown = simulated_guides.point_cache.get(strands.session_uid)
    kept_shapes.move(strands, stay)
    if shown is not None:
        moved = stay(shown.reshape(-1, 3)).reshape(shown.shape)
        simulated_guides.show(strands, rooted_as(moved, shown, firsts, curves.first_points(strands)))
    _note_moved(strands, baked_as, followed)


def _note_moved(strands, baked_as, followed):
    """Note that strands have moved with what was made of them.

    baked_as: `_baked_as` before; followed: their `guides_digest` before.
    """
    for before, now in zip(baked_as, _baked_as(strands), strict=True):
        surface_space.note_same(strands, before, now)
    for hair in curves.followers(strands):
        if hair.vellus.followed == followed:
            hair.vellus.followed = staleness.guides_digest(strands)


def is_due(strands: Curves) -> bool:
    """Whether an object of strands stands apart from their surface, as Blender leaves it when it applies transforms.

    Asked in every frame: no geometry is read.
    """
    surface_object = strands.surface
    if surface_object is None or strands.vellus.kind == "NONE" or strands.library is not None:
        return False
    return any(curves_objects.has_own_transform(user) for user in curves_objects.objects_of(strands))


def rooted_as(moved: np.ndarray, points: np.ndarray, roots: np.ndarray, moved_roots: np.ndarray) -> np.ndarray:
    """Moved (G, P, 3) points of guides, whose roots are to the last bit those of the moved guides where they were so.

    points: before; roots, moved_roots: (G, 3) of the guides, before and now.
    """
    if len(points) == len(roots) == len(moved_roots):
        is_same = (points[:, 0] == roots).all(axis=1)
        moved[is_same, 0] = moved_roots[is_same]
    return moved


def _candidates(strands, to_world_before):
    """Changes of local coordinates that the places of objects tell of, the most exact ones first."""
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
    """The part of a change that strands still have to make: Blender has applied it to those that were selected, too."""
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
    """Digests by which baked frames know guides: of their points, which `follow` moves."""
    if strands.vellus.kind != "GUIDES" or not len(strands.curves):
        return []
    return [frame_manifest.digest(curves.even_local_points(strands))]


def _is_as_made(hair, surface, left, depsgraph):
    """Whether nobody but Blender, which applied a transform to it too, has moved hair: it is as its guides make it."""
    if hair.vellus.kind != "HAIR" or curves.is_hand_made(hair):
        return False
    try:
        made = pipeline.bind_hair(*pipeline.inputs_of(hair), depsgraph, hair).points.reshape(-1, 3)
    except HairError:
        return False
    present = left.points(curves.read_points(hair))
    return len(made) == len(present) and np.allclose(present, made, rtol=0.0, atol=10.0 * _tolerance(surface))


def _are_rooted(strands, surface, change):
    """Whether most strands begin at their stored roots after a change."""
    places = _root_places(strands, surface)
    if places is None:
        return False
    is_rooted, wanted = places
    apart = np.linalg.norm(change.points(curves.first_points(strands)[is_rooted]) - wanted[is_rooted], axis=1)
    return np.mean(apart <= 10.0 * _tolerance(surface)) >= _ROOTED


def _root_places(strands, surface):
    """((S,) bool: which strands have stored roots, (S, 3) local places of these at rest); None where none has."""
    places = stored_roots.places(strands, len(surface.rest))
    if places is None or len(places[0]) != len(strands.curves):
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
    """Multiply what strands store of widths and distances in local units."""
    curves.widen(strands, change)
    apart = attributes.read(strands, "root_distance", "FLOAT", "CURVE")
    if apart is not None:
        attributes.write(strands, "root_distance", "FLOAT", "CURVE", change.widths(apart))


def followed_by(strands: Curves) -> list[Curves]:
    """The hair that goes with guides to other coordinates: not hair that finds out by itself, as kept hair does."""
    return [
        hair for hair in curves.followers(strands) if hair.surface == strands.surface and not curves.is_hand_made(hair)
    ]


def left_alone(surface_object: bpy.types.Object) -> list[Curves]:
    """Hair on a mesh object that no guides on it carry: their Curves are gone, or on another object."""

    def is_alone(hair):
        guides = hair.vellus.guide_curves
        return guides is None or guides.surface != surface_object

    found = [hair for hair in bpy.data.hair_curves if hair.surface == surface_object and hair.vellus.kind == "HAIR"]
    return [hair for hair in found if not curves.is_hand_made(hair) and is_alone(hair)]
