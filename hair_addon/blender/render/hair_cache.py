# SPDX-License-Identifier: GPL-3.0-or-later
"""Cache of hair on the GPU, by session UID: invalidated by changes, filled on drawing.

It holds no reference to Blender's data, so undo, deletion and new files cannot leave dangling ones. Points, radii,
random numbers, wetness and roots are read and replaced together.
"""

from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from pathlib import Path

import bpy
import numpy as np

from ...core.errors import HairError, memory_as_sentence
from ...core.files import table_cache, table_exr
from ...core.kernels.checks import require_count, require_indices
from ...core.shading import appearance
from ...core.shading.tables import lookup_tables, strand_tables
from ..data.strands import curves, posed_strands, simulated_guides, stored_roots
from ..gpu import hair_shading, strand_textures
from ..groom import bindings
from ..host import notices, paths
from ..host.caches import Cache
from ..settings import preferences, properties, shared_wetness
from . import made_strands, read_strands, refused_strands
from .refused_strands import Refused

# Tables of this many settings are kept: one groom and the last few positions of a slider.
_SHADING_CAPACITY = 8


@dataclass
class _KeptStrands:
    """A snapshot of a datablock's strands, at rest, and their GPU data."""

    points: np.ndarray  # (S, P, 3) float32 in local coordinates
    radii: np.ndarray  # (S, P) float32
    randoms: np.ndarray  # (S,) float32
    wetness: np.ndarray | None  # (S,) float32, None where strands do not differ
    places: tuple | None  # roots as `stored_roots.places` returns them, None for none
    rooted_on: tuple  # (session_uid of the surface, its topology)
    may_float: bool  # whether strands may begin apart from it
    note: HairError | None = None  # what is left out of the strands of the datablock
    growing: Future | None = None  # of these points, which other threads may be computing; None where they are read
    on_gpu: strand_textures.StrandsOnGPU | None = None  # where `pose` carried them
    pose: posed_strands.Pose | None = None  # None where no surface carries them
    moved: list = field(default_factory=list)  # [(M,) indices of strands] that moved since then
    making: made_strands.Making = field(default_factory=made_strands.Making)

    def __post_init__(self):
        require_count("radii", len(self.radii), len(self.points))
        require_count("random numbers", len(self.randoms), len(self.points))
        if self.wetness is not None:
            require_count("wetness", len(self.wetness), len(self.points))


strand_cache = Cache()  # session_uid of Curves → _KeptStrands or Refused
pose_cache = Cache()  # session_uid of an object that strands grow on → Pose
shading_cache = Cache(_SHADING_CAPACITY)  # settings → Shading


@memory_as_sentence()
def hair_on_gpu(datablock, is_viewport=True):
    """(`StrandsOnGPU`, `Shading`) of a hair Curves datablock. Raises `HairError`.

    is_viewport: whether hair may be shown without its styles while it is combed.
    """
    bound = bindings.of(datablock)
    if is_viewport or bound is None or bound.straight is None:
        strands_there = strands_on_gpu(datablock)
    else:
        strands_there = _upload_styled(datablock, bound)
    return strands_there, strands_there and shading_of(datablock, strands_there)


def _upload_styled(datablock, bound):
    """`StrandsOnGPU` of bound hair with its styles, kept nowhere."""
    bound.catch_up()
    styled = _read(datablock, bound, bound)
    return strand_textures.upload_strands(
        _carried(styled, _pose_of(datablock.surface)), styled.radii, styled.randoms, styled.wetness
    )


