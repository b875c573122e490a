# SPDX-License-Identifier: GPL-3.0-or-later
"""Growth of guides from roots: control points of a smooth arc that bends with gravity.

The arc starts along the normal, along flow lines, or, for draped guides, downhill.
"""

import numpy as np
import warp as wp

from ..geometry.closest_point import SurfaceQuery, normal_and_offset
from ..geometry.curves.bspline import controls_through, greville_abscissae
from ..geometry.mesh import SurfacePoints, TriMesh, normals, positions
from ..geometry.mirror import Mirror
from ..kernels import kernel_cache
from . import flow_lines

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

STEP_COUNT = 48  # straight steps of a guide's arc
TURNING = 10.0  # effect of full gravity: tan(angle / 2), with the angle to straight down, shrinks by exp(-10)
CLEARANCE = 0.03  # height above the surface relative to a guide's length
RISE = 0.5  # largest rise per length at the root
LEAST_RISE = 0.05  # of guides that start flat on the surface
LEVEL = 0.01  # sine of the slope at which draped guides start half upright: level ground has no downhill direction
DOWN = wp.constant(wp.vec3(0.0, 0.0, -1.0))


def grow(
    mesh: TriMesh,
    roots: SurfacePoints,
    *,
    length: float | np.ndarray,
    length_variation: float,
    tilt: float | np.ndarray,
    gravity: float | np.ndarray,
    seed: int,
    control_point_count: int,
    random: np.ndarray | None = None,
    flow: flow_lines.FlowLines | None = None,
    is_draped: bool = False,
    lift: float | np.ndarray = 0.5 * np.pi,
    device: wp.DeviceLike = "cpu",
) -> np.ndarray:
    """Return control points (G, control_point_count, 3) float32 [m] of guides on a checked mesh.

    length [m]; length_variation: each guide's length is multiplied by a random number within 1 ± this; tilt [rad]:
    largest random angle to the initial direction, which is the smooth normal without flow and is_draped; gravity in
    [0, 1]: 0 for none, at 1 tips point nearly straight down (-Z); random: (G, 3) as `random_numbers`, None for those of
    the seed; flow: lines along which guides start, at the angle
    lift [rad] to the surface, or None; is_draped: whether guides fall after growth; without flow they start downhill at
    the same angle (`downhill`). Length, tilt, gravity and lift may be arrays (G,), a value for each guide. Guides bend
    with constant length, and slide over the surface instead of entering it.
    """
    if random is None:
        random = random_numbers(seed, len(roots))
    root_normals = normals(mesh, roots)
    lengths = length * (1.0 + length_variation * (2.0 * random[:, 0] - 1.0))
    axes, rises = root_normals, np.full(len(roots), RISE)
    if flow is not None:
        axes = flow_lines.axes(flow, positions(mesh, roots), root_normals, lift)
    elif is_draped:
        axes = downhill(root_normals, lift, gravity)
    if axes is not root_normals:
        rises = np.clip(np.einsum("gi,gi->g", axes, root_normals), LEAST_RISE, RISE)
    directions = _tilted(axes, tilt, random[:, 1], random[:, 2])
    surface = SurfaceQuery(mesh, device=device).mesh
    path = wp.empty((len(roots), STEP_COUNT + 1), dtype=wp.vec3, device=device)
    kernel_cache.launch(
        _march,
        dim=len(roots),
        inputs=[
            surface.id,
            wp.array(mesh.vertex_normals, dtype=wp.vec3, device=device),
            wp.array(positions(mesh, roots), dtype=wp.vec3, device=device),
            wp.array(directions, dtype=wp.vec3, device=device),
            wp.array(lengths, dtype=float, device=device),
            wp.array(rises, dtype=float, device=device),
            wp.array(np.broadcast_to(np.float32(gravity), len(roots)), dtype=float, device=device),
        ],
        outputs=[path],
        device=device,
    )
    # The curve interpolates the arc, so that it is neither shorter nor closer to the surface.
    abscissae = greville_abscissae(control_point_count)
    return controls_through(_along(path.numpy(), abscissae))


def random_numbers(seed: int, count: int) -> np.ndarray:
    """Return (G, 3) random numbers in [0, 1) of guides: of their lengths, and of angle and direction of their tilts."""
    return np.random.Generator(np.random.PCG64(seed)).random((count, 3))


