# SPDX-License-Identifier: GPL-3.0-or-later
"""Gathering of guides at ties: along the surface to the nearest tie, through the tie in order, and along its line.

The way of a root over the surface descends the distance from the tie (geometry/surface_distance.py). Its height
grows toward the tie, because it lies on the hair of all roots that it passes: by the area of this hair divided by the
circumference. Each guide keeps its angle around the tie, and its distance determines its place in the disk of the tie,
by equal areas. Segments keep their lengths, except in buns, ropes, braids and cornrows; guides that are too short end
before the tie.
"""

from collections.abc import Sequence

import numpy as np
import warp as wp

from ...errors import HairError
from ...geometry import mesh as mesh_math
from ...geometry import surface_distance
from ...geometry.closest_point import SurfaceQuery
from ...geometry.mesh import TriMesh
from ...kernels import parallel
from ...kernels.parallel import Rows
from ..guide_shapes import joined, split, unit
from . import buns, cornrows, raised_segments, tie_tails
from .gather_settings import GatherSettings

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

_STEPS = 160  # of the longest way over the surface
_TAIL_POINTS = 300
_NEAR_ROOT = 1.5  # exponent of the spacing on the way to a braid: dense where hair rises, so that it stays outside
_DEEP = 0.25  # depth of a segment below the surface, relative to the tie's radius, above which it is raised
_BULGE = 0.25  # height of loose hair relative to its way


