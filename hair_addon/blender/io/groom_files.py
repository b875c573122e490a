# SPDX-License-Identifier: GPL-3.0-or-later
"""Grooms → files: a .blend, arrays, USD, Alembic."""

import contextlib

import bpy
import numpy as np

from ...core.errors import HairError
from ...core.files.atomic_file import atomic_file, require_room, require_writable_path
from ...core.geometry.strands import curve_offsets
from ..data import scene
from ..data.strands import attributes, exported_curves
from ..groom.selection import object_of
from ..host import paths, scene_time
from . import mesh_files, strand_arrays
from .chosen_objects import only_chosen

_USD = (".usd", ".usdc", ".usda", ".usdz")
ENDINGS = (".blend", ".npz", *_USD, ".abc")

_KIND = "groom_guide"  # [UnrealGroom26]: 1 of guides, 0 of strands

_OPERATORS = {".abc": "wm.alembic_export"} | dict.fromkeys(_USD, "wm.usd_export")

# Bytes of an Alembic file per vertex, face corner and strand point, with a margin.
_VERTEX_BYTES, _CORNER_BYTES, _POINT_BYTES = 16, 48, 24


def require_writable(path):
    """Raise `HairError` unless `write` can write a groom to the path."""
    ending = path.suffix.lower()
    if ending not in ENDINGS:
        raise HairError(f"Grooms are saved as {', '.join(ENDINGS)}, not as {ending or 'a file without an extension'}.")
    if ending in _OPERATORS and not paths.has_operator(_OPERATORS[ending]):
        raise HairError(f"{path} cannot be written: this build of Blender lacks its exporter, {_OPERATORS[ending]}.")
    require_writable_path(path)


def write(path, guides, hair, file_axes):
    """Write guide and hair Curves: a .blend has all of the open file, other formats the Curves and their surface.

    file_axes: (3, 3), Blender's axes → those of arrays in an .npz. The file is written atomically. Raises `HairError`.
    """
    ending = path.suffix.lower()
    if ending == ".blend":
        save_copy(path)
        return
    with atomic_file(path) as partial:
        if ending == ".npz":
            np.savez(partial, **arrays(guides, hair, file_axes))
        else:
            with only_chosen(_objects(guides, hair)), _kinds_marked(guides, hair):
                _export(partial.absolute(), ending, guides, hair)


def save_copy(path):
    """Save a copy of the open file, atomically. Raises `HairError`."""
    with atomic_file(path) as partial:
        bpy.ops.wm.save_as_mainfile(filepath=str(partial), compress=True, copy=True)


def arrays(guides, hair, file_axes):
    """Return {name: array} in the format of `array_grooms`; file_axes: as in `write`."""
    made = {}
    for name, curves in (("guide", guides), ("strand", hair)):
        counts = strand_arrays.counts_of(curves)
        points = strand_arrays.world_rows(curves)(slice(0, len(counts))) @ file_axes.T.astype(np.float32)
        widths = exported_curves.radii_per_curve(curves) * np.float32(2.0 * strand_arrays.world_scale(curves))
        roots = points[curve_offsets(counts)[:-1]]
        if (counts == counts[0]).all():
            points, widths = points.reshape(len(counts), -1, 3), widths.reshape(len(counts), -1)
        else:
            made[f"{name}_counts"] = counts
        made[f"{name}_points"], made[f"{name}_widths"] = np.ascontiguousarray(points), widths
    axis = mesh_files.axis_of(file_axes)
    return {"roots": roots, **made, "up": np.array(axis)}


def _objects(guides, hair):
    """Return the objects of guides, hair and their surface."""
    layer = bpy.context.view_layer
    layer.update()
    found = (object_of(guides, layer), object_of(hair, layer), guides.surface)
    return [one for one in found if one is not None]


@contextlib.contextmanager
def _kinds_marked(guides, hair):
    """Mark guides and strands for Blender's exporters: USD writes attributes of curves, Alembic object properties."""
    kinds = [(guides, True), (hair, False)]
    objects = [(object_of(datablock, bpy.context.view_layer), is_guide) for datablock, is_guide in kinds]
    objects = [(one, is_guide) for one, is_guide in objects if one is not None and _KIND not in one]
    for datablock, is_guide in kinds:
        attributes.write(datablock, _KIND, "INT", "CURVE", np.full(len(datablock.curves), is_guide, np.int32))
    for one, is_guide in objects:
        one[_KIND] = int(is_guide)
    try:
        yield
    finally:
        for one, _is_guide in objects:
            del one[_KIND]
        for datablock, _is_guide in kinds:
            datablock.attributes.remove(datablock.attributes[_KIND])


def _export(partial, ending, guides, hair):
    scale = strand_arrays.meters_per_unit(bpy.context.scene)
    if ending == ".abc":
        # The exporter crashes on a full disk: reserve space for the file first.
        require_room(partial, _alembic_bytes(guides, hair))
        frame = scene_time.present_frame()
        bpy.ops.wm.alembic_export(
            filepath=str(partial), selected=True, start=frame, end=frame, global_scale=scale, as_background_job=False
        )
    else:
        bpy.ops.wm.usd_export(
            filepath=str(partial), selected_objects_only=True, export_hair=True, export_textures_mode="KEEP"
        )
        if scale != 1.0:
            _set_unit(partial, scale)


def _set_unit(path, scale):
    """Set metersPerUnit of a USD file: Blender always writes one meter."""
    if path.suffix.lower() == ".usdz":
        raise HairError("Blender cannot store this scene's unit in a .usdz file: write a .usdc file.")
    bpy.utils.expose_bundled_modules()
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, scale)
    stage.Save()


def _alembic_bytes(guides, hair):
    mesh = guides.surface.evaluated_get(scene.present_depsgraph()).data
    strands = sum(len(curves.points) * _POINT_BYTES for curves in (guides, hair))
    return 100_000 + len(mesh.vertices) * _VERTEX_BYTES + len(mesh.loops) * _CORNER_BYTES + strands
