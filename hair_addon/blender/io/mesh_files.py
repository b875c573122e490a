# SPDX-License-Identifier: GPL-3.0-or-later
"""Opening of .blend files, and import of mesh files into an empty scene, in Blender's axes and in meters."""

import contextlib
import io
import mmap
import re
from pathlib import Path

import bpy
import numpy as np

from ...core.errors import HairError, cause_of
from ..host import paths
from . import mesh_checks

# Blender's axes → those of a file whose Y axis points up: (x, y, z) → (x, z, -y).
_Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
_UP = {"Y": _Y_UP, "Z": np.eye(3)}


def _import_obj(path, up):
    return bpy.ops.wm.obj_import(filepath=path, **_axes(up))


def _import_ply(path, up):
    return bpy.ops.wm.ply_import(filepath=path, **_axes(up))


def _import_stl(path, up):
    return bpy.ops.wm.stl_import(filepath=path, **_axes(up))


def _import_gltf(path, _up):
    # The importer is written in Python: send its messages where Blender's own go. Errors are raised too.
    blenders = io.TextIOWrapper(io.FileIO(2, "w", closefd=False), errors="backslashreplace", write_through=True)
    with contextlib.redirect_stderr(blenders):
        return bpy.ops.import_scene.gltf(filepath=path, disable_bone_shape=True)  # bone shapes would add a mesh


def _import_usd(path, _up):
    return bpy.ops.wm.usd_import(filepath=path)


def _import_alembic(path, _up):
    return bpy.ops.wm.alembic_import(filepath=path, as_background_job=False)


def _import_fbx(path, _up):
    return bpy.ops.wm.fbx_import(filepath=path)


def _axes(up):
    return {"forward_axis": "Y", "up_axis": "Z"} if up == "Z" else {"forward_axis": "NEGATIVE_Z", "up_axis": "Y"}


# Extension → (import function, its operator, check for damage that the operator would miss).
_FORMATS = {
    ".obj": (_import_obj, "wm.obj_import", mesh_checks.require_obj),
    ".ply": (_import_ply, "wm.ply_import", mesh_checks.require_ply),
    ".stl": (_import_stl, "wm.stl_import", mesh_checks.require_stl),
    ".glb": (_import_gltf, "import_scene.gltf", None),
    ".gltf": (_import_gltf, "import_scene.gltf", None),
    ".vrm": (_import_gltf, "import_scene.gltf", None),  # a binary glTF file
    ".fbx": (_import_fbx, "wm.fbx_import", None),
    **dict.fromkeys((".usd", ".usdc", ".usda", ".usdz"), (_import_usd, "wm.usd_import", mesh_checks.require_usd)),
    ".abc": (_import_alembic, "wm.alembic_import", mesh_checks.require_alembic),
}

# Formats whose importers can crash Blender on damaged files despite all checks.
_MAY_CRASH_BLENDER = {".ply", ".usd", ".usdc", ".usda", ".usdz", ".abc", ".glb", ".gltf", ".vrm", ".fbx"}

# The property UpAxis of an FBX file, binary or text; files of version 6 lack its second type. 1 is Y, 2 is Z.
_FBX_UP = re.compile(
    rb'UpAxisS\x03\0\0\0int(?:S\x07\0\0\0Integer)?S\0\0\0\0I(....)|"UpAxis", *"int"(?:, *"Integer")?, *"", *(\d)',
    re.DOTALL,
)

# Files without axes and units: read in meters.
_WITHOUT_UP_AXIS = {".obj", ".ply", ".stl"}


def lacks_up_axis(path):
    """Whether the format does not state its up axis."""
    return Path(path).suffix.lower() in _WITHOUT_UP_AXIS


def may_crash_blender(path):
    """Whether a damaged file of this format can crash the process that reads it."""
    return Path(path).suffix.lower() in _MAY_CRASH_BLENDER


def axis_of(file_axes):
    """Return the up axis of a file, "Y" or "Z"; file_axes: as `open_file` returns."""
    return next(name for name, axes in _UP.items() if np.array_equal(axes, file_axes))


