# SPDX-License-Identifier: GPL-3.0-or-later
"""Tracing of a ray to the next strand or surface: through voxels, and through the cells of voxels that contain hair
[Amanatides87].

Strands are round, like linear hair in Cycles: a segment is a cylinder around its axis, and a sphere around the point
between two segments fills the gap on the outside of a bend. A ray hits only the side of a strand that faces it, and
thus no strand that contains its origin, where strands overlap [Embree26]; the path continues from the hit, on that
side. A ray does not hit the strand that it leaves, even in bends.
"""

import warp as wp

from .fibre_walk import Fibre
from .strand_cells import LINE_CENTRE, LINE_ERROR, line_from, line_step

wp.set_module_options({"enable_backward": False, "fast_math": True})

FAR = wp.constant(1e9)
_LEAST = wp.constant(1e-9)  # least component of a direction
PASSED, STRAND, SURFACE = (wp.constant(kind) for kind in range(3))  # kinds of hits


@wp.struct
class Medium:
    """A `StrandGrid` and triangles on a device; lines: two words for each of `segments`."""

    corner: wp.vec3
    voxel: float
    shape: wp.vec3i
    along_voxel: int
    at_once: int  # number of lines compared with a ray at once
    widths: wp.vec4  # of segments: the largest radius and its halves [m]
    bricks: wp.array[int]
    starts: wp.array[int]
    segments: wp.array[int]
    lines: wp.array[wp.uint32]
    points: wp.array[wp.vec3]
    radii: wp.array[float]
    sigma_a: wp.array[wp.vec3]
    strands: wp.array[int]
    roughness: wp.array[float]
    scales: wp.array[float]  # of the azimuthal logistic of each strand [rad]
    fibres: wp.array[int]
    fibre_rows: wp.array2d[float]
    mesh: wp.uint64
    has_mesh: int
    normals: wp.array[wp.vec3]  # of each triangle's corners
    albedo: wp.array[wp.vec3]  # base color of each triangle
    gloss: wp.array[wp.vec3]  # of each triangle: roughness, metallic, reflectance at normal incidence
    reflected: wp.array2d[wp.vec4]  # `surface_albedo.table`


@wp.struct
class Hit:
    """The hit of a ray: a segment, identified by its first point, or a triangle, and the position.

    normal: of the triangle, on the side of the ray; offset: from the segment's axis, as a fraction of the radius,
    positive along cross(ray, tangent).
    """

    kind: int
    index: int
    position: wp.vec3
    normal: wp.vec3
    offset: float


@wp.func
def fibre_of(medium: Medium, segment: int):
    """The `Fibre` of a segment."""
    fibre = Fibre()
    strand = medium.strands[segment]
    row = medium.fibres[strand]
    fibre.tangent = wp.normalize(medium.points[segment + 1] - medium.points[segment])
    fibre.sigma_a = 0.5 * (medium.sigma_a[segment] + medium.sigma_a[segment + 1])
    fibre.roughness = medium.roughness[strand]
    fibre.eta = medium.fibre_rows[row, 0]
    fibre.scale = medium.scales[strand]
    fibre.tilt = medium.fibre_rows[row, 1]
    fibre.tilt_trt = medium.fibre_rows[row, 2]
    fibre.coat = medium.fibre_rows[row, 3]
    return fibre


@wp.func
def is_in_bend(medium: Medium, segment: int, place: wp.vec3):
    """Whether a place, relative to the segment's end, is beyond that end and before the strand's next segment."""
    if segment + 2 >= medium.points.shape[0]:
        return False
    if medium.strands[segment + 2] != medium.strands[segment]:
        return False
    end = medium.points[segment + 1]
    if wp.dot(place, end - medium.points[segment]) < 0.0:
        return False
    return wp.dot(place, medium.points[segment + 2] - end) < 0.0


