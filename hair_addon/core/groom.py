# SPDX-License-Identifier: GPL-3.0-or-later
"""Section 2 of [Report12] as two functions: `distribute_guides` and `generate_hair`, with their settings.

`generate_hair` is `bind_hair` (roots, neighbours, weights: all that depends on where guides are rooted) followed by
`follow_guides` (what combing repeats). The stages need Warp, which takes long to import, so they are imported late.
"""

import math
from dataclasses import dataclass

import numpy as np

from .errors import HairError
from .long_work import part_of, unheard
from .mesh import SurfacePoints, check_mesh, check_points, positions
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


@dataclass(frozen=True)
class HairBinding:
    """What ties hair to a surface and its guides, and does not change while guides are combed."""

    roots: SurfacePoints
    positions: "wp.array[wp.vec3]"  # noqa: F821 (S,) [m]
    normals: "wp.array[wp.vec3]"  # noqa: F821 (S,) unit
    guide_normals: "wp.array[wp.vec3]"  # noqa: F821 (G,) unit, at the guides' roots
    candidates: "guide_weights.Candidates"  # noqa: F821 (S, k + 1)
    guide_weights: "guide_weights.GuideWeights"  # noqa: F821 (S, k), before guides that differ are left out
    limits: "guide_weights.Limits"  # noqa: F821
    keep_length: float


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
    _load_kernels("cpu", fingerprint, leaders, transform)
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
    return _weighed(roots, root_positions, root_normals, guide_normals, candidates, settings)


def _weighed(roots, root_positions, root_normals, guide_normals, candidates, settings):
    """The `HairBinding` of strands that have found their guides."""
    from . import guide_weights

    return HairBinding(
        roots,
        root_positions,
        root_normals,
        guide_normals,
        candidates,
        guide_weights.weigh(
            candidates,
            root_normals,
            guide_normals,
            None if settings.automatic_influence else settings.influence_distance,
            settings.neighbour_limit,
        ),
        guide_weights.Limits(settings.angle_limit, settings.length_limit),
        settings.keep_length,
    )


def weigh_again(binding, settings):
    """A `HairBinding` with other weights, limits or lengths: no search. For at most as many guides as were found."""
    places = binding.roots, binding.positions, binding.normals, binding.guide_normals
    return _weighed(*places, binding.candidates, settings)


def _load_kernels(device, *modules):
    """Compile kernels, or load those that were compiled before: seconds once, microseconds from then on."""
    import warp as wp

    wp.force_load(device, [wp.get_module(module.__name__) for module in modules])


def follow_guides(binding, guides) -> Strands:
    """Strands of a binding for the guides as they are combed now: no search."""
    weights = weights_now(binding, guides)
    return Strands(_follow(binding, guides, binding.positions, binding.normals, weights), binding.roots)


def strand_points(binding, guides, weights, out=None):
    """(S, P, 3) float32 [m]: the points of `follow_guides` in the processor's memory; what live editing repeats.

    weights: what `weights_now` gives; out: such an array to fill and return, or None for a new one.
    """
    import warp as wp

    from . import cores

    roots, normals, device = binding.positions, binding.normals, binding.positions.device
    shape = len(roots), guides.point_count
    there = cores.empty_for_results(shape, device) if out is None else wp.array(out, dtype=wp.vec3, copy=False)
    if device.is_cpu:
        return _follow(binding, guides, roots, normals, weights, there).numpy()
    wp.copy(there, _follow(binding, guides, roots, normals, weights))
    wp.synchronize_device(device)
    return there.numpy()


def follow_some(binding, guides, chosen, weights):
    """(M, P, 3) float32 [m]: the points that `strand_points` gives some strands, and no others are computed.

    chosen: (M,) indices of strands, such as `guide_weights.Reach` finds for the guides that moved; weights: theirs, as
    `weights_now` gives them.
    """
    import warp as wp

    from .guide_weights import rows

    chosen = wp.array(chosen, dtype=int, device=binding.positions.device)
    return _follow(binding, guides, rows(binding.positions, chosen), rows(binding.normals, chosen), weights).numpy()


def weights_now(binding, guides, chosen=None):
    """The `GuideWeights` by which strands follow the guides as combed now; chosen: (M,) indices of some, None: all."""
    import warp as wp

    from . import guide_weights

    if len(guides) != len(binding.guide_normals):
        raise HairError(
            f"The hair was bound to {len(binding.guide_normals)} guides and there are {len(guides)} now: bind it again."
        )
    weights = binding.guide_weights
    if chosen is not None:
        weights = weights.of(wp.array(chosen, dtype=int, device=binding.positions.device))
    return guide_weights.limited(weights, _guide_points(binding, guides), binding.guide_normals, binding.limits)


def _guide_points(binding, guides):
    # A kernel that is handed memory of another device reads rubbish, or ends all work on its own.
    return guides.points.to(binding.positions.device)


def _follow(binding, guides, roots, root_normals, weights, out=None):
    from . import interpolation

    points, guide_normals = _guide_points(binding, guides), binding.guide_normals
    return interpolation.interpolate(roots, root_normals, points, guide_normals, weights, binding.keep_length, out)


def leading_strands(mesh, guides, binding):
    """(S,) int32: the strand of a `HairBinding` that stands for the guide that each follows first."""
    from . import leaders

    first = binding.guide_weights.indices.numpy()[:, 0]
    return leaders.leaders(first, binding.positions.numpy(), positions(mesh, guides.roots))


def generate_hair(mesh, guides, settings, *, density=None, regions=(), lines=None, device="cpu") -> Strands:
    """(strand_count, P) strands between the guides, P the guides' own point count.

    mesh: `TriMesh` [m] with the guides' roots on it; settings: `HairSettings`; density as in `distribute_guides`;
    regions: tuple of `Regions` that no strand mixes guides of; lines: (L, 2, 3) segments [m] near the surface that no
    strand mixes guides across, one that begins where the last ended going on, or None.
    """
    binding = bind_hair(mesh, guides, settings, density=density, regions=regions, lines=lines, device=device)
    return follow_guides(binding, guides)


def strand_radii(settings, point_count=POINT_COUNT):
    """(point_count,) float32 [m]: radius along every strand, from `radius` at the root to its `tip_taper` part."""
    return np.linspace(settings.radius, settings.radius * settings.tip_taper, point_count, dtype=np.float32)