def strands_on_gpu(datablock):
    """`StrandsOnGPU` of any Curves datablock, where its surface carries them; uploaded as far as they have changed.

    None where the datablock was refused. Raises `HairError`.
    """
    kept = strand_cache.get(datablock.session_uid)
    if isinstance(kept, Refused):
        return None
    if kept is None or (kept.growing is not None and kept.growing.result() is not kept.points):
        kept = strand_cache.keep(datablock.session_uid, _read_shown(datablock))
    pose = _pose_of(datablock.surface)
    is_elsewhere = kept.on_gpu is None or kept.pose is not pose
    is_due = kept.making.due is not None
    if is_due or is_elsewhere:
        is_behind = _is_behind(datablock)
        if kept.on_gpu is not None and kept.making.bring(kept, pose, is_behind):
            return kept.on_gpu
        if is_due or is_behind:
            kept = strand_cache.keep(datablock.session_uid, _read_shown(datablock))
    moved, kept.moved = kept.moved, []
    if moved or is_elsewhere:
        kept.making.carrier = None  # what it carries is not what is uploaded
    if kept.on_gpu is None or is_elsewhere or (moved and not kept.on_gpu.has_points):
        points = _carried(kept, pose)
        kept.on_gpu = strand_textures.upload_strands(points, kept.radii, kept.randoms, kept.wetness)
        kept.pose = pose
    elif moved:
        chosen = np.unique(np.concatenate(moved))
        require_indices("strands", chosen, len(kept.points))
        kept.on_gpu = strand_textures.move_strands(kept.on_gpu, chosen, _carried(kept, pose, chosen))
    elif not kept.on_gpu.has_points and kept.making.carrier is None and not _is_behind(datablock):
        kept.on_gpu = replace(kept.on_gpu, points=kept.points, has_points=True)  # which have followed meanwhile
    return kept.on_gpu


def _is_behind(datablock):
    """Whether what is shown was made on the GPU alone."""
    bound = bindings.of(datablock)
    return bound is not None and bound.shown.is_behind


def _carried(kept, pose, chosen=slice(None)):
    """Points (M, P, 3) of some kept strands where a pose carries them; at rest where nothing deforms the surface."""
    if pose is None or not pose.is_deformed:
        return kept.points[chosen]
    return pose.carry(kept.points, kept.rooted_on[1], kept.places, chosen, kept.may_float)


def _pose_of(surface_object):
    """The `Pose` of what strands grow on, None where that is nothing. Raises `HairError`."""
    if surface_object is None:
        return None
    depsgraph = bpy.context.evaluated_depsgraph_get
    return pose_cache.get(surface_object.session_uid, lambda: posed_strands.read_pose(surface_object, depsgraph()))


def drawn_bytes(datablock):
    """Memory that viewports use on the GPU for a hair Curves datablock [bytes]; None while nothing draws it."""
    kept = _strands_of(datablock.session_uid)
    if kept is None or kept.on_gpu is None:
        return None
    textures = [*kept.on_gpu.textures, *kept.making.textures]
    return strand_textures.bytes_of(textures) + strand_textures.seen_bytes(kept.on_gpu)


def note_of(datablock):
    """What viewports draw of a Curves datablock in part or not at all, as a `HairError`; None where it is all drawn."""
    kept = strand_cache.get(datablock.session_uid)
    return refused_strands.error_of(kept) or getattr(kept, "note", None)


def refuse(datablock, error):
    """Do not draw a datablock again until it changes; report the reason once."""
    strand_cache.keep(datablock.session_uid, refused_strands.refused(error))


def move(session_uid, moved, bound):
    """Strands of `BoundHair` have moved: with the next redraw they alone are uploaded, which waits for their points.

    moved: (M,) indices of them.
    """
    kept = _strands_of(session_uid)
    if kept is not None:
        kept.growing = bound.growing
        kept.moved.append(moved)


def follow_where_drawn(session_uid, bound):
    """Guides of `BoundHair` have moved, or their weights: with the next redraw the GPU makes all strands."""
    kept = _strands_of(session_uid)
    if kept is not None:
        kept.making.due = bound


def may_make(session_uid):
    """Whether the GPU makes what viewports show of hair while its guides are combed: as `choose_makers` found."""
    kept = _strands_of(session_uid)
    return kept is not None and kept.making.is_chosen and not kept.moved