def require_readable(path):
    """Raise `HairError` unless the file exists in a format that `open_file` supports."""
    path = Path(path)
    if path.is_dir():
        raise HairError(f"{path} is a folder: choose a file in it.")
    if not path.is_file():
        raise HairError(f"{path} does not exist: check the path.")
    ending = path.suffix.lower()
    if ending != ".blend" and ending not in _FORMATS:
        known = ", ".join([".blend", *_FORMATS])
        raise HairError(f"{path} has a format that Vellus cannot read: use {known}.")
    if ending in _FORMATS and not paths.has_operator(_FORMATS[ending][1]):
        raise HairError(f"{path} cannot be read: this build of Blender lacks its importer, {_FORMATS[ending][1]}.")


def require_blend(path):
    """Raise `HairError` unless the path is an existing .blend file."""
    require_readable(path)
    if path.suffix.lower() != ".blend":
        raise HairError(f"{path} is not a .blend file: rendering needs a scene with hair, a camera and lights.")


def open_file(path, *, up="Z", runs_scripts=False):
    """Load a .blend, or a mesh file into an empty scene; the open file is closed.

    up: up axis, Y or Z, of files that do not store one; runs_scripts: whether a .blend may run its scripts and
    drivers. Returns (3, 3): Blender's axes → the file's. Raises `HairError`.
    """
    path = Path(path)
    require_readable(path)
    ending = path.suffix.lower()
    try:
        if ending == ".blend":
            _open_blend(path, runs_scripts)
            return np.eye(3)
        import_, _operator, check = _FORMATS[ending]
        if check is not None:
            check(path)
        # Unlike factory settings this keeps preferences and add-ons, including this one.
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        if import_(str(path), up) != {"FINISHED"}:
            raise HairError(f"{path} cannot be read: it is damaged, or has another format.")
        mesh_checks.require_imported(path)
    except (OSError, RuntimeError) as error:
        raise HairError(f"{path} cannot be read: {cause_of(error)}.") from error
    if ending in _WITHOUT_UP_AXIS:
        return _UP[up]
    return _Y_UP if _is_y_up(path, ending) else np.eye(3)


def save_scene(path):
    """Evaluate and save the open scene, for `load_scene`."""
    bpy.context.view_layer.update()
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=False)


def load_scene(path):
    """Open a file of `save_scene` as an unsaved file. Raises `HairError`."""
    try:
        bpy.ops.wm.read_homefile(filepath=str(path), load_ui=False)
    except RuntimeError as error:
        raise HairError(f"{path} cannot be read: {cause_of(error)}.") from error


def _open_blend(path, runs_scripts):
    bpy.ops.wm.open_mainfile(filepath=str(path), use_scripts=runs_scripts)
    if bpy.data.version > bpy.app.version_file:
        newer, ours = (".".join(map(str, version[:2])) for version in (bpy.data.version, bpy.app.version_file))
        raise HairError(f"{path} was saved by Blender {newer}: Blender {ours} would lose data, use the newer one.")


def _is_y_up(path, ending):
    """Return whether Y points up: in glTF by specification, in Alembic by convention; USD and FBX store the axis."""
    if ending == ".fbx":
        return not path.stat().st_size or _is_y_up_in_fbx(path)
    if not ending.startswith(".usd"):
        return True
    bpy.utils.expose_bundled_modules()
    from pxr import Usd, UsdGeom

    return UsdGeom.GetStageUpAxis(Usd.Stage.Open(str(path), Usd.Stage.LoadNone)) == UsdGeom.Tokens.y


def _is_y_up_in_fbx(path):
    # Files of version 6 have the property after all objects.
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        stored = _FBX_UP.search(content)
        return stored is None or (stored[1] or stored[2])[:1] in (b"1", b"\x01")


def blocked_scripts():
    """Blender's message about scripts or drivers of the open .blend that did not run; empty if there are none."""
    return bpy.app.autoexec_fail_message if bpy.app.autoexec_fail else ""


def find_surface(name=""):
    """Return the mesh object with a name, or the only one of the view layer. Raises `HairError`."""
    meshes = [o for o in bpy.context.view_layer.objects if o.type == "MESH"]
    if name:
        meshes = [o for o in meshes if o.name == name]
        if not meshes:
            raise HairError(f'The file has no mesh object "{name}".')
    if not meshes:
        raise HairError("The file has no mesh to grow hair on.")
    if len(meshes) > 1:
        names = ", ".join(o.name for o in meshes[:5]) + ("…" if len(meshes) > 5 else "")
        raise HairError(f"The file has {len(meshes)} meshes ({names}): choose one with --surface.")
    return meshes[0]
