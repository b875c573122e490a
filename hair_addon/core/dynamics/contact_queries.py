# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels of contact.py: the nearest surface of each sample of a strand, as a plane.

A sample is a vertex, but for the root's, or the middle of a segment. Which rows of an array a vector or a plane takes
stands in `_index` alone.
"""

import warp as wp

# Nothing differentiates these kernels, and every device rounds as the processor does: no fused multiply-add.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

PLANE = wp.constant(8)  # rows of an array that a plane takes
NOWHERE = wp.constant(1e9)  # [m] from any collider

_MARGIN = wp.constant(1e-3)  # [m] beyond what motion takes
_MOST_MOTION = wp.constant(0.5)  # [m] of a point in a substep that is looked for: no farther, as it costs
_AHEAD = wp.constant(0.01)  # [m] at most, looked for beyond what is needed, to spare later queries
_SLACK = wp.constant(1e-5)  # [m] for rounding, so that no plane is missed
_BACK = wp.constant(1e-4)  # [m] before a point's last position, where its ray starts
_AT_EDGE = wp.constant(1e-5)  # a barycentric coordinate that counts as zero
_TINY = wp.constant(1e-6)  # [m]: nearer points take the normal of the face


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
    # How it moves and turns as a whole in this substep, and how far a vertex moves otherwise.
    turn: wp.mat33
    shift: wp.vec3
    motion: float
    # How it has since the beginning: place at rest = to_rest (x - moved).
    to_rest: wp.mat33
    moved: wp.vec3


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
def _index(row: int, per_vector: int, component: int):
    """The row of an array of vectors that holds a component."""
    return per_vector * row + component


@wp.func
def _vector(values: wp.array3d[float], group: int, row: int, lane: int):
    x = values[group, _index(row, 3, 0), lane]
    y = values[group, _index(row, 3, 1), lane]
    return wp.vec3(x, y, values[group, _index(row, 3, 2), lane])


@wp.func
def _put_vector(values: wp.array3d[float], group: int, row: int, lane: int, vector: wp.vec3):
    for component in range(3):
        values[group, _index(row, 3, component), lane] = vector[component]


@wp.func
def _put_plane(
    planes: wp.array3d[float],
    group: int,
    row: int,
    lane: int,
    normal: wp.vec3,
    offset: float,
    displacement: wp.vec3,
    friction: float,
):
    for component in range(3):
        planes[group, _index(row, PLANE, component), lane] = normal[component]
        planes[group, _index(row, PLANE, 4 + component), lane] = displacement[component]
    planes[group, _index(row, PLANE, 3), lane] = offset
    planes[group, _index(row, PLANE, 7), lane] = friction


@wp.func
def _sample(values: wp.array3d[float], group: int, sample: int, lane: int, is_middle: int):
    """The position of a sample: the vertex after the root, or the middle of a segment."""
    if is_middle == 0:
        return _vector(values, group, sample + 1, lane)
    return 0.5 * (_vector(values, group, sample, lane) + _vector(values, group, sample + 1, lane))


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
def _nearest(surface: Surface, point: wp.vec3, last: wp.vec3, radius: float, kept_side: int):
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
def _crossed(surface: Surface, hit: Hit, point: wp.vec3, last: wp.vec3, limit: float):
    """The surface that a point faster than `limit` a substep has passed through, if the nearest is not its front."""
    start = last + hit.displacement  # the surface stands still, seen from here
    way = point - start
    length = wp.length(way)
    if length <= limit or length <= _TINY:
        return hit
    direction = way / length
    query = wp.mesh_query_ray(surface.mesh, start - _BACK * direction, direction, length + _BACK)
    if not query.result:
        return hit
    collider = surface.face_colliders[query.face]
    normal = wp.normalize(query.normal)
    facing = wp.dot(normal, direction)
    is_sheet = surface.settings[collider][2] > 0.5
    if facing > 0.0 and not is_sheet:
        return hit  # out of the inside
    side = float(_side_of(-facing))
    normal *= side
    if hit.distance <= 0.0 and wp.dot(hit.normal, normal) > 0.0:
        return hit
    barycentric = wp.vec3(query.u, query.v, 1.0 - query.u - query.v)
    hit.collider = collider
    hit.place = wp.mesh_eval_position(surface.mesh, query.face, query.u, query.v)
    hit.displacement = _displacement(surface, query.face, barycentric)
    hit.normal = normal
    hit.distance = wp.dot(point - hit.place, normal)
    hit.gap = wp.abs(hit.distance)
    hit.side = 0
    if is_sheet:
        hit.side = int(side) * (collider + 1)
    return hit


@wp.func
def _ask_one(
    surface: Surface,
    positions: wp.array3d[float],
    last_positions: wp.array3d[float],
    is_middle: int,
    rise: float,
    is_final: int,
    is_skipping: int,
    group: int,
    sample: int,
    lane: int,
    rest: wp.array3d[float],
    sides: wp.array3d[int],
    asked: wp.array3d[float],
    clear: wp.array3d[float],
    out_planes: wp.array3d[float],
):
    row = sample + 1 - is_middle
    _put_plane(out_planes, group, row, lane, wp.vec3(), 0.0, wp.vec3(), 0.0)
    point = _sample(positions, group, sample, lane, is_middle)
    last = _sample(last_positions, group, sample, lane, is_middle)
    at_rest = rest[group, sample, lane]
    if at_rest < 0.0 and rise > 0.0:
        at_rest = wp.min(at_rest + rise, 0.0)
        rest[group, sample, lane] = at_rest
    # As the surface sees it, which moves and turns as a whole, but for what `surface.motion` says.
    motion = wp.length(point - (surface.turn * last + surface.shift))
    if not wp.isfinite(motion):
        return
    largest = wp.min(surface.largest_distance, at_rest)
    if is_middle == 1:
        along = _vector(positions, group, sample + 1, lane) - _vector(positions, group, sample, lane)
        if wp.length(along) <= 2.0 * largest:
            sides[group, sample, lane] = 0
            return
    motion = wp.min(motion, _MOST_MOTION) + surface.motion
    needed = wp.abs(largest) + motion + _MARGIN
    left = clear[group, sample, lane]
    if is_final == 0:
        left -= surface.motion
    place = surface.to_rest * (point - surface.moved)
    if is_skipping == 1 and left - wp.length(place - _vector(asked, group, sample, lane)) > needed + _SLACK:
        clear[group, sample, lane] = left
        sides[group, sample, lane] = 0
        return
    if left < 0.0:  # inside, maybe deeper
        needed = wp.max(needed, motion + _MARGIN - left)
    radius = needed + wp.min(_MARGIN + 4.0 * motion, _AHEAD)
    hit = _nearest(surface, point, last, radius, sides[group, sample, lane])
    _put_vector(asked, group, sample, lane, place)
    clear[group, sample, lane] = hit.gap
    if hit.collider >= 0 and hit.distance < 0.0:
        clear[group, sample, lane] = hit.distance
    if hit.collider < 0 or hit.gap > needed:
        sides[group, sample, lane] = 0
        return
    if at_rest >= 0.0:
        hit = _crossed(surface, hit, point, last, largest)
    sides[group, sample, lane] = hit.side
    settings = surface.settings[hit.collider]
    offset = wp.dot(hit.normal, hit.place) + wp.min(settings[1], at_rest)
    if wp.dot(hit.normal, hit.normal) < 0.5:  # of a face without an area
        return
    _put_plane(out_planes, group, row, lane, hit.normal, offset, hit.displacement, settings[0])


@wp.kernel
def ask(
    surface: Surface,
    positions: wp.array3d[float],
    last_positions: wp.array3d[float],
    sample_count: int,
    lanes_at_once: int,
    is_middle: int,
    rise: float,
    is_final: int,
    is_skipping: int,
    first: int,
    # outputs
    rest: wp.array3d[float],
    sides: wp.array3d[int],
    asked: wp.array3d[float],
    clear: wp.array3d[float],
    out_planes: wp.array3d[float],
):
    thread = first + wp.tid()
    part_count = positions.shape[2] // lanes_at_once
    first_lane = (thread % part_count) * lanes_at_once
    sample = (thread // part_count) % sample_count
    group = thread // (part_count * sample_count)
    for lane in range(first_lane, first_lane + lanes_at_once):
        _ask_one(
            surface,
            positions,
            last_positions,
            is_middle,
            rise,
            is_final,
            is_skipping,
            group,
            sample,
            lane,
            rest,
            sides,
            asked,
            clear,
            out_planes,
        )


@wp.func
def _normal(planes: wp.array3d[float], group: int, row: int, lane: int):
    x = planes[group, _index(row, PLANE, 0), lane]
    y = planes[group, _index(row, PLANE, 1), lane]
    return wp.vec3(x, y, planes[group, _index(row, PLANE, 2), lane])


@wp.func
def _gap(planes: wp.array3d[float], group: int, row: int, lane: int, point: wp.vec3):
    """How far a point is in front of a plane; `NOWHERE` where there is none."""
    normal = _normal(planes, group, row, lane)
    if wp.dot(normal, normal) < 0.5:
        return NOWHERE
    return wp.dot(normal, point) - planes[group, _index(row, PLANE, 3), lane]


@wp.func
def _choose_one(
    positions: wp.array3d[float],
    middle_planes: wp.array3d[float],
    sample_count: int,
    group: int,
    vertex: int,
    lane: int,
    planes: wp.array3d[float],
):
    point = _vector(positions, group, vertex, lane)
    least = _gap(planes, group, vertex, lane, point)
    chosen = int(-1)
    for segment in range(vertex - 1, wp.min(vertex + 1, sample_count)):
        gap = _gap(middle_planes, group, segment, lane, _sample(positions, group, segment, lane, 1))
        if gap < least:
            least = gap
            chosen = segment
    if chosen < 0:
        return
    for row in range(PLANE):
        value = middle_planes[group, _index(chosen, PLANE, row), lane]
        planes[group, _index(vertex, PLANE, row), lane] = value
    # The plane through the vertex that is as far behind it as the middle is behind its own: a segment whose middle
    # touches moves as a whole, and one that lies in the groom as it does is not turned.
    normal = _normal(planes, group, vertex, lane)
    planes[group, _index(vertex, PLANE, 3), lane] = wp.dot(normal, point) - least


@wp.kernel
def choose(
    positions: wp.array3d[float],
    middle_planes: wp.array3d[float],
    sample_count: int,
    lanes_at_once: int,
    first: int,
    # outputs
    planes: wp.array3d[float],
):
    thread = first + wp.tid()
    part_count = positions.shape[2] // lanes_at_once
    first_lane = (thread % part_count) * lanes_at_once
    vertex = (thread // part_count) % sample_count + 1
    group = thread // (part_count * sample_count)
    for lane in range(first_lane, first_lane + lanes_at_once):
        _choose_one(positions, middle_planes, sample_count, group, vertex, lane, planes)


@wp.kernel
def measure(
    surface: Surface,
    positions: wp.array3d[float],
    sample_count: int,
    lanes_at_once: int,
    is_middle: int,
    radius: float,
    first: int,
    # outputs
    rest: wp.array3d[float],
    sides: wp.array3d[int],
):
    thread = first + wp.tid()
    part_count = positions.shape[2] // lanes_at_once
    first_lane = (thread % part_count) * lanes_at_once
    sample = (thread // part_count) % sample_count
    group = thread // (part_count * sample_count)
    for lane in range(first_lane, first_lane + lanes_at_once):
        point = _sample(positions, group, sample, lane, is_middle)
        rest[group, sample, lane] = NOWHERE
        sides[group, sample, lane] = 0
        if wp.isfinite(wp.length(point)):
            hit = _nearest(surface, point, point, radius, 0)
            if hit.collider >= 0:
                rest[group, sample, lane] = hit.distance
                sides[group, sample, lane] = hit.side
