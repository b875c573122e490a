# SPDX-License-Identifier: GPL-3.0-or-later
"""Python interface: import of curves, and transfer of grooms to other meshes."""

import os
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..core import geometry, grooming
from ..core.errors import HairError
from ..core.files.curve_file import TO_Z_UP, Convention, parsed_unit
from ..core.geometry.mesh import TriMesh
from ..core.geometry.strands import Strands, curve_offsets, from_numpy
from ..core.grooming import groom
from ..core.grooming.derived_guides import DerivationSettings
from ..core.grooming.transfer_settings import TransferSettings
from ..core.long_work import Progress, no_progress, run_now
from ..core.mesh_hair.mesh_strand_settings import MeshStrandSettings
from .arguments import are_arrays, changed, checked_progress, choice, curves_object_of, mesh_of, path_of
from .blender_access import blender

if TYPE_CHECKING:
    from ..blender.groom.foreign.hand_made_guides import HandMade
    from ..blender.groom.foreign.kept_hair import KeptHair
    from ..blender.groom.transfer.system_transfer import TransferredGroom
    from ..blender.io.curve_files import Found
    from ..blender.io.mesh_hair import MeshHair


Curves = Any
MeshObject = Any
Arrays = TriMesh | tuple[ArrayLike, ArrayLike]

__all__ = [
    "DerivationSettings",
    "MeshStrandSettings",
    "TransferSettings",
    "convert_particles",
    "import_curves",
    "import_groups",
    "mesh_to_hair",
    "transfer_groom",
    "use_as_guides",
    "use_as_hair",
]


def use_as_guides(
    curves: Curves | Iterable[ArrayLike],
    surface: MeshObject | Arrays | None = None,
    *,
    every: int = 1,
    applies_modifiers: bool = True,
    progress: Progress = no_progress,
) -> Curves | Strands:
    """Use curves that Vellus did not create as guides; every n-th curve is kept.

    curves: a curves object, which becomes guide Curves in place and is returned, or arrays (P, 3) [m], one for each
    curve, for which `Strands` are returned; surface: the mesh object that they grow on, None for the curves' own
    surface, or (vertices, triangles) for arrays; applies_modifiers: use the evaluated instead of the original curves.
    The root is the end nearer to the surface; curves of zero length or with non-finite points are removed. Points do
    not move.

    >>> bpy.ops.object.curves_random_add()
    {'FINISHED'}
    >>> guides = api.use_as_guides(bpy.context.object, bpy.data.objects["Scalp"], every=10)
    >>> len(guides.curves)
    50
    >>> mesh = [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]
    >>> lines = [[(0.2, 0.2, 0.0), (0.2, 0.2, 0.1)], [(0.3, 0.2, 0.0), (0.3, 0.3, 0.1), (0.4, 0.3, 0.1)]]
    >>> api.use_as_guides(lines, mesh).numpy().shape
    (2, 41, 3)
    """
    if are_arrays(surface):
        return _guides_of_arrays(curves, mesh_of(surface), every)

    curves_object = curves_object_of(curves)
    if surface is None:
        surface = blender.groom.foreign.hand_made_guides.find_surface(
            curves_object, blender.data.scene.present_depsgraph().view_layer
        )
    work = blender.groom.foreign.hand_made_guides.using_as_guides(
        curves_object,
        blender.data.arguments.surface_object(surface),
        blender.data.scene.present_depsgraph(),
        every=every,
        applies_modifiers=applies_modifiers,
    )
    return run_now(work, checked_progress(progress)).guides


def _guides_of_arrays(curves, mesh, every):
    points, starts = grooming.rooted_curves.polylines(curves)
    rooted = grooming.rooted_curves.root(mesh, points, starts, every)
    points = points[rooted.point_order(starts)]
    starts = curve_offsets(np.diff(starts)[rooted.kept])
    return from_numpy(geometry.curves.resampling.resample(points, starts, groom.POINT_COUNT), rooted.roots)


