# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair that is on the GPU: kept by the datablock's session, dropped when it changed, made again when it is drawn.

Nothing here holds a reference to Blender's data, so undo, deletion and a new file cannot leave a dangling one.
"""

import sys
from concurrent.futures import wait
from pathlib import Path

import bpy
import numpy as np

from ..core import exr, strands, table_cache
from ..core.errors import HairError
from ..core.shading import appearance, lookup_tables, strand_tables
from . import bindings, curves, files, hair_shading, preferences, properties, scene, strand_textures

_strands = {}  # session_uid → StrandsOnGPU, or None where the datablock cannot be drawn
_at_rest = {}  # session_uid → (points, radii, random numbers) before their surface carried them
_roots = {}  # session_uid → (surface's session_uid, topology, vertices, barycentric) by which it was carried last
_moved = {}  # session_uid → [(M,) indices of strands] that moved since then
_surfaces = {}  # session_uid of a mesh object → (Surface, SurfaceMotion or None)
_shading = {}  # settings → Shading

# Tables of this many settings are kept: one groom and the last few positions of a slider.
_SHADING_CAPACITY = 8


def hair_on_gpu(datablock):
    """(`StrandsOnGPU`, `Shading`) of a hair Curves datablock. Raises `HairError`."""
    strands_there = strands_on_gpu(datablock)
    return strands_there, strands_there and shading_of(datablock)


def strands_on_gpu(datablock):
    """`StrandsOnGPU` of any Curves datablock, where its surface carries them; uploaded as far as they have changed."""
    uid, bound = datablock.session_uid, bindings.of(datablock)
    if bound is not None:
        wait([bound.growing])  # in the memory of the points that are known here
    moved = _moved.pop(uid, None)
    if uid not in _strands:
        if uid not in _at_rest:
            _at_rest[uid] = _read(datablock)
        points, radii, randoms = _at_rest[uid]
        _strands[uid] = strand_textures.upload_strands(_carried(datablock, points), radii, randoms)
    elif moved and _strands[uid] is not None:
        chosen = np.unique(np.concatenate(moved))
        strand_textures.move_strands(_strands[uid], chosen, _carried(datablock, _at_rest[uid][0][chosen], chosen))
    return _strands[uid]


def _carried(datablock, points, chosen=slice(None)):
    """Points (M, P, 3) of some strands where the surface is now; the points themselves where it rests."""
    surface_object = datablock.surface
    if surface_object is None or surface_object.type != "MESH":
        return points
    uid = surface_object.session_uid
    if uid not in _surfaces:
        _surfaces[uid] = _read_motion(surface_object)
    surface, motion = _surfaces[uid]
    if motion is None:
        _roots[datablock.session_uid] = uid, datablock.vellus.topology, None, None
        return points
    from ..core import surface_frames  # Warp takes longer to import than the add-on may take to start

    vertices, barycentric = curves.root_places(datablock, surface)
    _roots[datablock.session_uid] = uid, datablock.vellus.topology, vertices, barycentric
    return surface_frames.carry(points, motion, vertices[chosen], barycentric[chosen])


def _read_motion(surface_object):
    """(`Surface`, `SurfaceMotion` away from where it rests, or None)."""
    surface = scene.read_surface(surface_object, bpy.context.evaluated_depsgraph_get())
    if not surface.is_deformed:
        return surface, None
    from ..core import surface_frames

    return surface, surface_frames.motion(surface.rest, surface.posed, surface.faces)


def refuse(datablock, error):
    """Do not try again to draw a datablock until it changes; say why, once, where the user can read it."""
    _strands[datablock.session_uid] = None
    print(f"Vellus: {error}", file=sys.stderr)


def forget(session_uid):
    """Drop the strands of a datablock that changed."""
    for cache in (_strands, _at_rest, _roots, _moved):
        cache.pop(session_uid, None)


def move(session_uid, moved):
    """Some strands of bound hair have moved, (M,) indices: with the next redraw they alone are uploaded."""
    if session_uid in _strands:
        _moved.setdefault(session_uid, []).append(moved)


def forget_pose(surface_object):
    """A surface may have carried its strands to another place."""
    _surfaces.pop(surface_object.session_uid, None)
    for datablock in bpy.data.hair_curves:
        if datablock.surface == surface_object and _strands.get(datablock.session_uid) is not None:
            del _strands[datablock.session_uid]


def forget_unless_same(datablock):
    """Drop what is known of a datablock that Blender reports as changed, if it was.

    Blender reports Curves whose surface moved, or that have another property. What waits to be written is no change,
    nor is what we have just written.
    """
    uid, bound = datablock.session_uid, bindings.of(datablock)
    if bound is not None:
        if not bound.is_report_due:
            bound.written_radii = None
        if not bound.is_written:
            return
        if bound.is_report_due:
            if uid not in _at_rest or _at_rest[uid][0] is not bound.points:
                forget(uid)
            return
        if not _are_points(datablock, bound.points):
            bindings.forget(datablock)
            forget(uid)
            return
    if uid in _at_rest:
        points, radii, randoms = _at_rest[uid]
        is_known = points is bound.points if bound is not None else _are_points(datablock, points)
        is_known = is_known and np.array_equal(radii.ravel(), curves.read_radii(datablock))
        is_known = is_known and np.array_equal(randoms, curves.read_randoms(datablock))
        if not is_known or not _is_rooted_as_before(datablock):
            forget(uid)
    else:
        forget(uid)


def _is_rooted_as_before(datablock):
    """Whether its surface would carry it as it was carried last: guides may be told where they are by hair."""
    if datablock.session_uid not in _roots:
        return True  # it was not carried
    surface_uid, topology, vertices, barycentric = _roots[datablock.session_uid]
    surface = datablock.surface
    if surface is None or (surface_uid, topology) != (surface.session_uid, datablock.vellus.topology):
        return False
    now = curves.read_root_places(datablock)
    return vertices is None or now is None or all(map(np.array_equal, (vertices, barycentric), now))


def _are_points(datablock, points):
    return np.array_equal(points.reshape(-1, 3), curves.read_points(datablock))


def clear():
    """Drop everything: after undo, with a new file, when the add-on is switched off."""
    for cache in (_strands, _at_rest, _roots, _moved, _surfaces, _shading):
        cache.clear()


def _read(datablock):
    """(S, P, 3) points at rest, (S, P) radii, in local coordinates, whatever the curves' point counts; (S,) numbers."""
    bound = bindings.of(datablock)
    if bound is not None:
        if bound.is_written or bound.has_moved_only:
            randoms = curves.read_randoms(datablock)
        else:
            _identities, randoms = bound.identities
        return bound.points, np.tile(bound.radii, (len(bound.points), 1)), randoms
    return read_strands(datablock)