def carried(numbers: np.ndarray, indices: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return random numbers (M, 3) of guides between others with numbers (G, 3), so that their hair stays as it is.

    indices (M, k): guides that these follow, -1 for none, with weights (M, k). Tilts are averaged as vectors.
    """
    shares = np.where(indices >= 0, weights, 0.0).astype(np.float64)
    shares[shares.sum(axis=1) <= 0.0, 0] = 1.0
    shares /= shares.sum(axis=1, keepdims=True)
    size, turn = np.sqrt(numbers[:, 1]), 2.0 * np.pi * numbers[:, 2]
    values = np.stack([numbers[:, 0], size * np.cos(turn), size * np.sin(turn)], axis=1)
    length, x, y = np.einsum("mk,mki->im", shares, values[np.maximum(indices, 0)])
    return np.stack([length, np.minimum(x**2 + y**2, 1.0), np.arctan2(y, x) / (2.0 * np.pi) % 1.0], axis=1)


def downhill(root_normals: np.ndarray, lift: float | np.ndarray, gravity: float | np.ndarray) -> np.ndarray:
    """Return the initial unit directions (G, 3) of draped guides.

    Neighbors agree, so hair parts only at a summit, like the whorl of a scalp. root_normals: unit (G, 3); lift: angle
    [rad] to the surface, gravity: as in `grow`. Guides are upright without gravity and on level ground, and at most
    point straight down below an overhang.
    """
    steepest = np.array([0.0, 0.0, -1.0]) + root_normals[:, 2:] * root_normals
    slope = np.linalg.norm(steepest, axis=1)
    # The same law as in `_march`.
    share = slope**2 / (slope**2 + LEVEL**2) * (1.0 - np.exp(-TURNING * gravity))
    turned = np.minimum(share * (0.5 * np.pi - lift), np.arccos(np.clip(-root_normals[:, 2], -1.0, 1.0)))
    along = steepest / np.maximum(slope, 1e-12)[:, None]
    return np.cos(turned)[:, None] * root_normals + np.sin(turned)[:, None] * along


def mirrored(controls: np.ndarray, places: np.ndarray, mirror: Mirror) -> np.ndarray:
    """Return controls (G, n, 3) whose second half mirrors the first half, where roots at places (G, 3) are mirrored."""
    count = len(places) // 2
    images = mirror.image(places[:count])
    reach = 5e-3 * np.ptp(places, axis=0).max()
    is_image = np.linalg.norm(images - places[len(places) - count :], axis=1) <= reach
    arms = controls[:count] - controls[:count, :1]
    images = mirror.image(arms.reshape(-1, 3)).reshape(arms.shape) + places[len(places) - count :, None]
    controls[len(places) - count :][is_image] = images[is_image]
    return controls


def _tilted(directions, largest, random_angle, random_turn):
    """Return unit vectors (G, 3) tilted by up to an angle [rad], uniformly over the spherical cap."""
    cosine = 1.0 - random_angle * (1.0 - np.cos(largest))
    sine, turn = np.sqrt(1.0 - cosine**2), 2.0 * np.pi * random_turn
    # Any two perpendicular directions suffice: start with the axis farthest from each direction.
    across = np.cross(directions, np.eye(3)[np.abs(directions).argmin(axis=1)])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    along = np.cross(directions, across)
    sideways = np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * along
    return cosine[:, None] * directions + sine[:, None] * sideways


def _along(path, fractions):
    """Return points (G, n, 3) on paths (G, steps + 1, 3) of equal steps, at fractions (n,) of their lengths."""
    places = fractions * (path.shape[1] - 1)
    before = np.minimum(places.astype(int), path.shape[1] - 2)
    share = (places - before)[:, None].astype(np.float32)
    return (1.0 - share) * path[:, before] + share * path[:, before + 1]


@wp.kernel
def _march(
    surface: wp.uint64,
    vertex_normals: wp.array[wp.vec3],
    roots: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    lengths: wp.array[float],
    rises: wp.array[float],
    gravities: wp.array[float],
    # outputs
    out_path: wp.array2d[wp.vec3],
):
    guide = wp.tid()
    steps = out_path.shape[1] - 1
    step = lengths[guide] / float(steps)
    clearance = CLEARANCE * lengths[guide]
    position = roots[guide]
    direction = directions[guide]
    out_path[guide, 0] = position
    for i in range(steps):
        # Turn toward straight down: d(angle)/ds = -k sin(angle), like the moment of gravity.
        bend = TURNING * gravities[guide] / float(steps)
        direction = wp.normalize(direction + bend * (DOWN - wp.dot(direction, DOWN) * direction))
        ahead = position + step * direction
        # The wanted height rises from the root up to the clearance.
        wanted = wp.min(clearance, float(i + 1) * step * rises[guide])
        query = wp.mesh_query_point_no_sign(surface, ahead, 4.0 * clearance + step)
        if query.result:
            normal, away = normal_and_offset(surface, vertex_normals, query.face, query.u, query.v, ahead)
            height = wp.dot(away, normal)
            # Beyond the border of an open surface the nearest point lies sideways: the guide hangs freely.
            if height < wanted and wp.length(away - height * normal) < 0.5 * wanted:
                direction = wp.normalize(ahead + (wanted - height) * normal - position)
        position += step * direction
        out_path[guide, i + 1] = position
