# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels of contact.py: the nearest surface of each sample of a strand, as a plane.

A sample is a vertex except the root, or the midpoint of a segment. contact_needs.cpp selects the samples that query the
surface, for all lanes at once. `_index`, and `row_of` in that file, define the rows of vectors and planes.
"""

import warp as wp

from ...kernels import native_code
from .nearest_surface import BACK, Hit, Surface, crossed, nearest

# No gradients are needed. Without fused multiply-add all devices round alike.
BLOCK = 64  # threads of a GPU block: blocks of 256 are few per multiprocessor, and wait for their slowest query
wp.set_module_options({"enable_backward": False, "fuse_fp": False, "block_dim": BLOCK})

PLANE = wp.constant(8)  # rows of a plane
WIDTH = 16  # samples of a CPU thread
NOWHERE = wp.constant(1e9)  # distance without a collider [m]

MARGIN = wp.constant(1e-3)  # search margin for motion by the solver [m]
MOST_MOTION = wp.constant(0.5)  # largest motion of a point in a substep that extends the search [m]

_AHEAD = wp.constant(0.01)  # largest additional search radius, which saves later queries [m]


@wp.struct
class Samples:
    """State of the samples of strands between substeps, (groups, samples, lanes)."""

    rest: wp.array3d[float]  # distance in the groom [m], negative inside, `NOWHERE` if no collider is near
    sides: wp.array3d[int]  # ± (1 + collider) of a near double-sided collider, 0: none
    asked: wp.array3d[float]  # (groups, 3 samples, lanes): place of the last query [m], in rest coordinates
    clear: wp.array3d[float]  # distance at the last query minus the surface's motion since [m]; negative inside


@wp.struct
class QueryOptions:
    """Options of a query, as in `Contacts.find`."""

    is_final: int
    is_again: int
    is_skipping: int
    rise: float  # outward motion in this substep of samples that are inside a collider in the groom [m]


@wp.struct
class Query:
    """The samples that search for a plane, the kind of search, and the arrays with the samples."""

    surface: Surface
    asking: QueryOptions
    positions: wp.array3d[float]  # 3 rows per vertex [m]
    last_positions: wp.array3d[float]  # at the start of the substep
    middle_planes: wp.array3d[float]  # of segments, `PLANE` rows each
    is_middle: int  # 1: middles of segments; 0: vertices
    samples: Samples
    planes: wp.array3d[float]  # planes of these samples, which the query writes


@wp.func
def _index(row: int, per_vector: int, component: int):
    """Return the row of a vector's component."""
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
    """Return the position of a sample: a vertex after the root, or the midpoint of a segment."""
    if is_middle == 0:
        return _vector(values, group, sample + 1, lane)
    return 0.5 * (_vector(values, group, sample, lane) + _vector(values, group, sample + 1, lane))


@wp.func
def _normal(planes: wp.array3d[float], group: int, row: int, lane: int):
    x = planes[group, _index(row, PLANE, 0), lane]
    y = planes[group, _index(row, PLANE, 1), lane]
    return wp.vec3(x, y, planes[group, _index(row, PLANE, 2), lane])


@wp.func
def _gap(planes: wp.array3d[float], group: int, row: int, lane: int, point: wp.vec3):
    """Return the distance of a point in front of a plane; `NOWHERE` without a plane."""
    normal = _normal(planes, group, row, lane)
    if wp.dot(normal, normal) < 0.5:
        return NOWHERE
    return wp.dot(normal, point) - planes[group, _index(row, PLANE, 3), lane]


@wp.func_native(
    native_code.body(
        __file__,
        "contact_needs.cpp",
        WIDTH=WIDTH,
        PLANE=PLANE,
        MARGIN=MARGIN,
        NEAR=0.004,
        MOST_MOTION=MOST_MOTION,
        SLACK=1e-5,
        BACK=BACK,
        STAYED=1e-7,
    )
)
def _put_needs(query: Query, group: int, sample: int, first_lane: int) -> int: ...