@wp.func
def crossing(medium: Medium, segment: int, position: wp.vec3, direction: wp.vec3):
    """Return (distance along a ray of unit direction, offset from the axis) where the ray enters a segment.

    `FAR` without a hit.
    """
    start = medium.points[segment] - position
    along = medium.points[segment + 1] - medium.points[segment]
    normal = wp.cross(direction, along)
    squared = wp.dot(normal, normal)
    length = wp.dot(along, along)
    distance = float(FAR)
    offset = float(0.0)
    if squared > 1e-12 * length:
        # The closest points of two lines, and from there back to the side of the cylinder.
        part = wp.dot(wp.cross(start, direction), normal) / squared
        beside = -wp.dot(start, normal) / wp.sqrt(squared)
        first = medium.radii[segment]
        last = medium.radii[segment + 1]
        radius = first + wp.clamp(part, 0.0, 1.0) * (last - first)
        if wp.abs(beside) < radius:
            back = wp.sqrt((radius * radius - beside * beside) * length / squared)
            part -= back * wp.dot(direction, along) / length
            if part >= 0.0 and part < 1.0:
                way = wp.dot(wp.cross(start, along), normal) / squared - back
                if way > 0.0:
                    distance = way
                    offset = beside / radius
            elif part >= 1.0:
                end = start + along
                nearest = wp.dot(end, direction)
                aside = end - nearest * direction
                inside = last * last - wp.dot(aside, aside)
                if inside > 0.0:
                    way = nearest - wp.sqrt(inside)
                    if way > 0.0 and is_in_bend(medium, segment, way * direction - end):
                        distance = way
                        offset = -wp.dot(aside, normal) / (wp.sqrt(squared) * last)
    return distance, offset


@wp.func
def _shading_normal(medium: Medium, face: int, u: float, v: float, flat: wp.vec3):
    """Return the interpolated normal of a triangle's corners, on the side of its face normal.

    The face normal if corners have none.
    """
    between = u * medium.normals[3 * face] + v * medium.normals[3 * face + 1]
    between += (1.0 - u - v) * medium.normals[3 * face + 2]
    normal = flat
    if wp.dot(between, between) > 0.0:
        normal = wp.normalize(between)
        if wp.dot(normal, flat) < 0.0:
            normal = -normal
    return normal


@wp.func
def _inverse_of(direction: wp.vec3):
    """Component-wise reciprocal of a direction; `FAR` below the limit."""
    inverse = wp.vec3(FAR, FAR, FAR)
    for axis in range(3):
        if wp.abs(direction[axis]) >= _LEAST:
            inverse[axis] = 1.0 / direction[axis]
    return inverse


@wp.func
def _first_cell(inside: wp.vec3, shape: wp.vec3i):
    """Return the cell of a grid that contains a place; inside: in cells from the grid's corner."""
    cell = wp.vec3i(0, 0, 0)
    for axis in range(3):
        cell[axis] = wp.clamp(int(wp.floor(inside[axis])), 0, shape[axis] - 1)
    return cell


@wp.func
def _leaves(corner: wp.vec3, cell: wp.vec3i, side: float, position: wp.vec3, direction: wp.vec3, inverse: wp.vec3):
    """Return the distances at which a ray leaves a cell along each axis [m]."""
    leave = wp.vec3(FAR, FAR, FAR)
    for axis in range(3):
        if wp.abs(direction[axis]) >= _LEAST:
            far_side = float(cell[axis])
            if direction[axis] > 0.0:
                far_side += 1.0
            leave[axis] = (corner[axis] + far_side * side - position[axis]) * inverse[axis]
    return leave


@wp.func
def _near(medium: Medium, first: int, end: int, from_centre: wp.vec3, side: float, direction: wp.vec3):
    """Return a bit for each of the next `at_once` entries of a cell: whether a ray may hit its segment within the cell.

    It may if the distance to the segment's stored line is at most the radius plus the line's rounding error.
    first, end: entries; from_centre: the ray's origin relative to the cell's center [m]. Compilers use SIMD
    instructions for a `while` loop without branches.
    """
    near = wp.uint32(0)
    step = line_step(side)
    origin = from_centre / step + wp.vec3(LINE_CENTRE, LINE_CENTRE, LINE_CENTRE)
    least = medium.widths[3] / step
    error = LINE_ERROR * side / step
    number = int(0)
    while number < medium.at_once:
        entry = wp.min(first + number, end - 1)  # the last entry again has no effect
        point, along, wider = line_from(medium.lines[2 * entry], medium.lines[2 * entry + 1])
        normal = wp.cross(direction, along)
        beside = wp.dot(point - origin, normal)
        radius = least * wider + error
        is_near = beside * beside < radius * radius * wp.dot(normal, normal)
        near = near | wp.where(is_near, wp.uint32(1) << wp.uint32(number), wp.uint32(0))
        number += 1
    return near


