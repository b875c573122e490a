# SPDX-License-Identifier: GPL-3.0-or-later
"""Cache of hair on the GPU, by session UID: invalidated by changes, filled on drawing.

It holds no references to Blender's data, which undo, deletion or new files could invalidate. Points, radii, random
numbers, wetness and roots are read and replaced together.
"""

from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from pathlib import Path

import bpy
import numpy as np

from ...core.errors import HairError, memory_as_sentence
from ...core.files import table_cache, table_exr
from ...core.kernels.checks import require_count, require_indices
from ...core.shading import appearance, strand_looks
from ...core.shading.strand_looks import StrandLooks
from ...core.shading.tables import look_tables, lookup_tables, radial_tables, strand_tables
from ..data.maps import strand_maps
from ..data.strands import attributes, curves, posed_strands, simulated_guides, stored_roots
from ..gpu import hair_shading, strand_textures
from ..groom import bindings, strand_thickness
from ..host import notices, paths
from ..host.caches import Cache
from ..settings import preferences, properties, shared_wetness
from . import gpu_strands, late_layers, read_strands, refused_strands
from .refused_strands import Refused

# Number of cached tables: those of one groom, and of the last few positions of a slider.
_SHADING_CAPACITY = 8


@dataclass
class _CachedStrands:
    """A snapshot of a datablock's strands at rest, and their GPU data."""

    points: np.ndarray  # (S, P, 3) float32 in local coordinates
    radii: np.ndarray  # (S, P) float32
    randoms: np.ndarray  # (S,) float32
    wetness: np.ndarray | None  # (S,) float32, None if strands do not differ
    looks: StrandLooks | None  # (S,), None without maps
    places: tuple | None  # roots from `stored_roots.places`, or None
    rooted_on: tuple  # (session_uid of the surface, its topology)
    may_start_off_surface: bool  # whether strands may begin off the surface
    note: HairError | None = None  # strands of the datablock that are left out
    growing: Future | None = None  # of the points, if other threads compute them; None if they were read
    on_gpu: strand_textures.StrandsOnGPU | None = None  # deformed by `pose`
    pose: posed_strands.Pose | None = None  # None without a surface
    moved: list = field(default_factory=list)  # [(M,) indices of strands] that have moved since the upload
    generator: gpu_strands.StrandGenerator = field(default_factory=gpu_strands.StrandGenerator)

    def __post_init__(self):
        require_count("radii", len(self.radii), len(self.points))
        require_count("random numbers", len(self.randoms), len(self.points))
        if self.wetness is not None:
            require_count("wetness", len(self.wetness), len(self.points))
        if self.looks is not None:
            require_count("looks", len(self.looks), len(self.points))


strand_cache = Cache()  # session_uid of Curves → _CachedStrands or Refused
pose_cache = Cache()  # session_uid of a surface → Pose
shading_cache = Cache(_SHADING_CAPACITY)  # settings → Shading


def read_boxes():
    """Read the bounding boxes of strands that the GPU has made, of all hair that it is about to make again.

    These boxes may stand for those of the next strands. The GPU has no other work yet, so this does not wait for long.
    """
    for cached in strand_cache.values():
        if isinstance(cached, _CachedStrands) and cached.on_gpu is not None and cached.generator.due is not None:
            _ = cached.on_gpu.box.exact


@memory_as_sentence()
def drawn_strands(datablock, is_viewport=True):
    """`StrandsOnGPU` of a hair Curves datablock; None if it was refused. Raises `HairError`.

    is_viewport: whether hair may be drawn without its styles while it is combed.
    """
    bound = bindings.of(datablock)
    if is_viewport or bound is None or bound.straight is None:
        return strands_on_gpu(datablock)
    return _upload_styled(datablock, bound)


def places_of(datablock):
    """Return (root vertices, barycentric coordinates), each (S, 3), of the strands of `strands_on_gpu`; None without
    roots.
    """
    cached = _strands_of(datablock.session_uid)
    return cached and cached.places