def may_restyle(session_uid, bound, styles):
    """Whether the GPU makes what viewports show of bound hair with other styles."""
    kept = _strands_of(session_uid)
    if not may_make(session_uid) or bound.straight is not None:
        return False
    return kept.making.can_style(styles) and kept.making.is_prepared(bound, styles)


def prepare_makers():
    """Compile one of the programs that edits of what viewports draw need; whether there was one left."""
    for datablock in bpy.data.hair_curves:
        kept, bound = _strands_of(datablock.session_uid), bindings.of(datablock)
        if kept is not None and bound is not None and kept.making.prepare(bound.shown):
            return True
    return False


def choose_makers():
    """Find out which of the hair that a viewport draws the GPU may make, and is to."""
    is_wanted = made_strands.are_wanted()
    for datablock in bpy.data.hair_curves:
        kept, bound = _strands_of(datablock.session_uid), bindings.of(datablock)
        if kept is not None and kept.on_gpu is not None:
            is_bound = bound is not None and bound.free is None and kept.points is bound.shown.points
            kept.making.choose(is_wanted, bound.shown if is_bound else None)


def _strands_of(session_uid):
    """The `_KeptStrands` of a datablock, None where there are none or they were refused."""
    kept = strand_cache.get(session_uid)
    return None if isinstance(kept, Refused) else kept


def is_pose_seen(surface_object):
    """Whether a viewport has drawn strands on a surface since that moved."""
    return pose_cache.get(surface_object.session_uid) is not None


def invalidate_pose(surface_object):
    """A surface may carry its strands to another place: with the next redraw they are uploaded there."""
    pose_cache.invalidate(surface_object.session_uid)
    for datablock in bpy.data.hair_curves:
        # A surface that could not be read may have been repaired.
        if datablock.surface == surface_object and isinstance(strand_cache.get(datablock.session_uid), Refused):
            strand_cache.invalidate(datablock.session_uid)