@wp.func
def _look(query: Query, group: int, sample: int, lane: int, needed: float):
    """Write the plane of a sample if there is a surface within `needed`."""
    row = sample + 1 - query.is_middle
    point = _sample(query.positions, group, sample, lane, query.is_middle)
    last = _sample(query.last_positions, group, sample, lane, query.is_middle)
    at_rest = query.samples.rest[group, sample, lane]
    now = query.surface.motions[query.surface.substep]
    query.planes[group, _index(row, PLANE, 3), lane] = 0.0
    largest = wp.min(query.surface.largest_distance, at_rest)
    entry = Hit()
    entry.collider = -1
    radius = needed + wp.min(0.5 * needed, _AHEAD)
    hit = nearest(query.surface, point, last, radius, query.samples.sides[group, sample, lane])
    if now.deformation <= BACK and at_rest >= 0.0:
        start = now.carry * last + now.carry_shift
        way = wp.length(point - start)
        # The point cannot have crossed a surface that is farther away than its motion.
        if hit.gap <= way + 2.0 * BACK:
            entry = crossed(query.surface, point, start, largest)
            if entry.collider >= 0:
                needed = wp.max(needed, wp.abs(largest) + wp.min(way, MOST_MOTION) + MARGIN)
                if needed > radius and hit.collider < 0:
                    hit = nearest(query.surface, point, last, needed, query.samples.sides[group, sample, lane])
    if now.deformation > BACK and at_rest >= 0.0 and hit.collider >= 0:
        entry = crossed(query.surface, point, last + hit.displacement, largest)
    query.samples.sides[group, sample, lane] = 0
    _put_vector(query.samples.asked, group, sample, lane, now.to_rest * (point - now.moved))
    query.samples.clear[group, sample, lane] = hit.gap
    is_near = hit.collider >= 0 and hit.gap <= needed
    if entry.collider >= 0 and not (is_near and hit.distance <= 0.0 and wp.dot(hit.normal, entry.normal) > 0.0):
        hit = entry  # the nearest surface is not the front of the crossed one
    elif not is_near:
        return
    query.samples.clear[group, sample, lane] = wp.min(query.samples.clear[group, sample, lane], hit.distance)
    query.samples.sides[group, sample, lane] = hit.side
    settings = query.surface.settings[hit.collider]
    offset = wp.dot(hit.normal, hit.place) + wp.min(settings[1], at_rest)
    if wp.dot(hit.normal, hit.normal) > 0.5:  # zero for faces of zero area
        _put_plane(query.planes, group, row, lane, hit.normal, offset, hit.displacement, settings[0])


@wp.func
def _choose(
    positions: wp.array3d[float],
    middle_planes: wp.array3d[float],
    sample_count: int,
    group: int,
    vertex: int,
    lane: int,
    planes: wp.array3d[float],
):
    """Replace the plane of a vertex by that of an adjacent segment whose midpoint is less far in front of its plane."""
    point = _vector(positions, group, vertex, lane)
    own = _normal(planes, group, vertex, lane)
    least = _gap(planes, group, vertex, lane, point)
    chosen = int(-1)
    for segment in range(vertex - 1, wp.min(vertex + 1, sample_count)):
        gap = _gap(middle_planes, group, segment, lane, _sample(positions, group, segment, lane, 1))
        # A segment across a thin part has its ends on both sides, and must not pull one end through the part.
        if gap < least and wp.dot(own, _normal(middle_planes, group, segment, lane)) >= 0.0:
            least = gap
            chosen = segment
    if chosen < 0:
        return
    for row in range(PLANE):
        value = middle_planes[group, _index(chosen, PLANE, row), lane]
        planes[group, _index(vertex, PLANE, row), lane] = value
    # The plane is shifted so that the vertex is as far in front of it as the midpoint of its own plane: a segment whose
    # midpoint touches moves as a whole, and a segment that touches in the groom is not rotated.
    normal = _normal(planes, group, vertex, lane)
    planes[group, _index(vertex, PLANE, 3), lane] = wp.dot(normal, point) - least