def gathered(
    mesh: TriMesh, points: np.ndarray, lines: Sequence[np.ndarray], settings: GatherSettings
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return (points (S, P, 3) float32 [m] of gathered guides, groups (S,) int32, held (S,), ties (S,) float32).

    Groups number the guides that go through one tie, or form one lock of a rope, braid or cornrow, from 1; guides that
    are not gathered have 0. held: the fraction of a guide's length up to its tie, or to the end of its row or bun.
    ties: the fraction of a guide's points up to the place where it joins its tail, braid, bun or row; 1 for guides that
    end before this place, 0 for guides that are not gathered.

    mesh: a checked `TriMesh`, the visible surface; points (S, P, 3) [m]; lines: (K, 3) [m] each, from the tie on.
    Guides on parts of the surface without a tie do not change. Raises `HairError` for lines without length.
    """
    lines = [_checked(line) for line in lines]
    if not lines:
        raise HairError("There is no curve to gather at: pick a curve that begins at the tie.")
    points = np.asarray(points, np.float32)
    after = points.copy()
    query = SurfaceQuery(mesh)
    roots = query.nearest(points[:, 0])
    fields = [_field(mesh, query, line, settings) for line in lines]
    distances = np.stack([surface_distance.at(field, mesh, roots) for field in fields])
    nearest = distances.argmin(axis=0)
    is_gathered = np.isfinite(distances.min(axis=0))
    groups = np.zeros(len(points), np.int32)
    held, ties = np.zeros(len(points), np.float32), np.zeros(len(points), np.float32)
    lock_count = tie_tails.LOCKS.get(settings.shape, 1)
    for place, (line, field) in enumerate(zip(lines, fields, strict=True)):
        rows = np.flatnonzero(is_gathered & (nearest == place))
        if len(rows) and points.shape[1] > 1:
            after[rows], locks, ends, ties[rows] = _at_line(mesh, query, points[rows], line, field, settings)
            groups[rows] = 1 + place * lock_count + locks
            held[rows] = np.clip(ends / np.maximum(_lengths(after[rows]), 1e-30), 0.0, 1.0)
    return after, groups, held, ties


def _checked(line):
    """Return a line without repeated points. Raises `HairError` if it has no length."""
    line = np.asarray(line, np.float64)
    if not np.isfinite(line).all():
        raise HairError("The curve to gather at has non-finite coordinates: repair it.")
    is_new = np.concatenate([[True], (np.diff(line, axis=0) != 0.0).any(axis=1)])
    if is_new.sum() < 2:
        raise HairError("A curve to gather at has no length: draw it from the tie on.")
    return line[is_new]


def _field(mesh, query, line, settings):
    """Return (V,) distances along the surface from the first point of a line, or from the whole line for cornrows."""
    if settings.shape == "CORNROWS":
        line = cornrows.on_surface(query, mesh, line)[0]
    else:
        line = line[:1]
    return surface_distance.spread(mesh, surface_distance.source_distances(mesh, query.nearest(line)))


def _at_line(mesh, query, points, line, field, settings):
    """Return the guides (S, P, 3) that one line gathers, their locks (S,), the lengths (S,) up to the tie [m], and
    ties (S,).
    """
    reach = float(split(points)[1].sum(axis=1).max())
    ways, apart, normals = _traced(mesh, query, points[:, 0], field, settings)
    order = np.argsort(np.argsort(apart[:, 0], kind="stable"))
    ranks = (order + 0.5) / len(order)
    ways += _heights(apart, settings)[..., None] * normals
    if settings.shape == "BUN":
        return _in_bun(mesh, query, points, (ways, ranks), line, settings)
    if settings.shape == "CORNROWS":
        return _in_row(mesh, query, points, (ways, ranks), cornrows.on_surface(query, mesh, line), settings)
    normal = mesh_math.normals(mesh, query.nearest(line[:1]))[0]
    if settings.shape in tie_tails.LOCKS:
        return _in_braid(points, (ways, ranks), line, normal, settings)
    behind = _in_tail(ways, ranks, tie_tails.tail_line(line, normal, reach, settings), normal, settings)
    after, ends = _along(points, np.concatenate([ways, behind], axis=1)), _lengths(ways)
    return after, np.zeros(len(ways), int), ends, _part_of_points(after, ends)


def _part_of_points(points, lengths):
    """Return (S,): the fraction of the segments of guides (S, P, 3) up to lengths (S,) [m], at most 1."""
    along = np.linalg.norm(np.diff(points.astype(np.float64), axis=1), axis=2).cumsum(axis=1)
    return np.minimum(1 + (along < lengths[:, None]).sum(axis=1), along.shape[1]) / along.shape[1]


def _along(points, ways):
    """Return guides (S, P, 3) along ways (S, K, 3), with the roots and the lengths of the segments of points."""
    ways[:, 0] = points[:, 0]
    lengths = split(points)[1]
    return joined(points, split(_walked(ways, lengths))[0], lengths)


def _in_bun(mesh, query, points, ways_and_ranks, line, settings):
    """Return the result of `_at_line` for a bun: guides that reach the tie become as long as the coil."""
    ways, ranks = ways_and_ranks
    on_way, coiled = tie_tails.segment_counts(points.shape[1] - 1)
    bun = buns.wound(mesh, query, line, buns.with_points_enough(settings, coiled))
    normal = mesh_math.normals(mesh, query.nearest(line[:1]))[0]
    wound = bun.points(_angles(ways, bun.line, normal), ranks, coiled + 1)
    ways = np.concatenate([ways, wound[:, :1]], axis=1)
    after = _along(points, ways)
    is_long = split(points)[1].sum(axis=1) > _lengths(ways)
    evenly = _evenly(ways[is_long], on_way + 1)
    after[is_long] = np.concatenate([evenly, wound[is_long, 1:]], axis=1)
    on_way = np.where(is_long, on_way / (points.shape[1] - 1), 1.0)
    return after, np.zeros(len(ways), int), np.full(len(ways), np.inf), on_way


def _in_braid(points, ways_and_ranks, line, normal, settings):
    """Return the result of `_at_line` for a rope or braid: guides that reach the tie end together."""
    ways, ranks = ways_and_ranks
    lengths, whole = _lengths(ways), split(points)[1].sum(axis=1)
    is_long = whole > lengths
    reach = max(float(np.median((whole - lengths)[is_long])) if is_long.any() else 0.0, 1e-6)
    tail = tie_tails.tail_line(line, normal, reach, settings)
    angles = tie_tails.evened(_angles(ways, tail, normal))
    locks = tie_tails.locks_at(angles, settings)
    on_way, behind = tie_tails.segment_counts(points.shape[1] - 1)
    along = np.linspace(0.0, reach, max(behind, 1) + 1)
    centers, sides, ups = tail.at(along)
    offsets = tie_tails.braided(tail, angles, ranks, along, locks, settings)
    braid = centers + offsets[..., :1] * sides + offsets[..., 1:] * ups
    ways = np.concatenate([ways, braid[:, :1]], axis=1)
    after = _along(points, ways)
    after[is_long] = np.concatenate(
        [_evenly(ways[is_long], on_way + 1, _NEAR_ROOT), braid[is_long, 1 : behind + 1]], axis=1
    )
    on_way = np.where(is_long, on_way / (points.shape[1] - 1), 1.0)
    return after, locks, np.where(is_long, lengths, np.inf), on_way


def _in_row(mesh, query, points, ways_and_ranks, surface_below, settings):
    """Return the result of `_at_line` for a cornrow: guides that reach the row end together."""
    (ways, ranks), (ground, normals) = ways_and_ranks, surface_below
    lengths, on_way, count = split(points)[1].sum(axis=1), _lengths(ways), points.shape[1] - 1
    whole = cornrows.row(ground, normals, 0.0, count, settings)
    places, _locks = cornrows.joined_at(whole, ways, settings)
    is_long = lengths > on_way
    beyond = (lengths - on_way - (whole.on_surface - places))[is_long]
    tail = max(0.0, float(np.median(beyond))) if len(beyond) else 0.0
    row = cornrows.row(ground, normals, tail, count, settings)
    places, locks = cornrows.joined_at(row, ways, settings)
    braided = cornrows.points_of(row, places, ranks, locks, settings)
    first = np.minimum(np.searchsorted(row.places, places), len(row.places) - 1)
    after, joins = _along(points, ways), np.ones(len(ways))
    for guide in np.flatnonzero(is_long):
        left = braided[guide, first[guide] :]
        before = points.shape[1] - len(left)
        joins[guide] = before / count
        way = np.concatenate([points[guide, :1], ways[guide, 1:], left[:1]])
        after[guide] = np.concatenate([_evenly(way[None], before + 1)[0], left[1:]])
    after[is_long] = raised_segments.raised(mesh, query, after[is_long], _DEEP * settings.tie_radius)
    row_end = np.count_nonzero(row.places <= row.on_surface) - len(row.places)  # from the end
    ends = np.where(is_long, _lengths(after[:, : after.shape[1] + row_end]), np.inf)
    return after, locks, ends, joins


def _evenly(ways, count, power=1.0):
    """Return (S, count, 3) points along ways (S, K, 3), from the first point to the last: at equal distances, or denser
    near the first point if power is above 1.
    """
    along = np.concatenate([np.zeros((len(ways), 1)), np.linalg.norm(np.diff(ways, axis=1), axis=2).cumsum(axis=1)], 1)
    found = np.empty((len(ways), count, 3))
    for row, (lengths, way) in enumerate(zip(along, ways, strict=True)):
        places = lengths[-1] * np.linspace(0.0, 1.0, count) ** power
        found[row] = np.stack([np.interp(places, lengths, axis) for axis in way.T], axis=1)
    return found


def _lengths(ways):
    """Return the lengths (S,) [m] of ways (S, K, 3)."""
    return np.linalg.norm(np.diff(ways, axis=1), axis=2).sum(axis=1)


def _in_tail(ways, ranks, tail, normal, settings):
    """Return the ways (S, M, 3) of guides in a tail behind the tie."""
    along = np.broadcast_to(np.linspace(0.0, tail.reach, _TAIL_POINTS), (len(ways), _TAIL_POINTS))
    centers, sides, ups = tail.at(along)
    offsets = tie_tails.offsets(tail, _angles(ways, tail, normal), ranks, along, settings)
    return centers + offsets[..., :1] * sides + offsets[..., 1:] * ups


def _traced(mesh, query, roots, field, settings):
    """Return ways (S, K, 3) from roots toward the tie, their distances (S, K) from it, and normals (S, K, 3).

    A way ends at the hair of the tie; its last point is repeated.
    """
    directions = surface_distance.directions(mesh, field).astype(np.float32)
    place = np.asarray(roots, np.float64)
    found = query.nearest(place)
    longest = float(surface_distance.at(field, mesh, found).max())
    near = (1.0 if settings.shape == "CORNROWS" else 1.5) * settings.tie_radius
    step = max(longest / _STEPS, 1e-12)
    ways, apart, normals = [], [], []
    for _step in range(int(1.3 * _STEPS)):
        here = mesh_math.positions(mesh, found).astype(np.float64)
        distance = surface_distance.at(field, mesh, found)
        normal = mesh_math.normals(mesh, found).astype(np.float64)
        if apart:  # ways end where the distance stops falling
            is_ended = ~(distance < apart[-1]) | (apart[-1] < near)
            here[is_ended], distance[is_ended], normal[is_ended] = (
                ways[-1][is_ended],
                apart[-1][is_ended],
                normals[-1][is_ended],
            )
            if is_ended.all():
                break
        ways.append(here)
        apart.append(distance)
        normals.append(normal)
        toward = -mesh_math.interpolate(directions, mesh, found).astype(np.float64)
        toward = unit(toward - normal * np.sum(toward * normal, axis=1, keepdims=True))
        found = query.nearest(here + step * toward)
    return np.stack(ways, axis=1), np.stack(apart, axis=1), np.stack(normals, axis=1)


def _heights(apart, settings):
    """Return heights (S, K) above the surface: the clearance, the hair below, and the bulge of loose hair."""
    whole = apart[:, :1]
    behind = np.sort(whole[:, 0])
    passed = (np.searchsorted(behind, whole) - np.searchsorted(behind, apart)) / len(behind)  # hair of nearer roots
    radius = settings.tie_radius
    pile = np.minimum(radius**2 / np.maximum(2.0 * apart, radius), radius)
    part = np.clip(1.0 - apart / np.maximum(whole, 1e-12), 0.0, 1.0)
    start = np.minimum(1.0, part * whole / max(4.0 * settings.clearance, 1e-12))  # hair rises from its root
    bulge = (1.0 - settings.tightness) * _BULGE * whole * np.sin(np.pi * part)
    return start * settings.clearance + np.maximum(passed, 0.0) * pile + bulge


def _angles(ways, tail, normal):
    """Return (S,) angles in the disk of the tie from which ways arrive.

    The plane of the surface is rotated onto the disk, so that hair from above a hanging tail lies outside.
    """
    arriving = ways[:, -1] - tail.centers[0]
    arriving -= np.sum(arriving * normal, axis=1, keepdims=True) * normal
    tangent = np.cross(tail.sides[0], tail.ups[0])
    tangent *= np.sign(tangent @ (tail.centers[1] - tail.centers[0])) or 1.0
    axis, cosine = np.cross(normal, tangent), float(normal @ tangent)
    turned = arriving + np.cross(axis, arriving) + np.cross(axis, np.cross(axis, arriving)) / max(1.0 + cosine, 1e-6)
    return np.arctan2(turned @ tail.ups[0], turned @ tail.sides[0])


def _walked(ways, lengths):
    """Return (S, P, 3) float32: points on ways (S, K, 3), as far apart as segments (S, P-1) are long.

    At the end of their ways, guides go straight on.
    """
    middle = ways.mean(axis=(0, 1))
    shared = [np.ascontiguousarray(ways - middle, np.float32), np.ascontiguousarray(lengths, np.float32)]
    out = parallel.empty_vectors((len(ways), lengths.shape[1] + 1), "cpu")
    inputs = [
        Rows(wp.array(shared[0], dtype=wp.vec3, device="cpu", copy=False)),
        Rows(wp.array(shared[1], dtype=float, device="cpu", copy=False)),
    ]
    parallel.launch(_walk, len(ways), inputs, [out], "cpu", least_rows=256)
    return (out.numpy() + middle).astype(np.float32)


@wp.kernel
def _walk(
    ways: wp.array2d[wp.vec3],
    lengths: wp.array2d[float],
    # outputs
    out_points: wp.array2d[wp.vec3],
):
    guide = wp.tid()
    last = ways.shape[1] - 1
    place = ways[guide, 0]
    out_points[guide, 0] = place
    segment = int(0)
    onward = wp.vec3(0.0, 0.0, 0.0)
    for i in range(lengths.shape[1]):
        length = lengths[guide, i]
        while segment < last and wp.length(ways[guide, segment + 1] - place) < length:
            segment += 1
        if segment < last:
            # The place between two points of the way that is one length away.
            behind = ways[guide, segment]
            start = behind - place
            step = ways[guide, segment + 1] - behind
            a = wp.dot(step, step)
            b = wp.dot(start, step)
            c = wp.dot(start, start) - length * length
            t = float(1.0)
            if a > 0.0:
                t = wp.clamp((wp.sqrt(wp.max(b * b - a * c, 0.0)) - b) / a, 0.0, 1.0)
            target = behind + t * step
        else:
            target = ways[guide, last]
            if wp.length(onward) > 0.0:
                target = place + length * onward
        if wp.length(target - place) > 0.0:
            onward = wp.normalize(target - place)
        place = place + length * onward
        out_points[guide, i + 1] = place
