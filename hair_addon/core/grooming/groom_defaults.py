# SPDX-License-Identifier: GPL-3.0-or-later
"""The size of new hair where its settings do not give it: lengths, and gravity, that follow from the surface.

All lengths are fractions of the square root of the area that hair grows on, so a surface of twice the size gets hair
of twice the length and thickness, and looks the same. The shape of that area sets the fractions. Closed surfaces
(a sphere, an animal) and flat ones (a plane) get fur: short, thick and stiff. A dome (a scalp) gets long and thin hair,
which hangs, as on a human head. Numbers of guides and strands follow from nothing: as all lengths are fractions of one
size, the same number covers a surface of any size equally. Strands are thicker where there are fewer, so that 600 in
brows are seen: as thick as in proportion to the mean distance of their roots. DECISIONS.md has the figures.
"""

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from .. import geometry
from ..errors import HairError
from ..geometry.mesh import SurfacePoints, TriMesh, check_mesh, interpolate
from ..geometry.texture import Texture
from ..params import Settings, from_surface

S = TypeVar("S", bound=Settings)

# Fractions of the square root of the area: on closed and flat surfaces, and on a dome. A human scalp has 0.055 m².
FUR_LENGTH, DOME_LENGTH = 0.06, 0.52
FUR_RADIUS, DOME_RADIUS = 6.0e-4, 1.65e-4
FUR_GRAVITY, DOME_GRAVITY = 0.3, 0.75

TYPICAL_GUIDE_COUNT = 400
TYPICAL_STRAND_COUNT = 60_000  # that the radii above are for
MOST_THICKENED = 10.0  # how many times thicker few strands are
STOUTEST = 1.0 / 50.0  # radius by length: even few strands stay slender
INFLUENCE = 2.0  # by the mean spacing of guides

_MASK_SAMPLES = 20_000  # points at which an image is read to find how much of a surface it leaves
_SMALLEST, _LARGEST = 1e-7, 1e3  # [m]: what Blender's properties of these settings can hold


@dataclass(frozen=True)
class HairSize:
    """What follows from a surface, by the names of the settings: lengths [m], and gravity from 0 to 1."""

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
    """The `HairSize` for a surface.

    mesh: `TriMesh` [m], as it stands in the world; density: (V,) weights per vertex, or None; texture: `Texture` that
    multiplies them, or None. Together they are the mask: a weight of one half counts for half of the area.
    guide_count: the number of guides, for the influence distance; strand_count: of strands, for the radius. Raises
    `HairError` where the mesh or what is left of it has no area.
    """
    check_mesh(mesh)
    weights = _mean_weights(mesh, density, texture)
    area = float(weights @ mesh.areas)
    if not area > 0.0:
        raise HairError("The density is zero on every face: paint weight where hair should grow.")
    # One for a plane, one half for a hemisphere, zero for a closed surface.
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
    """The area [m²] that hair grows on; arguments as in `hair_size`."""
    return float(_mean_weights(mesh, density, texture) @ mesh.areas)


def complete(
    settings: S,
    mesh: TriMesh,
    density: np.ndarray | None = None,
    texture: Texture | None = None,
    guide_count: int = TYPICAL_GUIDE_COUNT,
) -> S:
    """`GuideSettings` or `HairSettings` with open settings computed by `hair_size`; same arguments."""
    missing = [name for name in from_surface(type(settings)) if getattr(settings, name) is None]
    if not missing:
        return settings
    strand_count = getattr(settings, "strand_count", TYPICAL_STRAND_COUNT)
    size = hair_size(mesh, density, texture, guide_count, strand_count)
    return replace(settings, **{name: getattr(size, name) for name in missing})


def known(value: float | None) -> float:
    """A setting that `complete` has found by the surface. Raises `HairError` where it has yet to."""
    if value is None:
        raise HairError("Length, gravity or radius is not set: call groom_defaults.complete first.")
    return value


def _mean_weights(mesh, density, texture):
    """(F,) in [0, 1]: the mean of the mask over each triangle."""

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
    """(n², 3) float32 barycentric coordinates: the centers of the equal triangles that n - 1 cuts a side make."""
    i, j = (grid.ravel() for grid in np.indices((n, n)))
    upright, inverted = i + j < n, i + j < n - 1
    first = np.concatenate([i[upright] + 1 / 3, i[inverted] + 2 / 3]) / n
    second = np.concatenate([j[upright] + 1 / 3, j[inverted] + 2 / 3]) / n
    return np.stack([first, second, 1.0 - first - second], axis=1).astype(np.float32)


def _between(low, high, part):
    return low + part * (high - low)


def _rounded(value):
    """To three digits: single precision, in which Blender keeps it, gives them back exactly."""
    return float(f"{min(max(value, _SMALLEST), _LARGEST):.2e}")