def _upload_styled(datablock, bound):
    """`StrandsOnGPU` of bound hair with its styles, not cached."""
    bound.update_points()
    styled = _read(datablock, bound, bound)
    return strand_textures.upload_strands(
        _carried(styled, _pose_of(datablock.surface)), styled.radii, styled.randoms, styled.wetness, styled.looks
    )


def strands_on_gpu(datablock):
    """`StrandsOnGPU` of any Curves datablock, deformed with its surface; only changes are uploaded.

    None if the datablock was refused. Raises `HairError`.
    """
    cached = strand_cache.get(datablock.session_uid)
    if isinstance(cached, Refused):
        return None
    if cached is None or (cached.growing is not None and cached.growing.result() is not cached.points):
        cached = strand_cache.keep(datablock.session_uid, _read_shown(datablock))
    if cached.on_gpu is not None and cached.on_gpu.looks_here is not cached.looks:
        cached.on_gpu = strand_textures.with_looks(cached.on_gpu, cached.looks)
    pose = _pose_of(datablock.surface)
    is_elsewhere = cached.on_gpu is None or cached.pose is not pose
    is_due = cached.generator.due is not None
    if is_due or is_elsewhere:
        is_behind = _is_behind(datablock)
        if cached.on_gpu is not None and cached.generator.bring(cached, pose, is_behind):
            return cached.on_gpu
        if is_due or is_behind:
            cached = strand_cache.keep(datablock.session_uid, _read_shown(datablock))
    moved, cached.moved = cached.moved, []
    if moved or is_elsewhere:
        cached.generator.carrier = None  # its strands at rest are outdated
    if cached.on_gpu is None or is_elsewhere or (moved and not cached.on_gpu.has_points):
        points = _carried(cached, pose)
        cached.on_gpu = strand_textures.upload_strands(
            points, cached.radii, cached.randoms, cached.wetness, cached.looks
        )
        cached.pose = pose
    elif moved:
        chosen = np.unique(np.concatenate(moved))
        require_indices("strands", chosen, len(cached.points))
        cached.on_gpu = strand_textures.move_strands(cached.on_gpu, chosen, _carried(cached, pose, chosen))
    elif not cached.on_gpu.has_points and cached.generator.carrier is None and not _is_behind(datablock):
        cached.on_gpu = replace(  # computed meanwhile
            cached.on_gpu, points=cached.points, has_points=True, has_bends=True, lengthenings={}
        )
    return cached.on_gpu


def _is_behind(datablock):
    """Whether only the GPU has the current strands of a datablock."""
    bound = bindings.of(datablock)
    return bound is not None and bound.shown.is_behind


def _carried(cached, pose, chosen=slice(None)):
    """Points (M, P, 3) of chosen strands, deformed by a pose; at rest if the surface is not deformed."""
    if pose is None or not pose.is_deformed:
        return cached.points[chosen]
    return pose.carry(cached.points, cached.rooted_on[1], cached.places, chosen, cached.may_start_off_surface)


def _pose_of(surface_object):
    """Return the `Pose` of a surface, None without a surface. Raises `HairError`."""
    if surface_object is None:
        return None

    def read():
        return posed_strands.read_pose(surface_object, bpy.context.evaluated_depsgraph_get(), has_uvs=False)

    return pose_cache.get(surface_object.session_uid, read)


def drawn_bytes(datablock):
    """GPU memory that viewports use for a hair Curves datablock [bytes]; None if it is not drawn."""
    cached = _strands_of(datablock.session_uid)
    if cached is None or cached.on_gpu is None:
        return None
    textures = [*cached.on_gpu.textures, *cached.generator.textures]
    return strand_textures.bytes_of(textures) + strand_textures.seen_bytes(cached.on_gpu)


def note_of(datablock):
    """Return the `HairError` about strands of a Curves datablock that viewports do not draw, or None."""
    cached = strand_cache.get(datablock.session_uid)
    return refused_strands.error_of(cached) or getattr(cached, "note", None)


def refuse(datablock, error):
    """Do not draw a datablock until it changes, and report the reason once."""
    strand_cache.keep(datablock.session_uid, refused_strands.refused(error))


