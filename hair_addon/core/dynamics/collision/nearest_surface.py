# SPDX-License-Identifier: GPL-3.0-or-later
"""The nearest surface of a point, which side of it the point is on, and what a fast point has passed through."""

import warp as wp

from .distance_grid import GridPlace

BACK = wp.constant(1e-4)  # [m] before a point's last position, where its ray starts
_AT_EDGE = wp.constant(1e-5)  # a barycentric coordinate that counts as zero
_TINY = wp.constant(1e-6)  # [m]: nearer points take the normal of the face


@wp.struct
class Motion:
    """How colliders move in one substep, and where their grid of distances is by its end."""

    # How far a vertex moves, at most, but for their turn as a whole.
    motion: float
    # Where points that move with them come to, and how far they deform otherwise.
    carry: wp.mat33
    carry_shift: wp.vec3
    deformation: float
    # How they have since the beginning: place at rest = to_rest (x - moved).
    to_rest: wp.mat33
    moved: wp.vec3
    grid: GridPlace  # at rest


@wp.struct
class Surface:
    """What kernels read of `Colliders`."""

    mesh: wp.uint64
    points: wp.array[wp.vec3]
    previous: wp.array[wp.vec3]
    indices: wp.array[int]
    face_colliders: wp.array[int]
    rims: wp.array[int]
    settings: wp.array[wp.vec3]
    largest_distance: float
    distances: wp.array[float]  # of the grid; empty where there is none
    motions: wp.array[Motion]  # of the substeps of a frame
    substep: int  # the present one


@wp.struct
class Hit:
    """The nearest surface: its distance from a point along the normal, negative inside; collider -1 where none is."""

    distance: float
    gap: float  # the distance, positive on either side
    place: wp.vec3
    normal: wp.vec3
    displacement: wp.vec3
    collider: int
    side: int  # of a double-sided collider, as `Samples.sides` keeps it


@wp.func
def _at_rim(rims: int, barycentric: wp.vec3):
    """Whether a point of a face is on an edge that has no other face."""
    for corner in range(3):
        if barycentric[corner] < _AT_EDGE and (rims >> corner) & 1 == 1:
            return True
        if barycentric[corner] > 1.0 - _AT_EDGE and (rims >> (3 + corner)) & 1 == 1:
            return True
    return False


@wp.func
def _displacement(surface: Surface, face: int, barycentric: wp.vec3):
    moved = wp.vec3()
    for corner in range(3):
        vertex = surface.indices[3 * face + corner]
        moved += barycentric[corner] * (surface.points[vertex] - surface.previous[vertex])
    return moved


@wp.func
def _side_of(value: float):
    if value < 0.0:
        return -1
    return 1


@wp.func
def nearest(surface: Surface, point: wp.vec3, last: wp.vec3, radius: float, kept_side: int):
    """The nearest surface within a radius; last: where the point was before the substep."""
    hit = Hit()
    hit.collider = -1
    hit.gap = radius
    query = wp.mesh_query_point_sign_normal(surface.mesh, point, radius)
    if not query.result:
        return hit
    face = query.face
    barycentric = wp.vec3(query.u, query.v, 1.0 - query.u - query.v)
    collider = surface.face_colliders[face]
    face_normal = wp.mesh_eval_face_normal(surface.mesh, face)
    hit.collider = collider
    hit.place = wp.mesh_eval_position(surface.mesh, face, query.u, query.v)
    hit.displacement = _displacement(surface, face, barycentric)
    sign = query.sign
    if _at_rim(surface.rims[face], barycentric):
        # There is no inside beyond a rim: the point may go around it.
        sign = 1.0
    elif surface.settings[collider][2] > 0.5:
        side = wp.sign(float(kept_side))
        if wp.abs(kept_side) != collider + 1:
            side = float(_side_of(wp.dot(face_normal, last + hit.displacement - hit.place)))
        sign *= side
        face_normal *= side
        hit.side = int(side) * (collider + 1)
    away = point - hit.place
    hit.gap = wp.length(away)
    hit.distance = sign * hit.gap
    hit.normal = face_normal
    if hit.gap > _TINY and wp.min(barycentric) < _AT_EDGE:
        hit.normal = away * (sign / hit.gap)
    else:  # more exact than the direction of a short way
        hit.distance = wp.dot(away, face_normal)
    return hit


@wp.func
def crossed(surface: Surface, point: wp.vec3, start: wp.vec3, limit: float):
    """The surface that a point has passed through since `start`, where the surface has moved to meanwhile, if that is
    farther than `limit`."""
    hit = Hit()
    hit.collider = -1
    way = point - start
    length = wp.length(way)
    if length <= limit or length <= _TINY:
        return hit
    direction = way / length
    query = wp.mesh_query_ray(surface.mesh, start - BACK * direction, direction, length + BACK)
    if not query.result:
        return hit
    collider = surface.face_colliders[query.face]
    normal = wp.normalize(query.normal)
    facing = wp.dot(normal, direction)
    is_sheet = surface.settings[collider][2] > 0.5
    if facing > 0.0 and not is_sheet:
        return hit  # out of the inside
    side = float(_side_of(-facing))
    barycentric = wp.vec3(query.u, query.v, 1.0 - query.u - query.v)
    hit.collider = collider
    hit.place = wp.mesh_eval_position(surface.mesh, query.face, query.u, query.v)
    hit.displacement = _displacement(surface, query.face, barycentric)
    hit.normal = normal * side
    hit.distance = wp.dot(point - hit.place, hit.normal)
    hit.gap = wp.abs(hit.distance)
    if is_sheet:
        hit.side = int(side) * (collider + 1)
    return hit