def use_as_hair(
    curves: Curves,
    surface: MeshObject | None = None,
    settings: DerivationSettings | None = None,
    *,
    applies_modifiers: bool = True,
    follows_guides: bool = False,
    guides: Curves | None = None,
    progress: Progress = no_progress,
    **changes: Any,
) -> "KeptHair":
    """Use curves that Vellus did not create as hair, unchanged, and derive guides that reproduce them.

    curves, surface and applies_modifiers: as in `use_as_guides`; settings: `DerivationSettings`; changes: its fields by
    name; follows_guides: replace the strands with interpolated strands on the same roots; guides: a curves object that
    becomes the hair's guides instead of derived ones. The result has `hair` and `guides`, the Curves, and `mean_error`
    and `high_error`: the root mean square and the 95th percentile of the strands' reproduction errors, relative to
    their lengths. Points do not move.

    >>> bpy.ops.object.curves_random_add()
    {'FINISHED'}
    >>> used = api.use_as_hair(bpy.context.object, bpy.data.objects["Scalp"], guide_count=50)
    >>> len(used.hair.curves), len(used.guides.curves), used.mean_error < used.high_error
    (500, 50, True)
    """
    wanted, progress = changed(DerivationSettings, settings, changes), checked_progress(progress)
    curves_object = curves_object_of(curves)
    depsgraph = blender.data.scene.present_depsgraph()
    if surface is None:
        surface = blender.groom.foreign.hand_made_guides.find_surface(curves_object, depsgraph.view_layer)
    work = blender.groom.foreign.kept_hair.using_as_hair(
        curves_object,
        blender.data.arguments.surface_object(surface),
        depsgraph,
        wanted,
        applies_modifiers=applies_modifiers,
        follows_guides=follows_guides,
        guides_object=None if guides is None else curves_object_of(guides),
    )
    return run_now(work, progress)


def convert_particles(
    surface: MeshObject,
    use: str = "HAIR",
    settings: DerivationSettings | None = None,
    *,
    progress: Progress = no_progress,
    **changes: Any,
) -> "KeptHair | HandMade":
    """Convert the hair of a mesh object's particle system, and switch the system off.

    use: "HAIR" keeps the hairs as strands and derives guides from them, with `DerivationSettings` and changes by name;
    "GUIDES" uses the hairs as guides and grows strands between them, without settings or changes. Of several systems,
    the active one is converted, or the first with hair. Child hairs are not converted. The result has `hair` and
    `guides`, the Curves. Blender converts selected objects, so afterwards only the mesh and the new object are
    selected. Raises `HairError`.

    >>> scalp = bpy.data.objects["Scalp"]
    >>> system = scalp.modifiers.new("Hair", "PARTICLE_SYSTEM").particle_system
    >>> system.settings.type, system.settings.count = "HAIR", 300
    >>> made = api.convert_particles(scalp, guide_count=20)
    >>> len(made.hair.curves), len(made.guides.curves)
    (300, 20)
    """
    choice(use, "use", ("HAIR", "GUIDES"))
    wanted = changed(DerivationSettings, settings, changes)
    if use == "GUIDES" and (settings is not None or changes):
        raise HairError('The guide count has no effect if all hairs become guides: leave it out, or use "HAIR".')
    mesh_object = blender.data.arguments.surface_object(surface)
    return blender.groom.foreign.particle_hair.convert(mesh_object, use, wanted, checked_progress(progress))


def mesh_to_hair(
    mesh: MeshObject,
    surface: MeshObject,
    settings: MeshStrandSettings | None = None,
    *,
    guide_count: int = 400,
    hides_mesh: bool = True,
    progress: Progress = no_progress,
    **changes: Any,
) -> "MeshHair":
    """Turn a mesh object of hair cards, tubes or solid locks into hair on a surface, and derive guides from it.

    settings: `MeshStrandSettings`; changes: its fields by name; guide_count: as of `use_as_hair`; hides_mesh: hide the
    mesh object. Strands run from the root end to the tip end of each piece; the colors of the mesh's material or color
    attribute become a map of the hair's color. The result has `hair` and `guides`, the Curves, `piece_count`, the
    number of used pieces, and `skipped_count`, the number of pieces that are neither cards nor slender, or too large.
    Raises `HairError` before anything changes.

    >>> tubes = api.make_hair_tubes(bpy.data.objects["Hair"], tube_count=100)
    >>> made = api.mesh_to_hair(tubes, bpy.data.objects["Scalp"], strand_count=100, guide_count=20)
    >>> len(made.hair.curves), len(made.guides.curves), made.piece_count, made.skipped_count
    (100, 20, 100, 0)
    """
    wanted, progress = changed(MeshStrandSettings, settings, changes), checked_progress(progress)
    work = blender.io.mesh_hair.using_mesh(
        blender.data.arguments.surface_object(mesh),
        blender.data.arguments.surface_object(surface),
        blender.data.scene.present_depsgraph(),
        wanted,
        DerivationSettings(guide_count=guide_count),
        hides_mesh=hides_mesh,
    )
    return run_now(work, progress)


