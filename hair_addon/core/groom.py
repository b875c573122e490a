# SPDX-License-Identifier: GPL-3.0-or-later
"""Section 2 of [Report12] as two functions: `distribute_guides` and `generate_hair`, with their settings.

`generate_hair` is `bind_hair` (roots, neighbours, weights: all that depends on where guides are rooted) followed by
`hair_binding.follow_guides` (what combing repeats). The stages need Warp, which takes long to import, so they are
imported late.
"""

import math
from dataclasses import dataclass

import numpy as np

from . import hair_binding
from .hair_binding import HairBinding
from .long_work import part_of, unheard
from .mesh import check_mesh, check_points, positions
from .params import Settings, param
from .strands import Strands

CONTROL_POINT_COUNT = 6  # [Report12] section 5
POINT_COUNT = 41  # [Report12] section 2.2

COMPILING = "Compiling kernels"  # the step that takes long where Vellus is used for the first time


@dataclass(frozen=True)
class GuideSettings(Settings):
    """Where guides are rooted and how they grow."""

    guide_count: int = param(200, "How many guides are placed", label="Guides", low=1, high=1_000_000, soft_high=4000)
    seed: int = param(1, "Number that all randomness follows from", low=0, high=2**31 - 1)
    density_group: str = param("", "Vertex group that guides follow; empty: the whole surface")
    density_image: str = param("", "Image that guides follow by the surface's UV map, black for none; empty: no image")
    curvature: float = param(
        0.0,
        "How much closer guides stand where the surface bends",
        label="Follow Curvature",
        low=0.0,
        high=100.0,
        soft_high=4.0,
    )
    symmetric: bool = param(False, "Root guides alike on both sides of the object's X axis")
    relax_iterations: int = param(12, "Rounds of relaxation that even out the guides", low=0, high=1000, soft_high=100)
    length: float = param(
        0.15,
        "Length of the guides from root to tip",
        above=0.0,
        high=1e6,
        soft_high=1.0,
        unit="LENGTH",
        subtype="DISTANCE",
    )
    length_variation: float = param(0.2, "Random part of the length", low=0.0, high=1.0, subtype="FACTOR")
    tilt: float = param(
        math.radians(15.0),
        "Largest random angle between a guide and the surface's normal at its root",
        low=0.0,
        high=math.radians(90.0),
        unit="ROTATION",
        subtype="ANGLE",
    )
    gravity: float = param(0.5, "How far guides lean towards the ground", low=0.0, high=1.0, subtype="FACTOR")


@dataclass(frozen=True)
class HairSettings(Settings):
    """How many strands grow between the guides, and which guides each of them follows."""

    strand_count: int = param(
        30_000, "How many strands are grown", label="Strands", low=1, high=10_000_000, soft_high=100_000
    )
    seed: int = param(1, "Number that all randomness follows from", low=0, high=2**31 - 1)
    density_group: str = param("", "Vertex group that strands follow; empty: the whole surface")
    automatic_influence: bool = param(
        True, "Choose the influence distance from the spacing of the guides around a root"
    )
    influence_distance: float = param(
        0.03,
        "Guides nearer to a root than this shape its strand",
        above=0.0,
        high=1e6,
        soft_high=1.0,
        unit="LENGTH",
        subtype="DISTANCE",
    )
    neighbour_limit: int = param(8, "Most guides that one strand follows: the nearest", low=1, high=32)
    keep_length: float = param(
        1.0,
        "How far strands are made as long as their guides, which a mean of guides that disagree is not",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
    )
    angle_limit: float = param(
        math.radians(60.0),
        "Guides that lean further away than this from a strand's nearest guide do not shape it; 180°: all do",
        low=0.0,
        high=math.pi,
        unit="ROTATION",
        subtype="ANGLE",
    )
    length_limit: float = param(
        3.0,
        "Guides this many times longer or shorter than a strand's nearest guide do not shape it",
        low=1.0,
        high=1e6,
        soft_high=10.0,
    )
    region_group: str = param("", "Vertex group that parts hair: no strand follows guides inside and outside; or none")
    region_attribute: str = param(
        "", "Integers on the surface's faces or vertices, or on guides: no strand follows guides of two; or none"
    )
    part_lines: str = param(
        "", "Curve object on the surface: no strand follows guides on the other side of its lines; empty: none"
    )
    guide_map: bool = param(True, "Store each strand's guides and weights as attributes of its curve")
    radius: float = param(
        0.00008, "Radius of a strand at its root", above=0.0, high=1e3, soft_high=0.01, unit="LENGTH", precision=6
    )
    tip_taper: float = param(
        0.2, "Radius at the tip as a part of the radius at the root", low=0.0, high=1.0, subtype="FACTOR"
    )


