# SPDX-License-Identifier: GPL-3.0-or-later
"""Options of commands that read curves from a file: selection, unit and up axis."""

from ..core import lazy
from ..core.errors import HairError
from ..core.files.curve_file import ENDINGS, UNITS, Convention, parsed_unit
from ..core.mesh_hair.mesh_strand_settings import MeshStrandSettings
from ..core.params import declared

_ROOT_ENDS = next(d.choices for name, _default, d in declared(MeshStrandSettings) if name == "root_end")

blender = lazy.Package("..blender", __package__)


def add_axis(parser):
    """Add the option for the up axis of the mesh and of curves."""
    parser.add_argument(
        "--up",
        choices=("X", "Y", "Z"),
        help="axis that points up in an .obj, .ply or .stl [Z], else in the file of curves [that file's own]",
    )


def add_curves(parser):
    """Add the options for curves from a file."""
    parser.add_argument(
        "--guides-from", metavar="FILE", help=f"use the curves of a file as guides: {', '.join(['.blend', *ENDINGS])}"
    )
    parser.add_argument(
        "--hair-from",
        metavar="FILE",
        help="use the curves of such a file as hair, unchanged, with its guides or with derived ones (--guides)",
    )
    parser.add_argument(
        "--from-mesh",
        metavar="NAME",
        help="turn a mesh object of cards, tubes or solid locks in the input file into hair, with derived guides",
    )
    parser.add_argument(
        "--from-particles",
        choices=("HAIR", "GUIDES"),
        help="use the surface's particle hair, without its children, as hair or as guides",
    )
    parser.add_argument(
        "--mesh-roots",
        choices=[value for value, *_ in _ROOT_ENDS],
        help="root ends of --from-mesh: nearest to the surface, or by the V coordinate [SURFACE]",
    )
    parser.add_argument(
        "--fill-thickness",
        action="store_true",
        help="with --from-mesh: strands fill their card, tube or lock together",
    )
    parser.add_argument(
        "--object",
        "--guides-object",
        dest="object",
        default="",
        metavar="NAME",
        help="object or group in either file [all]",
    )
    parser.add_argument(
        "--by-group",
        action="store_true",
        help="make a hair system of each group of a groom, in a .blend, instead of one of all groups",
    )
    parser.add_argument(
        "--unit",
        metavar="UNIT",
        help=f"unit in either file: {', '.join(UNITS)}, or the number of meters in a unit [the file's own]",
    )


def checked(given):
    """Return the path of the curve file, or None. Raises `HairError` for conflicting options."""
    came_from = given.guides_from or given.hair_from
    if given.guides_from and given.hair_from:
        raise HairError("--guides-from and --hair-from exclude each other.")
    if given.from_mesh and came_from:
        raise HairError("--from-mesh excludes --guides-from and --hair-from.")
    if given.from_particles and (came_from or given.from_mesh):
        raise HairError("--from-particles excludes --guides-from, --hair-from and --from-mesh.")
    if (given.mesh_roots or given.fill_thickness) and not given.from_mesh:
        raise HairError("--mesh-roots and --fill-thickness need --from-mesh.")
    for name in ("object", "unit", "by_group"):
        if getattr(given, name) and not came_from:
            raise HairError(f"--{name.replace('_', '-')} needs --guides-from or --hair-from.")
    if given.by_group and given.out.suffix.lower() != ".blend":
        raise HairError("--by-group needs a .blend file as output: other files have one hair system.")
    is_blend = came_from is not None and came_from.suffix.lower() == ".blend"
    if is_blend and given.unit:
        raise HairError("--unit has no effect on a .blend file, which has its own.")
    if given.unit:
        parsed_unit(given.unit)
    if given.up and not blender.io.mesh_files.lacks_up_axis(given.input) and (is_blend or not came_from):
        raise HairError(f"--up has no effect: {given.input} has its own axes.")
    if given.up == "X" and blender.io.mesh_files.lacks_up_axis(given.input):
        raise HairError("--up X is not supported for a mesh file: use Y or Z.")
    return came_from


def source(given):
    """Return the file or the particle hair that curves come from, for messages."""
    return given.guides_from or given.hair_from or "particle hair"


def wanted(kind, given, file_axes):
    """Return the `Wanted` of the options; file_axes: (3, 3) from Blender's axes to those of the mesh file."""
    # --up belongs to the mesh file if that has no up axis, otherwise to the curve file.
    is_of_curves = given.up and not blender.io.mesh_files.lacks_up_axis(given.input)
    convention = Convention(parsed_unit(given.unit) if given.unit else None, given.up if is_of_curves else None)
    axis = blender.io.mesh_files.axis_of(file_axes)
    plays = kind == "HAIR" and given.out.suffix.lower() == ".blend"
    return blender.io.curve_files.Wanted(kind, given.object, convention, axis, plays)