def move(session_uid, moved, bound):
    """Note that strands of `BoundHair` have moved: the next redraw waits for their points, and only uploads these.

    moved: (M,) indices of strands.
    """
    cached = _strands_of(session_uid)
    if cached is not None:
        cached.growing = bound.growing
        cached.moved.append(moved)


def follow_where_drawn(session_uid, bound):
    """Note that guides of `BoundHair` or their weights have changed: the GPU makes all strands with the next redraw."""
    cached = _strands_of(session_uid)
    if cached is not None:
        cached.generator.due = bound


def may_make(session_uid):
    """Whether the GPU makes the strands in viewports while guides are combed, as decided by `choose_makers`."""
    cached = _strands_of(session_uid)
    return cached is not None and cached.generator.is_chosen and not cached.moved


def may_restyle(session_uid, bound, styles):
    """Whether the GPU makes the strands in viewports after a change of bound hair's styles."""
    cached = _strands_of(session_uid)
    if not may_make(session_uid) or bound.straight is not None:
        return False
    return cached.generator.can_style(styles) and cached.generator.is_prepared(bound, styles)


def prepare_makers():
    """Compile one of the programs for edits of hair in viewports; returns whether one was missing."""
    for datablock in bpy.data.hair_curves:
        cached, bound = _strands_of(datablock.session_uid), bindings.of(datablock)
        if cached is not None and bound is not None and cached.generator.prepare(bound.shown):
            return True
    return False


def choose_makers():
    """Decide for which hair in viewports the GPU makes or carries strands."""
    is_wanted = gpu_strands.are_wanted()
    for datablock in bpy.data.hair_curves:
        cached, bound = _strands_of(datablock.session_uid), bindings.of(datablock)
        if cached is not None and cached.on_gpu is not None:
            is_bound = bound is not None and bound.free is None and cached.points is bound.shown.points
            cached.generator.choose(is_wanted, bound.shown if is_bound else None)


def _strands_of(session_uid):
    """Return the `_CachedStrands` of a datablock; None if there are none or they were refused."""
    cached = strand_cache.get(session_uid)
    return None if isinstance(cached, Refused) else cached


def is_pose_seen(surface_object):
    """Whether a viewport has drawn strands on a surface since the surface moved."""
    return pose_cache.get(surface_object.session_uid) is not None


def invalidate_pose(surface_object):
    """Note that a surface may be deformed: the next redraw updates its strands."""
    pose_cache.invalidate(surface_object.session_uid)
    for datablock in bpy.data.hair_curves:
        # A surface that could not be read may have been repaired.
        if datablock.surface == surface_object and isinstance(strand_cache.get(datablock.session_uid), Refused):
            strand_cache.invalidate(datablock.session_uid)


def invalidate_unless_same(datablock):
    """Drop the cache of a datablock that Blender reports as changed, if it did change.

    Blender also reports Curves if their surface moved or a property changed, and our own writes. Points are compared
    with those that were written: others may have changed them since, before Blender reports either.
    """
    uid, bound = datablock.session_uid, bindings.of(datablock)
    if bound is not None:
        if not bound.is_written:
            return
        if not _are_points(datablock, bound.points):
            bindings.invalidate(datablock)
            strand_cache.invalidate(uid)
            return
    cached = _strands_of(uid)
    if cached is None or not _is_same(datablock, cached, bound):
        strand_cache.invalidate(uid)
    else:
        cached.generator.release_memory()
        follow_looks(datablock)


def follow_looks(datablock):
    """Update the looks of cached strands, which maps may have changed; the next redraw uploads them."""
    cached = _strands_of(datablock.session_uid)
    if cached is None or len(cached.points) != len(datablock.curves):
        return
    looks = strand_maps.read_looks(datablock)
    if not strand_looks.are_same(looks, cached.looks):
        cached.looks = looks


def _is_same(datablock, cached, bound):
    """Whether cached strands equal those of a datablock and are rooted at the same places."""
    return (
        (cached.points is bound.shown.points if bound is not None else _are_points(datablock, cached.points))
        and np.array_equal(cached.radii.ravel(), curves.read_radii(datablock))
        and np.array_equal(cached.randoms, curves.read_randoms(datablock))
        and gpu_strands.are_equal(cached.wetness, curves.read_wetness(datablock))
        and cached.rooted_on == _rooted_on(datablock, datablock.vellus.topology)
        and (bound is not None or _are_places(cached.places, stored_roots.slid_places(datablock)))
    )


