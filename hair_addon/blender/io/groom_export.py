# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair and guides → files for engines and other programs: Unreal's Alembic, USD."""

import contextlib
import json
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ...core.errors import HairError
from ...core.files import export_settings, groom_curves, settings_file, unreal_groom
from ...core.files.groom_curves import GroomCurves
from ...core.files.whole_file import require_place, whole_file
from ...core.long_work import Stage
from ...core.shading import strand_colors
from ..data import curves, exported_curves, simulated_guides
from ..groom import frame_folders, groom_settings, hair_systems, selection
from ..host import paths, scene_time
from ..host.datablocks import Remembered
from ..host.notices import name_of
from ..settings import properties
from . import delivery, strand_arrays, usd_groom


@dataclass(frozen=True)
class Exported:
    """A file that was written: how many groups, guides and strands, its size [bytes], and what an
    importer will do with it."""

    path: Path
    groups: int
    guides: int
    strands: int
    frames: int
    byte_count: int
    notes: list[HairError]


@dataclass(frozen=True)
class _Source:
    """Guides or strands to export."""

    datablock: Remembered
    curves: GroomCurves
    moves: bool


def require_writable(path):
    """Raise `HairError` unless a groom could be written to a path."""
    ending = path.suffix.lower()
    if ending not in export_settings.ENDINGS:
        raise HairError(
            "Hair is exported as {endings}, not as {ending}.",
            endings=", ".join(export_settings.ENDINGS),
            ending=ending or "a file without an extension",
        )
    require_place(path)


def hair_on(active):
    """The hair that is exported with an active object: that on its surface that the view layer has objects of."""
    layer = bpy.context.view_layer
    layer.update()  # new objects may not be in it yet
    systems = hair_systems.systems_of(selection.surface_of(active), layer)
    return [system for system in systems if system.vellus.kind == "HAIR"]


def all_hair():
    """All hair that the view layer has objects of, oldest first."""
    layer = bpy.context.view_layer
    layer.update()
    found = {o.data for o in layer.objects if o.type == "CURVES" and o.data.vellus.kind == "HAIR"}
    return sorted(found, key=lambda hair: hair.session_uid)


def exporting(path, chosen, settings, blender_scene):
    """Write hair Curves and their guides to a file, as work in steps; returns an `Exported`.

    settings: `ExportSettings`. The file appears whole or not at all; the scene is at the time where it was, on every
    way out. Raises `HairError`.
    """
    require_writable(path)
    if not chosen:
        raise HairError("There is no hair to export: add hair to the mesh.")
    frames = [None] if settings.animation == "NONE" else list(scene_time.scene_frames())
    moving = [] if settings.animation == "NONE" else _simulated(chosen, frames)
    is_usd = path.suffix.lower() != ".abc"
    per_metre = usd_groom.PER_METRE if is_usd else unreal_groom.PER_METRE
    with contextlib.ExitStack() as stack:
        if settings.animation != "NONE":
            stack.callback(delivery.go_to, blender_scene, scene_time.time_of(blender_scene))
            delivery.go_to(blender_scene, frames[0])
        yield Stage("Exporting", 0.0)
        strand_arrays.bring_up_to_date()
        sources = _sources(chosen, settings, per_metre)
        if not sources:
            raise HairError("Neither hair nor guides would be exported: choose one of them.")
        with whole_file(path) as partial:
            first, rate = frames[0] or 0, scene_time.frame_rate(blender_scene)
            told = _tool(), _properties(chosen)
            if is_usd:
                opened = usd_groom.writing(partial, path, *told, rate, first)
            else:
                opened = unreal_groom.writing(partial, *told, None if settings.animation == "NONE" else rate, first)
            with opened as writer:
                numbers = yield _adding(writer, sources)
                for index, frame in enumerate(frames):
                    if index:
                        delivery.go_to(blender_scene, frame)
                    for simulated in moving:
                        delivery.require_shown(simulated.find(), frame)
                    read = _read(sources, numbers, per_metre, is_first=index == 0)
                    yield _writing(writer, read, frame, index / len(frames))
            byte_count = partial.stat().st_size
    counts = [sum(s.curves.curve_count for s in sources if s.curves.is_guide == is_guide) for is_guide in (True, False)]
    return Exported(path, len(chosen), *counts, len(frames), byte_count, [*_notes(chosen, sources), *writer.notes()])


def _simulated(chosen, frames):
    """The guides of hair that simulate, which have to be baked."""
    guides = {hair.vellus.guide_curves for hair in chosen} - {None}
    simulated = [one for one in guides if frame_folders.is_simulated(one)]
    for one in simulated:
        frame_folders.require_frames(one, frames)
    return [Remembered(one) for one in simulated]