def invalidate_unless_same(datablock):
    """Drop the cache of a datablock that Blender reports as changed, if it did change.

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
            kept = _strands_of(uid)
            if kept is None or kept.points is not bound.shown.points:
                strand_cache.invalidate(uid)
            return
        if not _are_points(datablock, bound.points):
            bindings.invalidate(datablock)
            strand_cache.invalidate(uid)
            return
    kept = _strands_of(uid)
    if kept is None or not _is_same(datablock, kept, bound):
        strand_cache.invalidate(uid)


def _is_same(datablock, kept, bound):
    """Whether kept strands are those of a datablock, and its surface would carry them as it did."""
    return (
        (kept.points is bound.shown.points if bound is not None else _are_points(datablock, kept.points))
        and np.array_equal(kept.radii.ravel(), curves.read_radii(datablock))
        and np.array_equal(kept.randoms, curves.read_randoms(datablock))
        and made_strands.are_equal(kept.wetness, curves.read_wetness(datablock))
        and kept.rooted_on == _rooted_on(datablock, datablock.vellus.topology)
        and (bound is not None or _are_places(kept.places, stored_roots.slid_places(datablock)))
    )


def _rooted_on(datablock, topology):
    return datablock.surface and datablock.surface.session_uid, topology


def _are_places(places, others):
    """Whether roots are unchanged: hair may update the roots of guides."""
    if places is None or others is None:
        return places is others
    return all(map(np.array_equal, places, others))


def _are_points(datablock, points):
    return np.array_equal(points.reshape(-1, 3), curves.read_points(datablock))


def _read_shown(datablock):
    bound = bindings.of(datablock)
    if bound is not None:
        bound.shown.catch_up()
    return _read(datablock, bound, bound and bound.shown)


def _read(datablock, bound, shown):
    """`_KeptStrands` of a datablock as it is now, or of what it is bound by.

    shown: the `BoundHair` whose points are read, which may be without the styles of `bound`.
    """
    if bound is None:
        read = _shown_strands(datablock)
        places = None if datablock.surface is None else stored_roots.slid_places(datablock)
        if places is not None and read.is_sound is not None:
            places = tuple(values[read.is_sound] for values in places)
        rooted = places, _rooted_on(datablock, datablock.vellus.topology), stored_roots.may_float(datablock)
        return _KeptStrands(*read.arrays, *rooted, read.note)
    if bound.is_written or bound.has_moved_only:
        randoms, wetness = curves.read_randoms(datablock), curves.read_wetness(datablock)
    else:
        (_identities, randoms), wetness = bound.binding.identities, bound.styles.wetness
    # Roots too are those of the binding: the datablock may store those of earlier strands.
    places, rooted_on = bound.surface.places(bound.binding.roots), _rooted_on(datablock, bound.surface.topology)
    radii = np.tile(bound.radii, (len(shown.points), 1))
    return _KeptStrands(shown.points, radii, randoms, wetness, places, rooted_on, False, growing=shown.growing)


def _shown_strands(datablock):
    """`ReadStrands` of a datablock, where dynamics has moved them if they are guides that it moves."""
    read = read_strands.read(datablock)
    simulated = simulated_guides.point_cache.get(datablock.session_uid)
    if simulated is None or len(simulated) != len(read.points):
        return read
    even = np.repeat(read.radii.mean(axis=1, keepdims=True), simulated.shape[1], axis=1)
    return replace(read, points=simulated, radii=even)


def shading_of(datablock, strands=None):
    """`Shading` of a hair Curves datablock: its model, ready to draw. Raises `HairError`.

    strands: its `StrandsOnGPU`; where these differ in wetness, a `MixedShading`.
    """
    state = datablock.vellus
    wettest = _shading_of_look(state, properties.look_of(state))
    least, most = shared_wetness.of_hair(state)
    if strands is None or strands.wetness is None or least == most:
        return wettest
    driest = _shading_of_look(state, properties.dry_look_of(state))
    return hair_shading.mixed(driest, wettest, strands.wetness_here, (least, most))


def _shading_of_look(state, look):
    variation = appearance.strand_settings(look)
    if state.model == "KAJIYA_KAY":
        if variation.is_even:
            return _kept_shading((appearance.kajiya_kay_settings(look),), hair_shading.kajiya_kay_shading)
        return _kept_shading(
            (appearance.kajiya_kay_strand_settings(look), variation), hair_shading.kajiya_kay_strand_shading
        )
    settings = properties.table_settings_of(state, look)
    if variation.is_even and not settings.is_elliptic:
        return _kept_shading(
            (settings,), lambda wanted: hair_shading.marschner_shading(_tables(wanted, state.table_folder))
        )
    return _kept_shading((settings, variation), _strand_shading)


def _strand_shading(settings, variation):
    return hair_shading.marschner_strand_shading(strand_tables.bake(settings, variation, preferences.device()))


def _kept_shading(settings, make):
    return shading_cache.get(settings, lambda: make(*settings))


def _tables(settings, folder):
    """The tables of these settings: from the folder while it holds just those, else from the cache, or baked now."""
    path = _usable(folder) if folder else None
    if path is not None and path.is_dir():
        tables = table_exr.read_tables(path)
        if tables.settings == settings:
            return tables
    cache = cache_folder()
    if cache is None:
        return lookup_tables.bake(settings, preferences.device())
    return table_cache.tables(cache, settings, paths.addon_version(), device=preferences.device())


def _usable(folder):
    """A folder that a file names, as a `Path`; None where nothing is read from: that is said, and tables are baked."""
    try:
        return paths.resolve(folder)
    except HairError as error:
        notices.say(str(error))
        return None


def cache_folder():
    """The folder of tables that were baked before, for every file of this user; None where we are no extension."""
    if not preferences.is_extension():
        return None  # run from a checkout
    # Empty if Blender could not create it, with a message on the console.
    folder = bpy.utils.extension_path_user(preferences.ADDON_MODULE, path="tables", create=True)
    return Path(folder) if folder else None
