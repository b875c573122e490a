# SPDX-License-Identifier: GPL-3.0-or-later
"""Cross sections of tubes and solid locks from root to tip."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..geometry import surface_distance
from ..geometry.curves import curve_frames
from ..geometry.mesh import TriMesh
from .mesh_pieces import Topology
from .ribbon_charts import divided

_SIDES = 24  # directions in which sections are measured
_LEVELS = 17  # sections of a lock without rings
_FLAT = 0.9999  # cosine between the normals of a flat cap's faces
_CAP_HEIGHT = 0.05  # height of a cap's middle above its ring, relative to its radius; lower caps are flat
_SLENDER = 1.5  # least length of hair relative to its diameter


@dataclass(frozen=True)
class Sections:
    """K sections: centers, normals and binormals (K, 3); radii (K, n) in n directions around; vertices (K, n) there.

    sizes: (K,) mean radii of the corners. For a tube that was made from a round strand, this is the strand's radius.
    """

    centers: np.ndarray
    normals: np.ndarray
    binormals: np.ndarray
    radii: np.ndarray
    vertices: np.ndarray
    sizes: np.ndarray

    def places(self, across: np.ndarray, inset: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return (positions (S, K, 3), vertices (S, K)) of lines along the sections.

        across: (S, 2) direction [rad] and fraction of the radius of each line; inset: (K,) by which radii are smaller.
        """
        at = (across[:, 0] / (2.0 * np.pi) % 1.0) * _SIDES
        low = at.astype(int) % _SIDES
        share = (at - np.floor(at))[:, None]
        radii = (1.0 - share) * self.radii[:, low].T + share * self.radii[:, (low + 1) % _SIDES].T
        radii = np.maximum(radii - inset, 0.0) * across[:, 1][:, None]
        cosines, sines = np.cos(across[:, 0])[:, None, None], np.sin(across[:, 0])[:, None, None]
        offsets = radii[..., None] * (cosines * self.normals + sines * self.binormals)
        return self.centers + offsets, self.vertices[:, np.round(at).astype(int) % _SIDES].T


def sections_of(
    topology: Topology,
    points: np.ndarray,
    root_first: Callable[[np.ndarray, np.ndarray, float], bool | None],
) -> Sections | None:
    """Return the `Sections` of a tube or a lock from root to tip; None if it is not slender.

    points: (v, 3) [m]; root_first: as in `ribbon_charts.Charts.chart`.
    """
    return _slender(_rings(topology, points), root_first) or _slender(_of_levels(topology, points), root_first)


def _slender(found, root_first):
    """Return the `Sections` of [(points, vertices)] of sections if they are longer than wide, else None."""
    if found is None:
        return None
    length = np.linalg.norm(np.diff([ring.mean(axis=0) for ring, _ in found], axis=0), axis=1).sum()
    is_first = root_first(found[0][1], found[-1][1], length)
    if is_first is None:  # the thicker end
        is_first = _size(found[0][0]) >= _size(found[-1][0])
    sections = _measured(found if is_first else found[::-1])
    return None if length < _SLENDER * 2.0 * sections.sizes.max() else sections


def _size(ring):
    return np.linalg.norm(ring - ring.mean(axis=0), axis=1).mean()


def _measured(found):
    """Return the `Sections` of [((m, 3) points of a section, (m,) vertices)]."""
    centers = np.stack([points.mean(axis=0) for points, _ in found])
    normals = curve_frames.steady_normals(centers[None])[0]
    binormals = np.cross(curve_frames.tangents(centers[None])[0], normals)
    radii, vertices = np.zeros((len(found), _SIDES)), np.zeros((len(found), _SIDES), int)
    sizes = np.zeros((len(found), 1))
    angles = np.arange(_SIDES) * (2.0 * np.pi / _SIDES)
    for row, (points, those) in enumerate(found):
        offsets = points - centers[row]
        x, y = offsets @ normals[row], offsets @ binormals[row]
        at = np.arctan2(y, x)
        sizes[row] = np.interp(angles, at, np.hypot(x, y), period=2.0 * np.pi).mean()
        radii[row] = _outline(angles, at % (2.0 * np.pi), np.hypot(x, y))
        apart = np.abs((at - angles[:, None] + np.pi) % (2.0 * np.pi) - np.pi)
        vertices[row] = those[apart.argmin(axis=1)]
    parts = divided(np.concatenate([centers, normals, binormals, sizes, radii], axis=1))
    nearest = np.round(np.linspace(0, len(found) - 1, len(parts))).astype(int)
    return Sections(parts[:, :3], parts[:, 3:6], parts[:, 6:9], parts[:, 10:], vertices[nearest], parts[:, 9])


def _outline(angles, at, radii):
    """Return the radii (n,) in directions [rad] of a polygon with corners at angles (m,) in [0, 2π) and radii (m,)."""
    order = np.argsort(at, kind="stable")
    at, radii = at[order], radii[order]
    after = np.searchsorted(at, angles) % len(at)
    before = after - 1
    gap, into = (at[after] - at[before]) % (2.0 * np.pi), (angles - at[before]) % (2.0 * np.pi)
    first, second = radii[before], radii[after]
    linear = first + (second - first) * into / np.where(gap > 0.0, gap, 1.0)
    across = first * np.sin(into) + second * np.sin(gap - into)
    is_side = (gap > 0.0) & (gap < np.pi) & (into <= gap) & (across > 0.0)
    return np.where(is_side, first * second * np.sin(gap) / np.where(is_side, across, 1.0), linear)