def _sources(chosen, settings, per_metre):
    """A `_Source` for the guides and the strands of each hair; identities differ in all of the file."""
    names, sources, first_id = _group_names(chosen), [], 0
    for group, (hair, name) in enumerate(zip(chosen, names, strict=True)):
        guides = hair.vellus.guide_curves
        if settings.has_guides and guides is not None:
            made = _guide_curves(guides, group, name, first_id, per_metre)
            sources.append(_Source(Remembered(guides), made, settings.moves(True)))
        if settings.has_hair:
            made = _strand_curves(hair, group, name, first_id, per_metre, settings)
            sources.append(_Source(Remembered(hair), made, settings.moves(False)))
        first_id += (len(guides.curves) if guides is not None else 0) + len(hair.curves)
    return sources


def _group_names(chosen):
    return groom_curves.group_names([name_of(hair) for hair in chosen], {usd_groom.MATERIALS, "groom"})


def _guide_curves(guides, group, name, first_id, per_metre):
    shown = simulated_guides.point_cache.get(guides.session_uid)
    curve_count, point_count, _ = strand_arrays.shape_of(guides) if shown is None else shown.shape
    return GroomCurves(
        group_id=group,
        group_name=name,
        is_guide=True,
        curve_count=curve_count,
        point_count=point_count,
        first_id=first_id,
        widths=_widths(guides, point_count, per_metre),
        root_uvs=exported_curves.read_root_uvs(guides),
    )


def _strand_curves(hair, group, name, first_id, per_metre, settings):
    guides = hair.vellus.guide_curves
    guide_count = 0 if guides is None else len(guides.curves)
    guide_map = exported_curves.read_guide_map(hair, guide_count) if guide_count else None
    ids, weights = (None, None) if guide_map is None else groom_curves.closest_guides(*guide_map, first_id)
    curve_count, point_count, _ = strand_arrays.shape_of(hair)
    look, randoms = properties.look_of(hair.vellus), curves.read_randoms(hair)
    return GroomCurves(
        group_id=group,
        group_name=name,
        is_guide=False,
        curve_count=curve_count,
        point_count=point_count,
        first_id=first_id + guide_count,
        widths=_widths(hair, point_count, per_metre),
        root_uvs=exported_curves.read_root_uvs(hair),
        guide_ids=ids,
        guide_weights=weights,
        colors=(lambda some: strand_colors.colors(look, randoms[some], point_count)) if settings.has_color else None,
        roughness=(lambda some: strand_colors.roughness(look, randoms[some], point_count))
        if settings.has_color
        else None,
        look=look,
    )


def _widths(datablock, point_count, per_metre):
    """Diameters of some strands, in the file's units."""
    radii = exported_curves.read_radii(datablock, point_count)
    factor = 2.0 * strand_arrays.world_scale(datablock) * per_metre
    return lambda some: radii(some) * np.float32(factor)


def _read(sources, numbers, per_metre, is_first):
    """[(number, points)] of what is written at this time."""
    read = []
    for source, number in zip(sources, numbers, strict=True):
        if is_first or source.moves:
            datablock = source.datablock.find()
            read.append((number, _points(datablock, source.curves, per_metre)))
    return read


def _points(datablock, exported, per_metre):
    local = simulated_guides.point_cache.get(datablock.session_uid) if exported.is_guide else None
    shape = strand_arrays.shape_of(datablock)[:2] if local is None else local.shape[:2]
    if shape != (exported.curve_count, exported.point_count):
        raise HairError('The number of strands of "{name}" changes: remove its keys.', name=name_of(datablock))
    return strand_arrays.world_rows(datablock, per_metre, local)


def _adding(writer, sources):
    """A function of (progress) that writes all but points, and returns the numbers of the curves."""

    def write(progress):
        progress("Exporting", 0.0)
        return [writer.add(source.curves, source.moves) for source in sources]

    return write


def _writing(writer, read, frame, part):
    """A function of (progress) that writes the points of one time."""

    def write(progress):
        progress("Exporting" if frame is None else f"Frame {frame}", part)
        for number, points in read:
            writer.write_points(number, points)

    return write


def _notes(chosen, sources):
    """What an importer does with hair that stores less than it could."""
    for hair, name in zip(chosen, _group_names(chosen), strict=True):
        if name_of(hair) != name:
            yield HairError('"{name}" is called {group} in the file.', name=name_of(hair), group=name)
    for source in sources:
        made = source.curves
        if not made.is_guide and made.guide_ids is None:
            yield HairError(
                '"{name}" stores no guide weights: Unreal computes its own. Switch on Store Guide Weights.',
                name=made.group_name,
            )


def _tool():
    return f"Vellus {paths.addon_version()}"


def _properties(chosen):
    """The settings of each hair that has guides, as JSON."""
    with_guides = [hair for hair in chosen if hair.vellus.guide_curves is not None]
    settings = {name_of(hair): settings_file.to_object(groom_settings.settings_of(hair)) for hair in with_guides}
    return json.dumps(settings, ensure_ascii=True, separators=(",", ":"))
