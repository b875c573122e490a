# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair and guides → files for engines and other programs: Unreal's Alembic, USD, files of strands."""

import contextlib
import json
from dataclasses import dataclass
from pathlib import Path

from ...core.errors import HairError, cause_of
from ...core.files import export_settings, groom_curves, settings_file
from ...core.files.alembic import unreal_groom
from ...core.files.atomic_file import atomic_file, require_writable_path
from ...core.files.strands import writers
from ...core.long_work import Stage
from ..groom.dynamics import frame_folders
from ..groom.transfer import groom_settings
from ..host import paths, scene_time
from ..host.datablocks import Remembered
from ..host.notices import name_of
from ..settings import saved_looks
from . import delivery, groom_sources, strand_arrays
from .usd import hair_file, usd_groom, usd_variants


@dataclass(frozen=True)
class Exported:
    """A written file: numbers of its groups, guides, strands, frames and bytes, and notes on importers."""

    path: Path
    groups: int
    guides: int
    strands: int
    frames: int
    byte_count: int
    notes: list[HairError]


def require_writable(path):
    """Raise `HairError` unless this build of Blender can write a groom to a path, by its extension."""
    ending = path.suffix.lower()
    if ending not in export_settings.ENDINGS:
        raise HairError(
            "Hair is exported as {endings}, not as {ending}.",
            endings=", ".join(export_settings.ENDINGS),
            ending=ending or "a file without an extension",
        )
    if _is_usd(path):
        hair_file.require_usd()
    require_writable_path(path)


def exporting(path, chosen, settings, blender_scene):
    """Write hair Curves and their guides to a file, as work in steps; returns an `Exported`.

    settings: `ExportSettings`. The file is written atomically; the scene's time is always restored. Raises `HairError`.
    """
    require_writable(path)
    if not chosen:
        raise HairError("There is no hair to export: add hair to the mesh.")
    if _is_strands(path) and settings.animation != "NONE":
        sentence = "{path} can hold only one frame: choose Nothing in Animation, or write .abc or .usd."
        raise HairError(sentence, path=path)
    frames = [None] if settings.animation == "NONE" else list(scene_time.scene_frames())
    variants = _variants(path, settings)
    simulated = _simulated(chosen, frames)
    per_meter = _per_meter(path)
    remembered = [Remembered(hair) for hair in chosen]
    with contextlib.ExitStack() as stack:
        stack.callback(_go_to, blender_scene, None if frames == [None] else scene_time.time_of(blender_scene))
        _go_to(blender_scene, frames[0])
        yield Stage("Exporting", 0.0)
        strand_arrays.update_strands()
        chosen = [one.find() for one in remembered]
        sources = groom_sources.sources_of(chosen, settings, per_meter)
        notes, instances = list(groom_sources.notes_of(chosen, sources, settings)), groom_sources.instances_of(chosen)
        if not sources:
            raise HairError("Neither hair nor guides would be exported: choose one of them.")
        if not _is_usd(path) and instances:
            sources += groom_sources.copies_of(sources, instances)
        with atomic_file(path) as partial, _opened(partial, path, chosen, frames[0], blender_scene, variants) as writer:
            numbers = yield _adding(writer, sources, path)
            for name, matrix in instances if _is_usd(path) else ():
                writer.add_instance(name, matrix)
            for index, frame in enumerate(frames):
                _go_to(blender_scene, frame if index else None)
                for guides in simulated:
                    delivery.require_shown(guides.find(), frame)
                read = _read(sources, numbers, per_meter, is_first=index == 0)
                yield _writing(writer, read, path, frame, index / len(frames))
    guide_count, strand_count = groom_sources.counts_of(sources)
    group_count = len({source.curves.group_id for source in sources})
    counts = group_count, guide_count, strand_count, len(frames)
    return Exported(path, *counts, path.stat().st_size, [*notes, *writer.notes()])


def _is_strands(path):
    return path.suffix.lower() in export_settings.OF_STRANDS


