# SPDX-License-Identifier: GPL-3.0-or-later
"""A path's way through the grid to the next strand or surface, cell by cell [Amanatides87].

In a cell strands stand anywhere, with equal chance. A path meets their pieces as if all lay across it, and each of them
with a chance of the sine between its tangent and the path [Woodcock65].
"""

import warp as wp

from .fibre_walk import Fibre

wp.set_module_options({"enable_backward": False, "fast_math": True})

FAR = wp.constant(1e9)
_LEAST = wp.constant(1e-9)  # component of a direction
PASSED, STRAND, SURFACE = (wp.constant(kind) for kind in range(3))  # what ends a path's way


@wp.struct
class Medium:
    """A `StrandGrid` and triangles on a device."""

    corner: wp.vec3
    cell: wp.vec3
    least_cell: float
    shape: wp.vec3i
    density: float  # [1/m] of one piece in a cell
    starts: wp.array[int]
    tangents: wp.array[wp.vec3]
    sigma_a: wp.array[wp.vec3]
    roughness: wp.array[float]
    fibres: wp.array[int]
    systems: wp.array[int]
    strands: wp.array[int]
    fibre_rows: wp.array2d[float]
    mesh: wp.uint64
    has_mesh: int
    albedo: wp.array[wp.vec3]  # of each triangle


@wp.struct
class Met:
    """What a path meets: a piece of a strand or a triangle, where, and the triangle's normal against the path."""

    kind: int
    index: int
    position: wp.vec3
    normal: wp.vec3


@wp.func
def fibre_of(medium: Medium, piece: int):
    """The `Fibre` of a piece."""
    fibre = Fibre()
    row = medium.fibres[piece]
    fibre.tangent = medium.tangents[piece]
    fibre.sigma_a = medium.sigma_a[piece]
    fibre.roughness = medium.roughness[piece]
    fibre.eta = medium.fibre_rows[row, 0]
    fibre.scale = medium.fibre_rows[row, 1]
    fibre.tilt = medium.fibre_rows[row, 2]
    fibre.tilt_trt = medium.fibre_rows[row, 3]
    fibre.coat = medium.fibre_rows[row, 4]
    return fibre


@wp.func
def random_way(random: float):
    """Optical depth to the next event."""
    return -wp.log(1.0 - wp.min(random, 0.9999999))


@wp.func
def walk(medium: Medium, position: wp.vec3, direction: wp.vec3, most: float, own: int, random: wp.uint32):
    """(`Met` within a distance [m], random state) of a ray; own: the strand that it leaves, which it does not meet."""
    state = random
    met = Met()
    met.kind = PASSED
    end = most
    if medium.has_mesh > 0:
        found = wp.mesh_query_ray(medium.mesh, position, direction, most)
        if found.result:
            end = found.t
            met.kind = SURFACE
            met.index = found.face
            met.normal = found.normal
            if wp.dot(found.normal, direction) > 0.0:
                met.normal = -found.normal

    # The part of the ray in the grid, and its first cell.
    here = float(0.0)
    last = end
    for axis in range(3):
        size = float(medium.shape[axis]) * medium.cell[axis]
        if wp.abs(direction[axis]) < _LEAST:
            if position[axis] < medium.corner[axis] or position[axis] > medium.corner[axis] + size:
                last = -1.0
        else:
            one = (medium.corner[axis] - position[axis]) / direction[axis]
            other = (medium.corner[axis] + size - position[axis]) / direction[axis]
            here = wp.max(here, wp.min(one, other))
            last = wp.min(last, wp.max(one, other))
    cell = wp.vec3i(0, 0, 0)
    step = wp.vec3i(1, 1, 1)
    across = wp.vec3(FAR, FAR, FAR)  # length of a cell along the ray
    leave = wp.vec3(FAR, FAR, FAR)  # where the ray leaves the cell
    for axis in range(3):
        inside = (position[axis] + direction[axis] * here - medium.corner[axis]) / medium.cell[axis]
        cell[axis] = wp.clamp(int(wp.floor(inside)), 0, medium.shape[axis] - 1)
        if wp.abs(direction[axis]) >= _LEAST:
            across[axis] = medium.cell[axis] / wp.abs(direction[axis])
            far_side = float(cell[axis] + 1)
            if direction[axis] < 0.0:
                step[axis] = -1
                far_side = float(cell[axis])
            leave[axis] = (medium.corner[axis] + far_side * medium.cell[axis] - position[axis]) / direction[axis]

    left = random_way(wp.randf(state))
    going = medium.shape[0] + medium.shape[1] + medium.shape[2]  # more cells are on no ray, whatever its numbers are
    if here >= last:
        going = 0
    while going > 0:
        going -= 1
        to = wp.min(wp.min(leave[0], leave[1]), wp.min(leave[2], last))
        index = (cell[2] * medium.shape[1] + cell[1]) * medium.shape[0] + cell[0]
        first = medium.starts[index]
        count = medium.starts[index + 1] - first
        if count > 0:
            density = float(count) * medium.density
            depth = density * wp.max(to - here, 0.0)
            while left < depth and going > 0:
                here += left / density
                piece = first + wp.min(int(wp.randf(state) * float(count)), count - 1)
                along = wp.dot(medium.tangents[piece], direction)
                is_met = wp.randf(state) < wp.sqrt(wp.max(0.0, 1.0 - along * along))
                if is_met and medium.strands[piece] != own:
                    met.kind = STRAND
                    met.index = piece
                    end = here
                    going = 0
                left = random_way(wp.randf(state))
                depth = density * (to - here)
            left -= depth
        here = to
        if to >= last:
            going = 0
        for axis in range(3):
            if going > 0 and to == leave[axis]:
                cell[axis] = cell[axis] + step[axis]
                leave[axis] = leave[axis] + across[axis]
                if cell[axis] < 0 or cell[axis] >= medium.shape[axis]:
                    going = 0
    met.position = position + direction * end
    return met, state