def import_curves(
    path: str | os.PathLike,
    surface: MeshObject,
    kind: str = "HAIR",
    *,
    name: str = "",
    unit: str | float | None = None,
    up: str | None = None,
) -> "Found":
    """Read curves from a file, for `use_as_guides` and `use_as_hair`.

    path: .abc, .usd, .usdc, .usda, .usdz, .npz, .hair, .data, .bin, .ply, .obj, .tfx or .blend; surface: the mesh
    object that the curves grow on, by which missing unit and axis are inferred; kind: "GUIDES" or "HAIR", if a groom
    has both; name: of an object or a group, "" for all; unit: m, cm, mm, in, ft, km or the number of meters in a unit;
    up: X, Y or Z; None for the file's own. The result has `curves`, a curves object, `guides`, the file's guides of
    this hair or None, and `notes`, sentences about assumptions and skipped curves.

    >>> api.export_groom("groom.abc", [bpy.data.objects["Hair"]])
    []
    >>> found = api.import_curves("groom.abc", bpy.data.objects["Scalp"])
    >>> used = api.use_as_hair(found.curves, bpy.data.objects["Scalp"], guides=found.guides)
    >>> len(used.hair.curves) == len(bpy.data.objects["Hair"].data.curves), found.notes
    (True, [])
    """
    wanted = _wanted(kind, name, unit, up)
    with blender.io.curve_files.curves_of(
        path_of(path), wanted, blender.data.arguments.surface_object(surface)
    ) as found:
        return found


def import_groups(
    path: str | os.PathLike,
    surface: MeshObject,
    kind: str = "HAIR",
    *,
    unit: str | float | None = None,
    up: str | None = None,
) -> "list[Found]":
    """Read the groups of a groom from a file, each for its own hair system, and return a result for each group.

    Arguments and results are those of `import_curves`. Raises `HairError`.

    >>> api.export_groom("groom.abc", [bpy.data.objects["Hair"]])
    []
    >>> groups = api.import_groups("groom.abc", bpy.data.objects["Scalp"])
    >>> [len(found.curves.data.curves) for found in groups] == [len(bpy.data.objects["Hair"].data.curves)]
    True
    """
    wanted = _wanted(kind, "", unit, up)
    return blender.io.curve_files.groups_of(path_of(path), wanted, blender.data.arguments.surface_object(surface))


def _wanted(kind, name, unit, up):
    """Return the checked `Wanted`. Raises `HairError`."""
    choice(kind, "kind", ("GUIDES", "HAIR"))
    if up is not None:
        choice(up, "axis", tuple(TO_Z_UP))
    meters = None if unit is None else parsed_unit(str(unit))
    return blender.io.curve_files.Wanted(kind, name, Convention(meters, up))


def transfer_groom(
    hair: Curves,
    surface: MeshObject,
    settings: TransferSettings | None = None,
    *,
    progress: Progress = no_progress,
    **changes: Any,
) -> "TransferredGroom":
    """Copy hair and its guides, or guides alone, to another mesh object of any topology.

    settings: `TransferSettings`; changes: its fields by name: method "UV", "NEAREST" or "LANDMARKS", alignment, reach,
    scale_lengths. The result has `guides` and `hair`, the new Curves, `places` with `kept` and `lost_count`, and
    `cleared`, the names of masks that the mesh does not have.

    >>> bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=2.0)
    {'FINISHED'}
    >>> made = api.transfer_groom(bpy.data.objects["Hair"], bpy.context.object)
    >>> len(made.guides.curves), made.places.lost_count, round(made.places.scale, 1)
    (75, 0, 2.0)
    """
    wanted, progress = changed(TransferSettings, settings, changes), checked_progress(progress)
    given = blender.data.arguments.curves_of(hair)
    is_hair = given.vellus.kind == "HAIR"
    guides = blender.groom.pipeline.inputs_of(given)[0] if is_hair else blender.data.arguments.guides_of(given)
    target = blender.data.arguments.surface_object(surface)
    depsgraph = blender.data.scene.present_depsgraph()
    work = blender.groom.transfer.system_transfer.transferring(
        guides, given if is_hair else None, target, wanted, depsgraph
    )
    return run_now(work, progress)