def distribute_guides(
    mesh,
    settings,
    *,
    density=None,
    texture=None,
    mirror_normal=(1.0, 0.0, 0.0),
    shape=None,
    roots=None,
    device="cpu",
    progress=unheard,
) -> Strands:
    """Guides, evenly placed and grown: (guide_count, POINT_COUNT) strands.

    mesh: `TriMesh` [m]; settings: `GuideSettings`; density: (V,) per vertex, at least 0, or None for uniform; texture:
    `Texture` that multiplies it, or None; mirror_normal: of the plane through the origin that symmetric guides mirror;
    shape: `TriMesh` that was turned and scaled evenly to be `mesh`, its mirror across the X axis: guides are placed on
    it, and so in the same places however it was turned and scaled; None where there is none; roots: `SurfacePoints`
    that guides have already, None to place them; progress(step, part): told how far the work is, and may raise to stop
    it.
    """
    check_mesh(mesh)
    progress(COMPILING, 0.0)
    from . import (
        bspline,
        curvature,
        cut_cells,
        cvt,
        farthest,
        fingerprint,
        ground,
        guides,
        islands,
        sampled_cells,
        springs,
        surface_query,
        transform,
        voronoi,
    )

    _load_kernels(device, bspline, cut_cells, guides, sampled_cells, springs, surface_query, voronoi)
    _load_kernels("cpu", farthest, fingerprint, islands, transform)
    relaxing = part_of(progress, 0.1, 0.9)
    mirror = ground.Mirror(np.asarray(mirror_normal, np.float64)) if settings.symmetric else None
    if roots is None:
        placed_on = mesh if shape is None else shape
        if settings.curvature:
            bend = curvature.bend_density(placed_on, settings.curvature)
            density = bend if density is None else bend * density
        roots = cvt.place(
            placed_on,
            settings.guide_count,
            settings.seed,
            settings.relax_iterations,
            density=density,
            texture=texture,
            mirror=mirror if mirror is None or shape is None else ground.Mirror(np.array([1.0, 0.0, 0.0])),
            device=device,
            progress=lambda part: relaxing("Spreading guides", part),
        )
    progress("Growing guides", 0.9)
    controls = guides.grow(
        mesh,
        roots,
        length=settings.length,
        length_variation=settings.length_variation,
        tilt=settings.tilt,
        gravity=settings.gravity,
        seed=settings.seed,
        control_point_count=CONTROL_POINT_COUNT,
        device=device,
    )
    if mirror is not None:
        controls = _symmetric(controls, positions(mesh, roots), mirror)
    return Strands(bspline.evaluate(controls, POINT_COUNT, device), roots)


def _symmetric(controls, places, mirror):
    """Controls (G, n, 3) of which the second half are grown as images of the first, where their roots (G, 3) are."""
    count = len(places) // 2
    images = mirror.image(places[:count])
    reach = 5e-3 * np.ptp(places, axis=0).max()
    is_image = np.linalg.norm(images - places[len(places) - count :], axis=1) <= reach
    arms = controls[:count] - controls[:count, :1]
    mirrored = mirror.image(arms.reshape(-1, 3)).reshape(arms.shape) + places[len(places) - count :, None]
    controls[len(places) - count :][is_image] = mirrored[is_image]
    return controls


def bind_hair(
    mesh,
    guides,
    settings,
    *,
    density=None,
    regions=(),
    lines=None,
    drawn_on=None,
    shape=None,
    roots=None,
    device="cpu",
    progress=unheard,
) -> HairBinding:
    """Roots of the strands and the guides that each follows; depends on the guides' roots, not on their shape.

    Arguments as in `generate_hair`; drawn_on: (V, 3) vertices that the part lines are near to, if not the mesh's own;
    shape as in `distribute_guides`; roots: `SurfacePoints` that strands have already, None to place them.
    """
    check_mesh(mesh)
    check_points(mesh, guides.roots)
    progress(COMPILING, 0.0)
    from . import (
        fingerprint,
        guide_weights,
        hash_grid,
        lane_interpolation,
        leaders,
        part_lines,
        rooting,
        sampling,
        surface_query,
        transform,
        vector_interpolation,
    )
    from .regions import kept_apart

    sums = vector_interpolation if device == "cpu" else lane_interpolation
    _load_kernels(device, guide_weights, hash_grid, sums, rooting)
    _load_kernels("cpu", fingerprint, leaders, sampling, transform)
    if lines is not None:
        _load_kernels(device, part_lines, surface_query)
        lines = part_lines.lay(mesh, lines, device, drawn_on)
    progress("Placing strands", 0.1)
    if roots is None:
        placed_on = mesh if shape is None else shape
        roots = sampling.sample_surface(placed_on, settings.strand_count, settings.seed, density)

    guide_positions, guide_normals = rooting.rooted(mesh, guides.roots, device)
    root_positions, root_normals = rooting.rooted(mesh, roots, device)
    progress("Finding guides", 0.4)
    candidates = guide_weights.find_candidates(
        root_positions,
        root_normals,
        guide_positions,
        guide_normals,
        settings.neighbour_limit,
        regions=kept_apart(regions, roots, guides.roots),
        lines=lines,
    )
    return hair_binding.weighed(roots, root_positions, root_normals, guide_normals, candidates, settings)


def _load_kernels(device, *modules):
    """Compile kernels, or load those that were compiled before: seconds once, microseconds from then on."""
    import warp as wp

    wp.force_load(device, [wp.get_module(module.__name__) for module in modules])


def generate_hair(mesh, guides, settings, *, density=None, regions=(), lines=None, device="cpu") -> Strands:
    """(strand_count, P) strands between the guides, P the guides' own point count.

    mesh: `TriMesh` [m] with the guides' roots on it; settings: `HairSettings`; density as in `distribute_guides`;
    regions: tuple of `Regions` that no strand mixes guides of; lines: (L, 2, 3) segments [m] near the surface that no
    strand mixes guides across, one that begins where the last ended going on, or None.
    """
    binding = bind_hair(mesh, guides, settings, density=density, regions=regions, lines=lines, device=device)
    return hair_binding.follow_guides(binding, guides)


def strand_radii(settings, point_count=POINT_COUNT):
    """(point_count,) float32 [m]: radius along every strand, from `radius` at the root to its `tip_taper` part."""
    return np.linspace(settings.radius, settings.radius * settings.tip_taper, point_count, dtype=np.float32)