def _is_usd(path):
    return path.suffix.lower() != ".abc" and not _is_strands(path)


def _per_meter(path):
    if _is_strands(path):
        return writers.PER_METRE
    return usd_groom.PER_METRE if _is_usd(path) else unreal_groom.PER_METRE


def _go_to(blender_scene, time):
    """Set the time; None leaves it unchanged."""
    if time is not None:
        delivery.go_to(blender_scene, time)


def _opened(partial, path, chosen, first_frame, blender_scene, variants):
    """Return the context of a writer; first_frame: None without animation."""
    if _is_strands(path):
        return writers.writing(partial, path.suffix.lower())
    header = f"Vellus {paths.addon_version()}", _properties(chosen)
    rate = scene_time.frame_rate(blender_scene)
    if _is_usd(path):
        return usd_groom.writing(partial, path, *header, rate, first_frame or 0, variants)
    return unreal_groom.writing(partial, *header, None if first_frame is None else rate, first_frame or 0)


def _variants(path, settings):
    """Return the `Variants` of a file. Raises `HairError` for formats without variants and for unknown looks."""
    names = list(dict.fromkeys(filter(None, (name.strip() for name in settings.looks.split(",")))))
    if not _is_usd(path) and (settings.level_count > 1 or names):
        sentence = "{path} can hold neither levels of detail nor further looks: write .usd, .usdc or .usda."
        raise HairError(sentence, path=path)
    looks = [saved_looks.named(name) for name in names]
    variant_names = groom_curves.group_names(names, {usd_variants.PRESENT_LOOK})
    return usd_variants.Variants(settings.level_count, dict(zip(variant_names, looks, strict=True)))


def _simulated(chosen, frames):
    """Return the simulated guides of the hair, none for a single frame. Raises `HairError` unless baked."""
    guides = {hair.vellus.guide_curves for hair in chosen} - {None}
    simulated = [one for one in guides if frame_folders.is_simulated(one)]
    if frames == [None]:
        for fault in (frame_folders.fault_of(one, [scene_time.present_frame()]) for one in simulated):
            if fault is not None:
                raise fault
        return []
    for one in simulated:
        frame_folders.require_frames(one, frames)
    return [Remembered(one) for one in simulated]


def _read(sources, numbers, per_meter, is_first):
    """Return [(number, points)] of the curves to write at this time."""
    read = []
    for source, number in zip(sources, numbers, strict=True):
        if is_first or source.moves:
            read.append((number, groom_sources.points_of(source, per_meter)))
    return read


def _adding(writer, sources, path):
    """Return a function of (progress) that writes all data except points, and returns the curves' numbers."""

    def write(progress):
        numbers = []
        for source in sources:
            progress("Exporting", 0.0)
            with _disk_errors(path):
                numbers.append(writer.add(source.curves, source.moves))
        return numbers

    return write


def _writing(writer, read, path, frame, part):
    """Return a function of (progress) that writes the points of one time and can be stopped between blocks."""
    step = "Exporting" if frame is None else f"Frame {frame}"

    def watched(points, progress):
        def rows(some):
            progress(step, part)
            return points(some)

        return rows

    def write(progress):
        for number, points in read:
            with _disk_errors(path):
                writer.write_points(number, watched(points, progress))

    return write


@contextlib.contextmanager
def _disk_errors(path):
    """Convert OSError, such as of a full disk, to `HairError`: computations run outside other error handling."""
    try:
        yield
    except OSError as error:
        raise HairError("{path} cannot be written: {cause}.", path=path, cause=cause_of(error)) from error


def _properties(chosen):
    """Return the settings of each hair with guides, as JSON."""
    with_guides = [hair for hair in chosen if hair.vellus.guide_curves is not None]
    settings = {name_of(hair): settings_file.to_object(groom_settings.settings_of(hair)) for hair in with_guides}
    return json.dumps(settings, ensure_ascii=True, separators=(",", ":"))