@wp.func
def _look_in(query: Query, group: int, sample: int, first_lane: int, lanes_at_once: int):
    """Query the surface in the lanes marked by `_put_needs`."""
    row = sample + 1 - query.is_middle
    planes = query.planes
    for lane in range(first_lane, first_lane + lanes_at_once):
        if wp.length_sq(_normal(planes, group, row, lane)) > 0.0:
            continue  # it keeps its plane
        needed = planes[group, _index(row, PLANE, 3), lane]
        is_beside = planes[group, _index(row, PLANE, 7), lane] > 0.0
        if is_beside:
            planes[group, _index(row, PLANE, 7), lane] = 0.0
        if needed > 0.0:
            _look(query, group, sample, lane, needed)
        if is_beside:
            _choose(query.positions, query.middle_planes, query.samples.rest.shape[1], group, row, lane, planes)


@wp.func
def find_in(
    query: Query, group: int, first_sample: int, samples_at_once: int, first_lane: int, lanes_at_once: int
) -> int:
    """Write the planes of some samples of some lanes; return whether any of them queried the surface."""
    is_near = int(0)
    for sample in range(first_sample, first_sample + samples_at_once):
        if _put_needs(query, group, sample, first_lane) != 0:
            is_near = 1
            _look_in(query, group, sample, first_lane, lanes_at_once)
    return is_near


@wp.func
def query_of(
    surface: Surface,
    asking: QueryOptions,
    positions: wp.array3d[float],
    last_positions: wp.array3d[float],
    middle_planes: wp.array3d[float],
    is_middle: int,
    samples: Samples,
    planes: wp.array3d[float],
):
    """Return the `Query` of these arguments."""
    query = Query()
    query.surface = surface
    query.asking = asking
    query.positions = positions
    query.last_positions = last_positions
    query.middle_planes = middle_planes
    query.is_middle = is_middle
    query.samples = samples
    query.planes = planes
    return query


@wp.func
def any_moved(moved: wp.array3d[float], group: int, first_lane: int, lanes_at_once: int) -> int:
    """Return whether a strand of some lanes has moved."""
    for lane in range(first_lane, first_lane + lanes_at_once):
        if moved[group, 0, lane] != 0.0:
            return 1
    return 0


@wp.kernel
def find_planes(
    surface: Surface,
    asking: QueryOptions,
    positions: wp.array3d[float],
    last_positions: wp.array3d[float],
    middle_planes: wp.array3d[float],
    is_middle: int,
    moved: wp.array3d[float],
    samples_at_once: int,
    lanes_at_once: int,
    first: int,
    # outputs
    samples: Samples,
    out_planes: wp.array3d[float],
):
    thread = first + wp.tid()
    part_count = positions.shape[2] // lanes_at_once
    run_count = samples.rest.shape[1] // samples_at_once
    first_lane = (thread % part_count) * lanes_at_once
    first_sample = ((thread // part_count) % run_count) * samples_at_once
    group = thread // (part_count * run_count)
    if asking.is_again != 0:
        if any_moved(moved, group, first_lane, lanes_at_once) == 0:
            return
    query = query_of(surface, asking, positions, last_positions, middle_planes, is_middle, samples, out_planes)
    find_in(query, group, first_sample, samples_at_once, first_lane, lanes_at_once)


@wp.kernel
def measure(
    surface: Surface,
    positions: wp.array3d[float],
    is_middle: int,
    radius: float,
    samples_at_once: int,
    lanes_at_once: int,
    first: int,
    # outputs
    samples: Samples,
):
    thread = first + wp.tid()
    part_count = positions.shape[2] // lanes_at_once
    run_count = samples.rest.shape[1] // samples_at_once
    first_lane = (thread % part_count) * lanes_at_once
    first_sample = ((thread // part_count) % run_count) * samples_at_once
    group = thread // (part_count * run_count)
    for sample in range(first_sample, first_sample + samples_at_once):
        for lane in range(first_lane, first_lane + lanes_at_once):
            point = _sample(positions, group, sample, lane, is_middle)
            samples.rest[group, sample, lane] = NOWHERE
            samples.sides[group, sample, lane] = 0
            if wp.isfinite(wp.length(point)):
                hit = nearest(surface, point, point, radius, 0)
                if hit.collider >= 0:
                    samples.rest[group, sample, lane] = hit.distance
                    samples.sides[group, sample, lane] = hit.side
