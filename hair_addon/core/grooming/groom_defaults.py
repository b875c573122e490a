# SPDX-License-Identifier: GPL-3.0-or-later
"""Default lengths and gravity of new hair, computed from the surface.

All lengths are fractions of the square root of the area that hair grows on: a surface of twice the size gets hair of
twice the length and thickness, and looks the same. The fractions depend on the shape of the area. Closed surfaces (a
sphere, an animal) and flat ones (a plane) get fur: short, thick and stiff. A dome (a scalp) gets long, thin, hanging
hair, as on a human head. The numbers of guides and strands are constant: because all lengths scale with the surface,
the same number covers a surface of any size equally. Fewer strands are thicker, in proportion to the mean distance of
their roots, so that 600 strands of brows are visible. DECISIONS.md has the figures.
"""

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from .. import geometry
from ..errors import HairError
from ..geometry.faces.uv_maps import Texture
from ..geometry.mesh import SurfacePoints, TriMesh, check_mesh, interpolate
from ..params import Settings, from_surface

S = TypeVar("S", bound=Settings)

# Fractions of the square root of the area: on closed and flat surfaces, and on a dome. A human scalp has 0.055 m².
FUR_LENGTH, DOME_LENGTH = 0.06, 0.52
FUR_RADIUS, DOME_RADIUS = 6.0e-4, 1.65e-4
FUR_GRAVITY, DOME_GRAVITY = 0.3, 0.75

TYPICAL_GUIDE_COUNT = 400
TYPICAL_STRAND_COUNT = 60_000  # of the radii above
MOST_THICKENED = 10.0  # largest factor of thickness for few strands
STOUTEST = 1.0 / 50.0  # largest radius / length
INFLUENCE = 2.0  # in mean spacings of guides

_MASK_SAMPLES = 20_000  # samples of an image for the fraction of the surface that it covers
_SMALLEST, _LARGEST = 1e-7, 1e3  # [m]: range of Blender's properties of these settings


@dataclass(frozen=True)
class HairSize:
    """Defaults computed from a surface, with the names of settings: lengths [m], and gravity in [0, 1]."""

    length: float
    gravity: float
    radius: float
    influence_distance: float


def hair_size(
    mesh: TriMesh,
    density: np.ndarray | None = None,
    texture: Texture | None = None,
    guide_count: int = TYPICAL_GUIDE_COUNT,
    strand_count: int = TYPICAL_STRAND_COUNT,
) -> HairSize:
    """Return the `HairSize` for a surface.

    mesh: `TriMesh` [m] in world space; density: (V,) weights of vertices, or None; texture: `Texture` that is
    multiplied with them, or None; a mask weight of 0.5 counts half of the area; guide_count: for the influence
    distance; strand_count: for the radius. Raises `HairError` if the masked mesh has no area.
    """
    check_mesh(mesh)
    weights = _mean_weights(mesh, density, texture)
    area = float(weights @ mesh.areas)
    if not area > 0.0:
        raise HairError("The density is zero on every face: paint weight where hair should grow.")
    # 1 for a plane, 0.5 for a hemisphere, 0 for a closed surface.
    flatness = min(float(np.linalg.norm(weights @ mesh.scaled_normals)) / (2.0 * area), 1.0)
    dome = (4.0 * flatness * (1.0 - flatness)) ** 2
    size = np.sqrt(area)
    length = size * _between(FUR_LENGTH, DOME_LENGTH, dome)
    thickening = min(np.sqrt(TYPICAL_STRAND_COUNT / strand_count), MOST_THICKENED)
    radius = min(thickening * size * _between(FUR_RADIUS, DOME_RADIUS, dome), STOUTEST * length)
    return HairSize(
        length=_rounded(length),
        gravity=_rounded(_between(FUR_GRAVITY, DOME_GRAVITY, dome)),
        radius=_rounded(radius),
        influence_distance=_rounded(INFLUENCE * size / np.sqrt(guide_count)),
    )


def grown_area(mesh: TriMesh, density: np.ndarray | None = None, texture: Texture | None = None) -> float:
    """Return the area [m²] that hair grows on; arguments as in `hair_size`."""
    return float(_mean_weights(mesh, density, texture) @ mesh.areas)


def complete(
    settings: S,
    mesh: TriMesh,
    density: np.ndarray | None = None,
    texture: Texture | None = None,
    guide_count: int = TYPICAL_GUIDE_COUNT,
) -> S:
    """Return `GuideSettings` or `HairSettings` with values of None computed by `hair_size`; same arguments."""
    missing = [name for name in from_surface(type(settings)) if getattr(settings, name) is None]
    if not missing:
        return settings
    strand_count = getattr(settings, "strand_count", TYPICAL_STRAND_COUNT)
    size = hair_size(mesh, density, texture, guide_count, strand_count)
    return replace(settings, **{name: getattr(size, name) for name in missing})


def known(value: float | None) -> float:
    """Return a setting that `complete` has computed. Raises `HairError` for None."""
    if value is None:
        raise HairError("Length, gravity or radius is not set: call groom_defaults.complete first.")
    return value


def _mean_weights(mesh, density, texture):
    """Return the mean (F,) of the mask over each triangle, in [0, 1]."""

    density = np.minimum(geometry.sampling.check_density(mesh, density), 1.0)
    if texture is None:
        return density[mesh.triangles].mean(axis=1)
    face_count = len(mesh.triangles)
    centers = _centers_of_pieces(int(np.ceil(np.sqrt(_MASK_SAMPLES / face_count))))
    triangle = np.repeat(np.arange(face_count, dtype=np.int32), len(centers))
    points = SurfacePoints(triangle, np.tile(centers, (face_count, 1)))
    weights = interpolate(density, mesh, points) * np.clip(texture.at(points), 0.0, 1.0)
    return weights.reshape(face_count, -1).mean(axis=1)


def _centers_of_pieces(n):
    """Return barycentric coordinates (n², 3) float32 of the centers of n² equal parts of a triangle."""
    i, j = (grid.ravel() for grid in np.indices((n, n)))
    upright, inverted = i + j < n, i + j < n - 1
    first = np.concatenate([i[upright] + 1 / 3, i[inverted] + 2 / 3]) / n
    second = np.concatenate([j[upright] + 1 / 3, j[inverted] + 2 / 3]) / n
    return np.stack([first, second, 1.0 - first - second], axis=1).astype(np.float32)


def _between(low, high, part):
    return low + part * (high - low)


def _rounded(value):
    """Return a value rounded to three digits, which survive Blender's storage in single precision."""
    return float(f"{min(max(value, _SMALLEST), _LARGEST):.2e}")