def _rooted_on(datablock, topology):
    return datablock.surface and datablock.surface.session_uid, topology


def _are_places(places, others):
    """Whether roots are unchanged, as binding hair may update the roots of guides."""
    if places is None or others is None:
        return places is others
    return all(map(np.array_equal, places, others))


def _are_points(datablock, points):
    return np.array_equal(points.reshape(-1, 3), curves.read_points(datablock))


def _read_shown(datablock):
    bound = bindings.of(datablock)
    if bound is not None:
        bound.shown.update_points()
    return _read(datablock, bound, bound and bound.shown)


def _read(datablock, bound, shown):
    """Return the current `_CachedStrands` of a datablock, or of its binding.

    shown: the `BoundHair` whose points are used, which may lack the styles of `bound`.
    """
    if bound is None:
        read = _shown_strands(datablock)
        places = None if datablock.surface is None else stored_roots.slid_places(datablock)
        if places is not None and read.is_sound is not None:
            places = tuple(values[read.is_sound] for values in places)
        rooted = places, _rooted_on(datablock, datablock.vellus.topology), stored_roots.may_start_off_surface(datablock)
        return _CachedStrands(*read.arrays, *rooted, read.note)
    if bound.is_written or bound.has_moved_only:
        randoms, wetness = curves.read_randoms(datablock), curves.read_wetness(datablock)
        looks = strand_maps.read_looks(datablock)
    else:
        (_identities, randoms), wetness = bound.binding.identities, bound.wetness
        looks = _unwritten_looks(datablock, bound)
    # Roots are taken from the binding too: the datablock may store the roots of earlier strands.
    places, rooted_on = bound.surface.places(bound.binding.roots), _rooted_on(datablock, bound.surface.topology)
    radii = _radii_of(datablock, bound, len(shown.points))
    return _CachedStrands(shown.points, radii, randoms, wetness, looks, places, rooted_on, False, growing=shown.growing)


def _unwritten_looks(datablock, bound):
    """Return the `StrandLooks` of bound hair that is not written yet."""
    return strand_maps.looks_of(datablock, strand_thickness.strands_of(datablock, bound))[0]


def _radii_of(datablock, bound, count):
    """Return (S, P) radii of bound hair; those of its datablock, which others may have changed, unless it has newer
    ones.
    """
    radii = bound.radii
    shape = count, radii.shape[-1]
    if bound.is_written or bound.has_moved_only:
        stored = curves.read_radii(datablock)
        if not attributes.are_radii(stored, radii):
            return stored.reshape(shape)
    return np.broadcast_to(radii, shape)


def _shown_strands(datablock):
    """`ReadStrands` of a datablock; at their simulated points for simulated guides."""
    read = read_strands.read(datablock)
    simulated = simulated_guides.point_cache.get(datablock.session_uid)
    if simulated is None or len(simulated) != len(read.points):
        return read
    even = np.repeat(read.radii.mean(axis=1, keepdims=True), simulated.shape[1], axis=1)
    return replace(read, points=simulated, radii=even)


@memory_as_sentence()
def shading_of(datablock, strands=None, is_neutral=False, waits=True):
    """Return the `Shading` of a hair Curves datablock, or a `MixedShading` if strands differ in wetness. Raises
    `HairError`.

    strands: its `StrandsOnGPU`; is_neutral: of strands to be tinted, in place of the look's color; waits: whether all
    tables are needed now; otherwise `late_layers` bakes some of them later.
    """
    if is_neutral:
        return _neutral_shading_of(datablock)
    state, looks = datablock.vellus, None if strands is None else strands.looks_here
    uid = datablock.session_uid
    wettest = _shading_of_look(state, properties.look_of(state), looks, None if waits else (uid, "wettest"))
    least, most = shared_wetness.of_hair(state)
    if strands is None or strands.wetness is None or least == most:
        return wettest
    driest = _shading_of_look(state, properties.dry_look_of(state), looks, None if waits else (uid, "driest"))
    return hair_shading.mixed(driest, wettest, strands.wetness_here, (least, most))