@wp.func
def _part_in_grid(medium: Medium, position: wp.vec3, direction: wp.vec3, inverse: wp.vec3, most: float):
    """Return the distances [m] at which a ray enters and leaves the grid, up to `most`.

    The second is smaller if the ray misses the grid.
    """
    here = float(0.0)
    last = float(most)
    for axis in range(3):
        size = float(medium.shape[axis]) * medium.voxel
        if wp.abs(direction[axis]) < _LEAST:
            if position[axis] < medium.corner[axis] or position[axis] > medium.corner[axis] + size:
                last = -1.0
        else:
            one = (medium.corner[axis] - position[axis]) * inverse[axis]
            other = (medium.corner[axis] + size - position[axis]) * inverse[axis]
            here = wp.max(here, wp.min(one, other))
            last = wp.min(last, wp.max(one, other))
    return here, last


@wp.func
def _trace_cell(
    medium: Medium,
    index: int,
    centre: wp.vec3,
    side: float,
    position: wp.vec3,
    direction: wp.vec3,
    own: int,
    is_any: int,
    end: float,
    hit: Hit,
):
    """Return (distance, `Hit`) of the nearest segment of a cell before `end`; the arguments if there is none.

    is_any: one to stop at any hit, whose distance is returned as zero.
    """
    first = medium.starts[index]
    last = medium.starts[index + 1]
    while first < last:
        near = _near(medium, first, last, position - centre, side, direction)
        entry = int(first)
        first += medium.at_once
        while near > wp.uint32(0):
            if (near & wp.uint32(1)) > wp.uint32(0) and entry < last:
                segment = medium.segments[entry]
                if medium.strands[segment] != own:
                    distance, offset = crossing(medium, segment, position, direction)
                    if distance < end:
                        end = distance
                        hit.kind = STRAND
                        hit.index = segment
                        hit.offset = offset
                        if is_any > 0:
                            end = 0.0
                            first = last
                            near = wp.uint32(0)
            near = near >> wp.uint32(1)
            entry += 1
    return end, hit


@wp.func
def _trace_brick(
    medium: Medium,
    brick: int,
    corner: wp.vec3,
    here: float,
    to: float,
    position: wp.vec3,
    direction: wp.vec3,
    inverse: wp.vec3,
    own: int,
    is_any: int,
    end: float,
    hit: Hit,
):
    """Return `_trace_cell` of all cells of a voxel that a ray enters at `here` and leaves at `to` [m].

    corner: of the voxel.
    """
    along = medium.along_voxel
    side = medium.voxel / float(along)
    cell = _first_cell((position + direction * here - corner) / side, wp.vec3i(along, along, along))
    leave = _leaves(corner, cell, side, position, direction, inverse)
    staying = 3 * along
    while staying > 0:
        staying -= 1
        to_cell = wp.min(leave[0], wp.min(leave[1], leave[2]))
        centre = corner + side * wp.vec3(float(cell[0]) + 0.5, float(cell[1]) + 0.5, float(cell[2]) + 0.5)
        index = ((brick * along + cell[2]) * along + cell[1]) * along + cell[0]
        end, hit = _trace_cell(medium, index, centre, side, position, direction, own, is_any, end, hit)
        if to_cell >= wp.min(end, to):
            staying = 0
        for axis in range(3):
            if staying > 0 and to_cell == leave[axis]:
                cell[axis] = cell[axis] + wp.where(direction[axis] < 0.0, -1, 1)
                leave[axis] = leave[axis] + wp.abs(inverse[axis]) * medium.voxel / float(along)
                if cell[axis] < 0 or cell[axis] >= along:
                    staying = 0
    return end, hit