def read_strands(datablock):
    """The same of any Curves as they are stored or evaluated. Raises `HairError`."""
    counts = curves.point_counts(datablock)
    if not len(counts):
        raise HairError(f'"{datablock.name}" has no strands to draw.')
    points, radii, randoms = (read(datablock) for read in (curves.read_points, curves.read_radii, curves.read_randoms))
    most = int(counts.max())
    if (counts == most).all():
        return points.reshape(-1, most, 3), radii.reshape(-1, most), randoms
    starts = np.concatenate([[0], np.cumsum(counts)])
    mean_radii = np.add.reduceat(radii, starts[:-1]) / counts
    return strands.resample(points, starts, most), np.repeat(mean_radii[:, None], most, axis=1), randoms


def shading_of(datablock):
    """`Shading` of a hair Curves datablock: its model, ready to draw. Raises `HairError`."""
    state = datablock.vellus
    look = properties.look_of(state)
    variation = appearance.strand_settings(look)
    if state.model == "KAJIYA_KAY":
        if variation.is_even:
            return _kept((appearance.kajiya_kay_settings(look),), hair_shading.kajiya_kay_shading)
        return _kept((appearance.kajiya_kay_strand_settings(look), variation), hair_shading.kajiya_kay_strand_shading)
    settings = properties.table_settings_of(state)
    if variation.is_even and not settings.is_elliptic:
        return _kept((settings,), lambda wanted: hair_shading.marschner_shading(_tables(wanted, state.table_folder)))
    return _kept((settings, variation), _strand_shading)


def _strand_shading(settings, variation):
    return hair_shading.marschner_strand_shading(strand_tables.bake(settings, variation, preferences.device()))


def _kept(settings, make):
    """The shading of these settings, made if it is not there; the one that was used longest ago gives way."""
    shading = _shading.pop(settings, None) or make(*settings)
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
        return lookup_tables.bake(settings, preferences.device())
    return table_cache.tables(cache, settings, files.addon_version(), device=preferences.device())


def cache_folder():
    """The folder of tables that were baked before, for every file of this user; None where we are no extension."""
    if not preferences.is_extension():
        return None  # run from a checkout
    # Empty where Blender could not make it, of which it has told the console.
    folder = bpy.utils.extension_path_user(preferences.ADDON_MODULE, path="tables", create=True)
    return Path(folder) if folder else None
