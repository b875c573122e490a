# SPDX-License-Identifier: GPL-3.0-or-later
"""Nearest surface of a point with its side, and surfaces that a fast point has crossed."""

import warp as wp

from .distance_grid import GridPlace

BACK = wp.constant(1e-4)  # offset of a ray's start before the point's last position [m]
_AT_EDGE = wp.constant(1e-5)  # barycentric coordinates below this limit count as zero
_TINY = wp.constant(1e-6)  # distance below which the face normal is used [m]


@wp.struct
class Motion:
    """Motion of the colliders in a substep, and their distance grid at its end."""

    # Bound of the residual motion of a vertex besides the rigid motion.
    motion: float
    # Affine motion of points with the colliders, and bound of the residual.
    carry: wp.mat33
    carry_shift: wp.vec3
    deformation: float
    # Motion since the beginning: rest coordinates = to_rest (x - moved).
    to_rest: wp.mat33
    moved: wp.vec3
    grid: GridPlace  # at rest


@wp.struct
class Surface:
    """`Colliders` for kernels."""

    mesh: wp.uint64
    points: wp.array[wp.vec3]
    previous: wp.array[wp.vec3]
    indices: wp.array[int]
    face_colliders: wp.array[int]
    rims: wp.array[int]
    settings: wp.array[wp.vec3]
    largest_distance: float
    distances: wp.array[float]  # of the grid; empty without a grid
    motions: wp.array[Motion]  # of the substeps of a frame
    substep: int  # present substep


@wp.struct
class Hit:
    """The surface nearest to a point. distance: along the normal, negative inside; collider: -1 for no surface."""

    distance: float
    gap: float  # absolute distance
    place: wp.vec3
    normal: wp.vec3
    displacement: wp.vec3
    collider: int
    side: int  # of a double-sided collider, as in `Samples.sides`


@wp.func
def _at_rim(rims: int, barycentric: wp.vec3):
    """Return whether a point of a face is on an edge without another face."""
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
    """Return the nearest surface within a radius; last: position of the point before the substep."""
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
        # Beyond a rim there is no inside: points can move around it.
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
    else:  # more accurate than the direction of a short vector
        hit.distance = wp.dot(away, face_normal)
    return hit


@wp.func
def crossed(surface: Surface, point: wp.vec3, start: wp.vec3, limit: float):
    """Return the surface that a point has crossed on its way from `start`, if this is farther than `limit`.

    start: the last position, moved along with the surface.
    """
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
        return hit  # from inside to outside
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