@wp.func
def _trace_strands(medium: Medium, position: wp.vec3, direction: wp.vec3, own: int, most: float, is_any: int, hit: Hit):
    """Return `_trace_cell` of all cells of the grid."""
    end = float(most)
    inverse = _inverse_of(direction)
    here, last = _part_in_grid(medium, position, direction, inverse, most)
    voxel = _first_cell((position + direction * here - medium.corner) / medium.voxel, medium.shape)
    leave = _leaves(medium.corner, voxel, medium.voxel, position, direction, inverse)
    going = medium.shape[0] + medium.shape[1] + medium.shape[2]  # no ray crosses more voxels, even with invalid numbers
    if here >= last:
        going = 0
    while going > 0:
        going -= 1
        to = wp.min(leave[0], wp.min(leave[1], leave[2]))
        brick = medium.bricks[(voxel[2] * medium.shape[1] + voxel[1]) * medium.shape[0] + voxel[0]]
        if brick >= 0:
            corner = medium.corner + medium.voxel * wp.vec3(float(voxel[0]), float(voxel[1]), float(voxel[2]))
            until = wp.min(to, last)
            end, hit = _trace_brick(
                medium, brick, corner, here, until, position, direction, inverse, own, is_any, end, hit
            )
        if to >= wp.min(end, last):
            going = 0
        here = to
        for axis in range(3):
            if going > 0 and to == leave[axis]:
                voxel[axis] = voxel[axis] + wp.where(direction[axis] < 0.0, -1, 1)
                leave[axis] = leave[axis] + wp.abs(inverse[axis]) * medium.voxel
                if voxel[axis] < 0 or voxel[axis] >= medium.shape[axis]:
                    going = 0
    return end, hit


@wp.func
def walk(medium: Medium, position: wp.vec3, direction: wp.vec3, most: float, own: int):
    """Return the `Hit` of a ray within a distance [m]; own: the strand that the ray leaves, -1: none."""
    hit = Hit()
    hit.kind = PASSED
    end, hit = _trace_strands(medium, position, direction, own, most, 0, hit)
    # Surfaces behind the strand do not matter.
    if medium.has_mesh > 0:
        found = wp.mesh_query_ray(medium.mesh, position, direction, end)
        if found.result:
            end = found.t
            hit.kind = SURFACE
            hit.index = found.face
            hit.normal = _shading_normal(medium, found.face, found.u, found.v, found.normal)
            if wp.dot(found.normal, direction) > 0.0:
                hit.normal = -hit.normal
    hit.position = position + direction * end
    return hit


@wp.func
def is_blocked(medium: Medium, position: wp.vec3, direction: wp.vec3, most: float, own: int):
    """Whether `walk` would hit anything."""
    hit = Hit()
    hit.kind = PASSED
    _end, hit = _trace_strands(medium, position, direction, own, most, 1, hit)
    if hit.kind != PASSED:
        return True
    if medium.has_mesh > 0:
        return wp.mesh_query_ray_anyhit(medium.mesh, position, direction, most)
    return False


@wp.func
def place_on(medium: Medium, segment: int, part: float, offset: float, direction: wp.vec3):
    """Return the `Hit` of a ray with a segment, at a fraction of its length and an offset from its axis, on the side
    that faces the ray, as `walk` returns it.
    """
    start = medium.points[segment]
    along = medium.points[segment + 1] - start
    sideways = wp.normalize(wp.cross(direction, along))
    inwards = wp.normalize(wp.cross(along, sideways))
    radius = medium.radii[segment] + part * (medium.radii[segment + 1] - medium.radii[segment])
    rise = wp.sqrt(wp.max(0.0, 1.0 - offset * offset))
    hit = Hit()
    hit.kind = STRAND
    hit.index = segment
    hit.offset = offset
    hit.position = start + part * along + radius * (offset * sideways - rise * inwards)
    return hit


@wp.func
def on_axis(medium: Medium, segment: int, place: wp.vec3):
    """Return the point of a segment's axis that is nearest to a place."""
    start = medium.points[segment]
    along = medium.points[segment + 1] - start
    part = wp.dot(place - start, along) / wp.max(wp.dot(along, along), 1e-30)
    return start + wp.clamp(part, 0.0, 1.0) * along