def _rings(topology, points):
    """Return [(points, vertices)] of the rings of a regular tube; None for other meshes.

    A ring holds the vertices that are equally many edges away from an end, which is a boundary, a flat cap or a vertex.
    """
    if topology.loops:
        starts = [min(topology.loops, key=len)]
    else:
        end = _far(points, _far(points, 0))
        starts = [_cap(topology, points, end), np.array([end])]
    for start in starts:
        layers = _layers(topology, start)
        if layers is not None:
            return [(points[layer], layer) for layer in _without_flat_ends(points, layers)]
    return None


def _without_flat_ends(points, layers):
    """Remove a single vertex at an end from layers of vertices, if it lies in the plane of its ring."""
    for end, beside, inner in ((0, 1, 2), (-1, -2, -3)):
        if len(layers[end]) == 1 and len(layers) > 3:
            ring = points[layers[beside]]
            axis = curve_frames.unit(ring.mean(axis=0) - points[layers[inner]].mean(axis=0))
            height = axis @ (points[layers[end][0]] - ring.mean(axis=0))
            if abs(height) < _CAP_HEIGHT * _size(ring):
                layers = layers[1:] if end == 0 else layers[:-1]
    return layers


def _far(points, vertex):
    return int(np.linalg.norm(points - points[vertex], axis=1).argmax())


def _cap(topology, points, end):
    """Return the vertices of the flat cap at an end."""
    corners = points[topology.triangles]
    normals = curve_frames.unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    outward = curve_frames.unit(points[end] - points.mean(axis=0))
    touching = np.flatnonzero((topology.triangles == end).any(axis=1))
    cap = normals[touching[(normals[touching] @ outward).argmax()]]
    is_flat = normals @ cap > _FLAT
    height = (corners.mean(axis=1) - points[end]) @ cap
    flat = is_flat & (np.abs(height) < 1e-4 * np.ptp(points, axis=0).max())
    return np.unique(topology.triangles[flat])


def _layers(topology, start):
    """Return the vertices that are 0, 1, 2 … edges away from a start, if they are rings of one size, else None.

    The first and the last layer may be a single vertex. Vertices inside a cap at the start belong to no ring.
    """
    ends = np.concatenate([topology.edges, topology.edges[:, ::-1]])
    is_left = np.ones(topology.vertex_count, bool)
    is_left[start] = False
    layers = [np.sort(start)]
    while is_left.any():
        is_here = np.zeros(topology.vertex_count, bool)
        is_here[layers[-1]] = True
        found = np.unique(ends[is_here[ends[:, 0]] & is_left[ends[:, 1]], 1])
        if not len(found):
            return None
        is_left[found] = False
        layers.append(found)
        if len(layers) == 2:
            is_rim = np.isin(layers[0], ends[np.isin(ends[:, 1], found), 0])
            layers[0] = layers[0][is_rim]
        if len(layers) > 3 and len(layers[-2]) != len(layers[-3]):
            return None
    sizes = [len(layer) for layer in layers]
    if sizes[0] > 1 and sizes[-1] not in (1, sizes[0]):
        return None
    inner = sizes[1 if sizes[0] == 1 else 0 : -1 if sizes[-1] == 1 else None]
    return layers if len(layers) > 1 and inner and min(inner) == max(inner) >= 3 else None


def _of_levels(topology, points):
    """Return [(points, vertices)] of contours of the distance from one end along the mesh, relative to both ends."""
    mesh = TriMesh(points.astype(np.float32), topology.triangles.astype(np.int32))
    first, second = _ends(mesh, points)
    if first == second:
        return None
    distances = _distances(mesh, first), _distances(mesh, second)
    share = distances[0] / np.maximum(distances[0] + distances[1], 1e-30)
    found = [(points[[first]], np.array([first]))]
    low, high = topology.edges.T
    # More sections at round ends.
    for level in 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, _LEVELS))[1:-1]:
        is_crossed = (share[low] < level) != (share[high] < level)
        if not is_crossed.any():
            return None
        a, b = low[is_crossed], high[is_crossed]
        at = (level - share[a]) / (share[b] - share[a])
        found.append((points[a] + at[:, None] * (points[b] - points[a]), np.where(at < 0.5, a, b)))
    return [*found, (points[[second]], np.array([second]))]


def _ends(mesh, points):
    """Return the vertices at both ends: far from each other along the mesh."""
    first = int(_distances(mesh, _far(points, 0)).argmax())
    return first, int(_distances(mesh, first).argmax())


def _distances(mesh, vertex):
    sources = np.full(len(mesh.vertices), np.inf)
    sources[vertex] = 0.0
    found = surface_distance.spread(mesh, sources)
    return np.where(np.isfinite(found), found, 0.0)
