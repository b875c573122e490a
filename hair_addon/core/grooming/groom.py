# SPDX-License-Identifier: GPL-3.0-or-later
"""Section 2 of [Report12] as two functions: `distribute_guides` and `bind_hair`, with their settings.

`bind_hair` computes everything that depends on the guides' roots: strand roots, neighbors, weights.
`following.follow_guides` evaluates strands, and is repeated by combing. Warp is slow to import, so the stages are
imported late.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import geometry, grooming, interpolation, placement, styling
from ..geometry.faces.uv_maps import Texture
from ..geometry.mesh import SurfacePoints, TriMesh, check_mesh, check_points, positions
from ..geometry.mirror import ACROSS_X, Mirror
from ..geometry.strands import Strands
from ..interpolation.hair_binding import HairBinding
from ..interpolation.regions import Regions
from ..kernels import kernel_setup
from ..long_work import Progress, no_progress, part_of
from ..params import Settings, param, param_from_surface
from . import groom_defaults

if TYPE_CHECKING:
    from ..interpolation.part_lines import PartLines

CONTROL_POINT_COUNT = 6  # [Report12] section 5
POINT_COUNT = 41  # [Report12] section 2.2


@dataclass(frozen=True)
class GuideSettings(Settings):
    """Settings of the distribution and growth of guides."""

    guide_count: int = param(
        400,
        "Number of guides; more guides give finer control and take longer to place",
        label="Guide count",
        low=1,
        high=1_000_000,
        soft_high=4000,
    )
    guide_density: float = param(
        0.0,
        "Guides per square centimeter, kept when the surface, its scale or its mask changes; at 0, Guide Count is kept",
        low=0.0,
        high=1e6,
        soft_high=10.0,
    )
    seed: int = param(1, "Random seed; each value gives another random distribution", low=0, high=2**31 - 1)
    density_group: str = param(
        "",
        "Vertex group or attribute that controls guide density; higher values place more guides, zero places none",
        label="Guide mask",
    )
    density_image: str = param(
        "", "Image that controls guide density through the UV map; brighter pixels place more guides, black places none"
    )
    curvature: float = param(
        0.0,
        "Increase guide density in curved areas; higher values move more guides there",
        label="Follow Curvature",
        low=0.0,
        high=100.0,
        soft_high=4.0,
    )
    symmetric: bool = param(False, "Mirror the guide roots across the object's X axis")
    relax_iterations: int = param(
        12,
        "Relaxation steps; higher values space the guides more evenly and take longer",
        label="Even spacing",
        low=0,
        high=1000,
        soft_high=100,
    )
    length: float | None = param_from_surface(
        0.12,
        "Guide length from root to tip",
        above=0.0,
        high=1e6,
        soft_high=1.0,
        unit="LENGTH",
        subtype="DISTANCE",
        may_vary=True,
    )
    length_variation: float = param(
        0.2,
        "Random variation of the guide length; at 0 all guides are equally long",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
    )
    tilt: float = param(
        math.radians(15.0),
        "Maximum random angle between a guide and the surface normal; higher values look messier",
        label="Random tilt",
        low=0.0,
        high=math.radians(90.0),
        unit="ROTATION",
        subtype="ANGLE",
        may_vary=True,
    )
    gravity: float | None = param_from_surface(
        0.75,
        "Bend the guides toward the ground; higher values bend them more",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
        may_vary=True,
    )
    flow_lines: str = param(
        "", "Curve object on the surface; guides near its curves begin in their direction, from start to end"
    )
    lift: float = param(
        math.radians(30.0),
        "Angle between the surface and guides that are draped or near flow lines; at 0 they lie flat",
        low=0.0,
        high=math.radians(90.0),
        unit="ROTATION",
        subtype="ANGLE",
        may_vary=True,
    )
    drape: bool = param(False, "Let the guides fall as they grow until they rest on the surface; takes up to a second")


VARIED = ("length", "tilt", "gravity", "lift")  # settings of guides that may differ between guides


@dataclass(frozen=True)
class HairSettings(Settings):
    """Settings of strands: their number and their interpolation between guides."""

    strand_count: int = param(
        60_000,
        "Number of strands; more strands look denser and use more memory",
        label="Strand count",
        low=1,
        high=10_000_000,
        soft_high=100_000,
    )
    strand_density: float = param(
        0.0,
        "Strands per square centimeter, kept when the surface, its scale or its mask changes; at 0, Strand Count is "
        "kept",
        low=0.0,
        high=1e6,
        soft_high=300.0,
    )
    seed: int = param(1, "Random seed; each value gives another random distribution", low=0, high=2**31 - 1)
    density_group: str = param(
        "",
        "Vertex group or attribute that controls strand density. Leave empty to use the guide mask",
        label="Strand mask",
    )
    density_image: str = param(
        "",
        "Image that controls strand density through the UV map; brighter pixels grow more strands, black grows none. "
        "Leave empty to use the guide mask",
    )
    automatic_influence: bool = param(True, "Set the influence distance from the guide spacing around each root")
    influence_distance: float | None = param_from_surface(
        0.03,
        "Distance within which guides affect a strand; higher values blend more guides",
        above=0.0,
        high=1e6,
        soft_high=1.0,
        unit="LENGTH",
        subtype="DISTANCE",
    )
    neighbour_limit: int = param(
        8,
        "Maximum number of guides that a strand blends; higher values give smoother hair",
        label="Max guides per strand",
        low=1,
        high=32,
    )
    point_count: int = param(
        POINT_COUNT,
        "Number of points along a strand; curls need 8 for each turn",
        label="Points per strand",
        low=3,
        high=257,
        soft_high=129,
        is_structural=True,
    )
    keep_length: float = param(
        1.0,
        "Preserve the average length of the guides; at 0, strands between diverging guides become shorter",
        label="Preserve length",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
    )
    angle_limit: float = param(
        math.radians(60.0),
        "Maximum angle to a strand's nearest guide; guides beyond it do not affect the strand",
        label="Parting angle",
        low=0.0,
        high=math.pi,
        unit="ROTATION",
        subtype="ANGLE",
    )
    length_limit: float = param(
        3.0,
        "Maximum length ratio to a strand's nearest guide; guides beyond it do not affect the strand",
        label="Parting length ratio",
        low=1.0,
        high=1e6,
        soft_high=10.0,
    )
    region_group: str = param(
        "", "Vertex group that separates hair; strands do not blend guides inside and outside of it"
    )
    region_attribute: str = param(
        "",
        "Integer attribute of surface or guides that separates hair; strands blend guides of one value",
    )
    part_lines: str = param(
        "", "Curve object on the surface that parts the hair; strands do not blend guides across its curves"
    )
    guide_map: bool = param(
        False, "Store the guides of each strand and their weights as curve attributes", label="Store guide weights"
    )
    strand_length: float = param(
        1.0,
        "Length of a strand as a fraction of the length between its guides",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
        may_vary=True,
    )
    radius: float | None = param_from_surface(
        0.00004,
        "Radius of a strand at its root",
        above=0.0,
        high=1e3,
        soft_high=0.01,
        unit="LENGTH",
        precision=6,
        diameter=("thickness", "Diameter of a strand at its root"),
        may_vary=True,
    )
    tip_taper: float = param(
        0.2,
        "Thickness at the tip as a fraction of the thickness at the root",
        label="Tip thickness",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
    )


def distribute_guides(
    mesh: TriMesh,
    settings: GuideSettings,
    *,
    density: np.ndarray | None = None,
    texture: Texture | None = None,
    mirror: Mirror = ACROSS_X,
    shape: TriMesh | None = None,
    roots: SurfacePoints | None = None,
    flow: np.ndarray | None = None,
    lines: np.ndarray | None = None,
    drawn_on: np.ndarray | None = None,
    varied: Callable[[SurfacePoints], Mapping[str, np.ndarray]] | None = None,
    random: Callable[[SurfacePoints], np.ndarray | None] | None = None,
    device: str = "cpu",
    progress: Progress = no_progress,
) -> Strands:
    """Return evenly placed, grown guides (guide_count, POINT_COUNT); `dynamics.draped_growth` drapes them.

    mesh: `TriMesh` [m]; settings: `GuideSettings`; values of None are computed from the mesh (groom_defaults.py);
    density: (V,) of vertices, at least 0, None for uniform; texture: `Texture` that is multiplied with it, or None;
    mirror: for symmetric guides; shape: `TriMesh` of which `mesh` is a rotated and uniformly scaled copy, mirrored
    across the X axis: guides are placed on it, and thus in the same places for any rotation and scale, None for `mesh`;
    roots: existing `SurfacePoints` of guides, None to place them; flow: (L, 2, 3) segments [m] of flow lines, lines: of
    part lines, across which guides do not follow flow lines, and drawn_on (V, 3): as lines and drawn_on of `bind_hair`;
    varied: returns {setting: (G,)} for guides at roots (G), in place of settings in `VARIED`, or None; random: returns
    the random numbers of `guide_growth.grow`, or None; progress(step, part): callback, may raise to cancel. Raises
    `HairError`.
    """
    check_mesh(mesh)
    load_kernels(device, part_of(progress, 0.0, 0.1))

    settings = groom_defaults.complete(settings, mesh, density, texture)
    if roots is None:
        placed_on, across = (mesh, mirror) if shape is None else (shape, ACROSS_X)
        placing = part_of(progress, 0.1, 0.9)
        roots = _placed_roots(placed_on, settings, density, texture, across, device, placing)
    progress("Growing guides", 0.9)
    values: dict[str, Any] = {name: groom_defaults.known(getattr(settings, name)) for name in VARIED}
    values |= {} if varied is None else varied(roots)
    laid_flow = None
    if flow is not None:
        parting = laid_lines(mesh, lines, drawn_on, device)
        laid_flow = grooming.flow_lines.lay(mesh, flow, device, drawn_on, parting)
    controls = grooming.guide_growth.grow(
        mesh,
        roots,
        length_variation=settings.length_variation,
        random=None if random is None else random(roots),
        flow=laid_flow,
        is_draped=settings.drape,
        seed=settings.seed,
        control_point_count=CONTROL_POINT_COUNT,
        device=device,
        **values,
    )
    if settings.symmetric:
        controls = grooming.guide_growth.mirrored(controls, positions(mesh, roots), mirror)
    return Strands(geometry.curves.bspline.evaluate(controls, POINT_COUNT, device), roots)


def _placed_roots(mesh, settings, density, texture, mirror, device, progress):
    """Return the `SurfacePoints` of evenly placed guides, closer together where a mesh bends."""
    if settings.curvature:
        bend = geometry.curvature.bend_density(mesh, settings.curvature)
        density = bend if density is None else bend * density
    return placement.cvt.place(
        mesh,
        settings.guide_count,
        settings.seed,
        settings.relax_iterations,
        density=density,
        texture=texture,
        mirror=mirror if settings.symmetric else None,
        device=device,
        progress=lambda part: progress("Spreading guides", part),
    )


def bind_hair(
    mesh: TriMesh,
    guides: Strands,
    settings: HairSettings,
    *,
    density: np.ndarray | None = None,
    texture: Texture | None = None,
    regions: Sequence[Regions] = (),
    lines: np.ndarray | None = None,
    drawn_on: np.ndarray | None = None,
    shape: TriMesh | None = None,
    roots: SurfacePoints | None = None,
    is_mirrored: bool = False,
    tie_fractions: np.ndarray | None = None,
    device: str = "cpu",
    progress: Progress = no_progress,
) -> HairBinding:
    """Place strands and bind them to guides; the result depends on the guides' roots, not on their shapes.

    mesh: `TriMesh` [m] with the guides' roots on it; settings: `HairSettings`; density and texture: of strands, as in
    `distribute_guides`; regions: `Regions` across which strands do not blend guides; lines: (L, 2, 3) segments [m] of
    part lines near the surface, across which strands do not blend guides (consecutive segments that touch form a line),
    or None; drawn_on: (V, 3) vertices of the posed surface on which the part lines were drawn, None for the mesh's own;
    shape: as in `distribute_guides`; roots: existing `SurfacePoints` of strands, None to place them; is_mirrored:
    whether the mesh's triangles are wound opposite to the triangles of the stored roots, which identify strands;
    tie_fractions: (G,) in [0, 1], the fraction of each guide's points up to its tie, None without gathered guides.
    Raises `HairError`.
    """
    check_mesh(mesh)
    check_points(mesh, guides.roots)
    load_kernels(device, part_of(progress, 0.0, 0.1))

    laid = laid_lines(mesh, lines, drawn_on, device, part_of(progress, 0.0, 0.1))
    progress("Placing strands", 0.1)
    settings = groom_defaults.complete(settings, mesh, density, texture, len(guides.roots))
    if roots is None:
        placed_on = mesh if shape is None else shape
        where = placed_on, settings.strand_count, settings.seed, density
        if texture is None:
            roots = geometry.sampling.sample_surface(*where)
        else:
            roots = placement.textured_roots.sample_textured(*where, texture)

    progress("Finding guides", 0.4)
    binder = interpolation.root_binder.RootBinder(
        mesh, guides.roots, settings, regions, laid, is_mirrored, device, tie_fractions
    )
    return binder.bind(roots)


def laid_lines(
    mesh: TriMesh,
    lines: np.ndarray | None,
    drawn_on: np.ndarray | None = None,
    device: str = "cpu",
    progress: Progress = no_progress,
) -> "PartLines | None":
    """Return the `PartLines` of segments near a surface, None without segments; arguments as in `bind_hair`."""
    if lines is None:
        return None
    _load_kernels(device, [interpolation.part_lines], progress)
    return interpolation.part_lines.lay(mesh, lines, device, drawn_on)


def load_kernels(device: str, progress: Progress = no_progress, most_threads: int = kernel_setup.MOST_THREADS) -> None:
    """Load the kernels of guides and of hair without styles, which are compiled on first use.

    device, progress: as in `distribute_guides`; most_threads: of compilation. Takes microseconds if kernels are loaded.
    """
    progress(kernel_setup.LOADING, 0.0)
    on_device = [
        placement.exact_cells,
        interpolation.guide_weights,
        interpolation.interpolation,
        interpolation.sharp_edges,
        grooming.guide_growth,
        geometry.curves.bspline,
        geometry.search.hash_grid,
        geometry.root_frames,
        placement.sampled_cells,
        placement.preconditioner,
        geometry.closest_point,
        placement.voronoi,
    ]
    on_processor = [
        placement.farthest,
        geometry.fingerprint,
        geometry.faces.connected_components,
        geometry.search.counting_sort,
        interpolation.clump_centers,
        geometry.sampling,
    ]
    if device == "cpu":
        _load_kernels(device, [*on_device, *on_processor], progress, most_threads)
    else:
        _load_kernels(device, on_device, part_of(progress, 0.0, 0.8), most_threads)
        _load_kernels("cpu", on_processor, part_of(progress, 0.8, 1.0), most_threads)


def load_later_kernels(
    device: str, progress: Progress = no_progress, most_threads: int = kernel_setup.MOST_THREADS
) -> None:
    """Load the kernels of styles and moving surfaces; arguments as in `load_kernels`."""
    later = [styling.steps, styling.stack, styling.guide_lean, geometry.transform]
    _load_kernels(device, later, progress, most_threads)


def _load_kernels(device, modules, progress, most_threads=kernel_setup.MOST_THREADS):
    import warp as wp

    kernel_setup.load([wp.get_module(module.__name__) for module in modules], device, progress, most_threads)


def strand_radii(settings: HairSettings, course: np.ndarray | None = None) -> np.ndarray:
    """Return the radii (point_count,) float32 [m] along each strand, from `radius` to `radius` × `tip_taper`.

    course: (N,) factors of the radius at even places from root to tip, in place of `tip_taper`; None for a straight
    line.
    """
    radius = groom_defaults.known(settings.radius)
    if course is None:
        return np.linspace(radius, radius * settings.tip_taper, settings.point_count, dtype=np.float32)
    along = np.linspace(0.0, 1.0, settings.point_count)
    return (radius * np.interp(along, np.linspace(0.0, 1.0, len(course)), course)).astype(np.float32)