def _neutral_shading_of(datablock):
    look = appearance.neutral(properties.look_of(datablock.vellus))
    settings = appearance.table_settings(look)
    return _cached_shading((settings,), lambda wanted: hair_shading.marschner_shading(_tables(wanted, "")))


def _shading_of_look(state, look, looks=None, purpose=None):
    """Return the `Shading` of a look; purpose: for `late_layers.tables`, None if all tables are needed now."""
    variation = appearance.strand_settings(look)
    if looks is not None:
        return _shading_of_looks(state, look, look_tables.variation_of(variation), looks, purpose)
    if state.model == "KAJIYA_KAY":
        if variation.is_even:
            return _cached_shading((appearance.kajiya_kay_settings(look),), hair_shading.kajiya_kay_shading)
        return _cached_shading(
            (appearance.kajiya_kay_strand_settings(look), variation), hair_shading.kajiya_kay_strand_shading
        )
    settings = properties.table_settings_of(state, look)
    if variation.is_even and not settings.is_elliptic:
        return _cached_shading(
            (settings,), lambda wanted: hair_shading.marschner_shading(_tables(wanted, state.table_folder))
        )
    return _cached_shading((settings, variation), _strand_shading)


def _shading_of_looks(state, look, variation, looks, purpose):
    """Return the `Shading` of strands with `StrandLooks`."""
    some = strand_looks.sample_sigma_a(look, looks)
    if state.model == "KAJIYA_KAY":
        settings, is_radial = appearance.kajiya_kay_strand_settings(look), looks.radial is not None
        some = strand_looks.even_sigma_a(look, looks.some, some)
        return hair_shading.kajiya_kay_look_shading(settings, variation, some, is_radial)
    settings = replace(properties.table_settings_of(state, look), sigma_a=(0.0, 0.0, 0.0))
    covered = look_tables.covering(*looks.absorption_range)
    if looks.radial_range is None or settings.mode != "energy":  # the classic model has no radial roughness
        return _cached_shading((settings, variation, covered), _look_shading)(some)
    layers = radial_tables.covering(*looks.radial_range)
    settings, radial = replace(settings, radial_roughness=layers.low), looks.some.radial
    if purpose is not None and shading_cache.get((settings, variation, covered, layers)) is None:
        mean, device = float(radial.mean()), preferences.device()
        tables, key = late_layers.tables(purpose, settings, variation, covered, layers, mean, device)
        shaded = shading_cache.get(key, lambda: hair_shading.marschner_look_shading(tables))
        return shaded(some, radial) if isinstance(tables, radial_tables.RadialTables) else shaded(some)
    late_layers.forget(purpose)
    return _cached_shading((settings, variation, covered, layers), _radial_shading)(some, radial)


def _look_shading(settings, variation, covered):
    return hair_shading.marschner_look_shading(look_tables.bake(settings, variation, covered, preferences.device()))


def _radial_shading(settings, variation, covered, layers):
    baked = radial_tables.bake(settings, variation, covered, layers, preferences.device())
    return hair_shading.marschner_look_shading(baked)


def _strand_shading(settings, variation):
    return hair_shading.marschner_strand_shading(strand_tables.bake(settings, variation, preferences.device()))


def _cached_shading(settings, make):
    return shading_cache.get(settings, lambda: make(*settings))


def _tables(settings, folder):
    """Return the tables of these settings: from the folder if its settings match, else from the cache, else baked."""
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
    """Return a folder in a file's settings as a `Path`; None, with a message, if nothing may be read from it."""
    try:
        return paths.resolve(folder)
    except HairError as error:
        notices.say(str(error))
        return None


def cache_folder():
    """Return the user's folder of baked tables, shared by all files; None if Vellus does not run as an extension."""
    if not preferences.is_extension():
        return None  # run from a checkout
    # Empty if Blender could not create the folder, which it reports on the console.
    folder = bpy.utils.extension_path_user(preferences.ADDON_MODULE, path="tables", create=True)
    return Path(folder) if folder else None
