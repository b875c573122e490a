# SPDX-License-Identifier: GPL-3.0-or-later
"""The pipeline from files to files, for the command line: Blender without a window."""

import os
import tempfile
from pathlib import Path

import bpy
import imbuf
import numpy as np

from ..core import exr
from ..core.errors import HairError
from ..core.shading import dual_scattering, lookup_tables
from . import files, pipeline, scene, table_plots
from . import render as offscreen

_IMPORTERS = {
    # Axes as in the file: no turning from Y up to Z up on the way in.
    ".obj": lambda path: bpy.ops.wm.obj_import(filepath=path, forward_axis="Y", up_axis="Z"),
    ".ply": lambda path: bpy.ops.wm.ply_import(filepath=path, forward_axis="Y", up_axis="Z"),
    ".stl": lambda path: bpy.ops.wm.stl_import(filepath=path, forward_axis="Y", up_axis="Z"),
    ".glb": lambda path: bpy.ops.import_scene.gltf(filepath=path),
    ".gltf": lambda path: bpy.ops.import_scene.gltf(filepath=path),
}


def groom(path, surface_name, guide_settings, hair_settings, out):
    """Grow hair on the mesh of a file and write a .blend or an .npz of the arrays. Raises `HairError`."""
    if out.suffix not in (".blend", ".npz"):
        raise HairError(f"A groom is written as .blend or .npz, not as {out.suffix or 'a file without an ending'}.")
    open_file(path)
    surface_object = _surface(surface_name)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    guides = pipeline.distribute_guides(surface_object, guide_settings, depsgraph)
    hair = pipeline.interpolate_hair(guides, hair_settings, depsgraph)
    if out.suffix == ".blend":
        save_blend(out)
    else:
        surface = scene.read_surface(surface_object, depsgraph)
        arrays = {"guide_points": _points(guides, surface), "strand_points": _points(hair, surface)}
        _write_whole(out, lambda partial: np.savez(partial, roots=arrays["strand_points"][:, 0], **arrays))


def bake_tables(settings, folder, has_plots=False):
    """Bake the Marschner model's tables and dual scattering's into a folder; with plots: a picture of each beside it.

    Raises `HairError`.
    """
    tables = lookup_tables.bake(settings)
    dual = dual_scattering.bake(tables)
    exr.write_tables(folder, tables, files.addon_version())
    exr.write_dual_tables(folder, dual, files.addon_version())
    if has_plots:
        for name, picture in table_plots.plot_tables(tables, dual).items():
            _write_whole(
                folder / f"{name}.png", lambda partial, picture=picture: imbuf.write(picture, filepath=partial)
            )


def render(path, settings, out):
    """Draw a .blend file's hair from its camera into a picture file. Raises `HairError`."""
    open_file(path)
    pixels = offscreen.draw_picture(settings)
    offscreen.write_picture(pixels, out, bpy.context.scene)


def open_file(path):
    """Load a .blend, or a mesh file into an empty scene, with the add-on's settings registered."""
    if not path.is_file():
        raise HairError(f"{path} is not there: check the name.")
    if path.suffix != ".blend" and path.suffix not in _IMPORTERS:
        known = ", ".join([".blend", *_IMPORTERS])
        raise HairError(f"{path} is of a kind that Vellus does not read: it takes {known}.")
    from .. import blender

    if not hasattr(bpy.types.Curves, "vellus"):
        blender.register()
    try:
        if path.suffix == ".blend":
            bpy.ops.wm.open_mainfile(filepath=str(path), use_scripts=False)
        else:
            bpy.ops.wm.read_factory_settings(use_empty=True)
            _IMPORTERS[path.suffix](str(path))
    except RuntimeError as error:
        raise HairError(f"{path} cannot be read: {str(error).strip()}") from error


def save_blend(out):
    """Write the open file as a compressed .blend, whole or not at all."""
    _write_whole(out, lambda partial: bpy.ops.wm.save_as_mainfile(filepath=partial, compress=True, copy=True))


def _surface(name):
    meshes = [o for o in bpy.context.scene.objects if o.type == "MESH"]
    if name:
        meshes = [o for o in meshes if o.name == name]
        if not meshes:
            raise HairError(f'The file has no mesh object "{name}".')
    if not meshes:
        raise HairError("The file has no mesh to grow hair on.")
    if len(meshes) > 1:
        names = ", ".join(o.name for o in meshes[:5])
        raise HairError(f"The file has {len(meshes)} meshes ({names}…): name one with --surface.")
    return meshes[0]


def _points(datablock, surface):
    from . import curves

    count = len(datablock.curves)
    return surface.from_local(curves.read_points(datablock)).reshape(count, -1, 3)


def _write_whole(out, write):
    """Call write(path) on a path beside `out`, then move the file into place."""
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=out.parent, prefix=".vellus_") as folder:
            partial = Path(folder) / out.name
            write(str(partial))
            os.replace(partial, out)
    except (OSError, RuntimeError) as error:
        raise HairError(f"{out} cannot be written: {error}. Pick a folder that you may write to.") from error
