# SPDX-License-Identifier: GPL-3.0-or-later
"""Import of curves: .blend, USD, Alembic, and .npz arrays of grooms."""

import zipfile
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np

from ...core.errors import HairError, cause_of
from ..data.strands import attributes
from ..host import paths
from . import mesh_checks, strand_arrays

_ARRAY = "guide_points"


def _read_blend(path, name, _file_axes):
    with bpy.data.libraries.load(str(path)) as (there, wanted):
        wanted.objects = [name] if name and name in there.objects else there.objects
    for read in wanted.objects:
        if read is not None:
            bpy.context.scene.collection.objects.link(read)


def _read_usd(path, _name, _file_axes):
    # The open scene must not change: no frame range, no world.
    bpy.ops.wm.usd_import(
        filepath=str(path),
        import_meshes=False,
        import_cameras=False,
        import_lights=False,
        import_materials=False,
        import_volumes=False,
        create_world_material=False,
        set_frame_range=False,
    )


def _read_alembic(path, _name, _file_axes):
    mesh_checks.require_alembic(path)
    bpy.ops.wm.alembic_import(filepath=str(path), set_frame_range=False, as_background_job=False)


def _read_arrays(path, _name, file_axes):
    with open(path, "rb") as file, np.load(file) as arrays:
        if _ARRAY not in arrays:
            raise HairError(f"{path} has no curves: an .npz file needs an array {_ARRAY} (G, P, 3).")
        points = arrays[_ARRAY]
    if (
        points.ndim != 3
        or points.shape[2] != 3
        or points.shape[0] < 1
        or points.shape[1] < 2
        or points.dtype.kind != "f"
    ):
        raise HairError(f"{path}: {_ARRAY} has shape {points.shape}, but must be (G, P, 3), P at least 2.")
    points = points @ file_axes / strand_arrays.metres_per_unit(bpy.context.scene)
    datablock = bpy.data.hair_curves.new(path.stem)
    datablock.add_curves([points.shape[1]] * points.shape[0])
    datablock.set_types(type="POLY")
    attributes.write(datablock, "position", "FLOAT_VECTOR", "POINT", points)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new(path.stem, datablock))


_USD = (".usd", ".usdc", ".usda", ".usdz")

# Ending → (function that adds what a file holds to the scene, operator that it needs).
_FORMATS = {
    ".blend": (_read_blend, None),
    **dict.fromkeys(_USD, (_read_usd, "wm.usd_import")),
    ".abc": (_read_alembic, "wm.alembic_import"),
    ".npz": (_read_arrays, None),
}


def require_readable(path):
    """Raise `HairError` unless there is a file of a kind that holds curves."""
    path = Path(path)
    if not path.is_file():
        raise HairError(f"{path} is not a file: check the path.")
    ending = path.suffix.lower()
    if ending not in _FORMATS:
        raise HairError(f"{path} has a format that guides cannot be read from: use {', '.join(_FORMATS)}.")
    operator = _FORMATS[ending][1]
    if operator is not None and not paths.has_operator(operator):
        raise HairError(f"{path} cannot be read: this build of Blender lacks its importer, {operator}.")


@contextmanager
def curves_of(path, name, file_axes, is_open=False):
    """The object of curves in a file, or the one of a name, added to the open scene; all else that came goes again.

    file_axes: (3, 3), Blender's axes → those of arrays; is_open: whether the file is what is open. Raises `HairError`.
    """
    path = Path(path)
    require_readable(path)
    before = set(bpy.data.objects)
    if not is_open:
        try:
            _FORMATS[path.suffix.lower()][0](path, name, file_axes)
        except (OSError, RuntimeError, ValueError, EOFError, KeyError, zipfile.BadZipFile) as error:
            raise HairError(f"{path} cannot be read: {cause_of(error)}.") from error
        bpy.context.view_layer.update()
    came = set(bpy.data.objects) - (set() if is_open else before)
    chosen = _choose(
        path, [o for o in came if o.type in {"CURVES", "CURVE"} and o.name in bpy.context.view_layer.objects], name
    )
    yield chosen
    for other in came - {chosen} if not is_open else ():
        bpy.data.objects.remove(other)
    bpy.context.view_layer.update()


def _choose(path, found, name):
    found = sorted(found, key=lambda o: o.name)
    if name:
        chosen = [o for o in found if o.name == name]
        if not chosen:
            raise HairError(f'{path} has no curves object "{name}".')
        return chosen[0]
    ours = [o for o in found if o.type == "CURVES" and o.data.vellus.kind == "GUIDES"]
    found = ours if len(ours) == 1 else found
    if not found:
        raise HairError(f"{path} has no curves to use as guides.")
    if len(found) > 1:
        names = ", ".join(o.name for o in found[:5]) + ("…" if len(found) > 5 else "")
        raise HairError(f"{path} has {len(found)} curves objects ({names}): choose one with --guides-object.")
    return found[0]
