# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair that is on the GPU: kept by the datablock's session, dropped when it changed, made again when it is drawn.

Nothing here holds a reference to Blender's data, so undo, deletion and a new file cannot leave a dangling one.
"""

import sys
from pathlib import Path

import bpy
import numpy as np

from ..core import exr, strands, table_cache
from ..core.errors import HairError
from ..core.shading import appearance, lookup_tables
from . import curves, drawing, files, preferences, properties

_strands = {}  # session_uid → StrandsOnGPU, or None where the datablock cannot be drawn
_shading = {}  # settings → Shading

# Tables of this many settings are kept: one groom and the last few positions of a slider.
_SHADING_CAPACITY = 8


def hair_on_gpu(datablock):
    """(`StrandsOnGPU`, `Shading`) of a hair Curves datablock. Raises `HairError`."""
    strands_there = strands_on_gpu(datablock)
    return strands_there, strands_there and shading_of(datablock)


def strands_on_gpu(datablock):
    """`StrandsOnGPU` of any Curves datablock, uploaded if it changed since the last time."""
    uid = datablock.session_uid
    if uid not in _strands:
        _strands[uid] = drawing.upload_strands(*_read(datablock))
    return _strands[uid]


def guides_on_gpu(datablock):
    """(`StrandsOnGPU`, `Shading`) of a guide Curves datablock. Raises `HairError`."""
    return strands_on_gpu(datablock), _kept("guides", lambda _name: drawing.guide_shading())


def refuse(datablock, error):
    """Do not try again to draw a datablock until it changes; say why, once, where the user can read it."""
    _strands[datablock.session_uid] = None
    print(f"Vellus: {error}", file=sys.stderr)


def forget(session_uid):
    """Drop the strands of a datablock that changed."""
    _strands.pop(session_uid, None)


def clear():
    """Drop everything: after undo, with a new file, when the add-on is switched off."""
    _strands.clear()
    _shading.clear()


def _read(datablock):
    """(S, P, 3) points and (S, P) radii in local coordinates, whatever the curves' own point counts."""
    counts = curves.point_counts(datablock)
    if not len(counts):
        raise HairError(f'"{datablock.name}" has no strands to draw.')
    points, radii = curves.read_points(datablock), curves.read_radii(datablock)
    most = int(counts.max())
    if (counts == most).all():
        return points.reshape(-1, most, 3), radii.reshape(-1, most)
    starts = np.concatenate([[0], np.cumsum(counts)])
    mean_radii = np.add.reduceat(radii, starts[:-1]) / counts
    return strands.resample(points, starts, most), np.repeat(mean_radii[:, None], most, axis=1)


def shading_of(datablock):
    """`Shading` of a hair Curves datablock: its model, ready to draw. Raises `HairError`."""
    state = datablock.vellus
    if state.model == "KAJIYA_KAY":
        return _kept(properties.look_of(state), _kajiya_kay_shading)
    settings = properties.table_settings_of(state)
    return _kept(settings, lambda wanted: drawing.marschner_shading(_tables(wanted, state.table_folder)))


def _kajiya_kay_shading(look):
    return drawing.kajiya_kay_shading(appearance.kajiya_kay_settings(look))


def _kept(settings, make):
    """The shading of these settings, made if it is not there; the one that was used longest ago gives way."""
    shading = _shading.pop(settings, None) or make(settings)
    _shading[settings] = shading
    while len(_shading) > _SHADING_CAPACITY:
        del _shading[next(iter(_shading))]
    return shading


def _tables(settings, folder):
    """The tables of these settings: from the folder while it holds just those, else from the cache, or baked now."""
    if folder:
        path = Path(bpy.path.abspath(folder))
        if path.is_dir():
            tables = exr.read_tables(path)
            if tables.settings == settings:
                return tables
    cache = cache_folder()
    if cache is None:
        return lookup_tables.bake(settings)
    return table_cache.tables(cache, settings, files.addon_version())


def cache_folder():
    """The folder of tables that were baked before, for every file of this user; None where we are no extension."""
    if not preferences.ADDON_MODULE.startswith("bl_ext."):
        return None  # run from a checkout
    # Empty where Blender could not make it, of which it has told the console.
    folder = bpy.utils.extension_path_user(preferences.ADDON_MODULE, path="tables", create=True)
    return Path(folder) if folder else None
