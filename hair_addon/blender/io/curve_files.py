# SPDX-License-Identifier: GPL-3.0-or-later
"""Import of curves as guides or hair: .blend, USD, Alembic, .npz arrays, and strands of other programs."""

from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import bpy
import numpy as np

from ...core.errors import HairError, cause_of
from ...core.files import alembic, array_grooms, curve_file, curve_units
from ...core.files.curve_file import Convention, Motion
from ...core.files.strands import counted_points, hair, obj_lines, ply_strands, tressfx
from ...core.geometry.strands import curve_offsets
from ..data import whole_changes
from ..host import scene_time
from . import curve_objects
from .usd import usd_curves

_USD = (".usd", ".usdc", ".usda", ".usdz")

# Extension → reader that returns a `CurveFile`; .blend files are read as objects instead.
_READERS = {
    **dict.fromkeys(_USD, usd_curves.read),
    ".abc": alembic.grooms.read,
    ".npz": array_grooms.read,
    ".hair": hair.read,
    ".data": counted_points.read_data,
    ".bin": counted_points.read_bin,
    ".ply": ply_strands.read,
    ".obj": obj_lines.read,
    ".tfx": tressfx.read,
}
ENDINGS = (".blend", *curve_file.ENDINGS)
OF_STRANDS = (".hair", ".data", ".bin", ".tfx")  # files that hold nothing else
OF_OTHERS = (*_USD, ".abc")  # also written by other programs

_OTHER = {"GUIDES": "HAIR", "HAIR": "GUIDES"}


@dataclass(frozen=True)
class Wanted:
    """A request for curves: kind "GUIDES" or "HAIR"; name: of objects or groups, "" for all.

    convention: unit and up axis given by the user; axis: up axis of arrays that do not store one; plays: whether to
    keep the motion of curves, if possible.
    """

    kind: str
    name: str = ""
    convention: Convention = field(default_factory=Convention)
    axis: str = "Z"
    plays: bool = False


@dataclass(frozen=True)
class Found:
    """Objects of the requested curves and of the file's guides, with notes for the user.

    motion: of curves that play, in meters with Z up; starts: (C+1,) offsets of the curves in its points.
    """

    curves: bpy.types.Object
    guides: bpy.types.Object | None = None
    notes: list[HairError] = field(default_factory=list)
    motion: Motion | None = None
    starts: np.ndarray | None = None


def require_readable(path):
    """Raise `HairError` unless the file exists and its format can hold curves."""
    path = Path(path)
    if not path.is_file():
        raise HairError("{path} is not a file: check the path.", path=path)
    if path.suffix.lower() not in ENDINGS:
        sentence = "Curves cannot be read from the format of {path}: use {endings}."
        raise HairError(sentence, path=path, endings=", ".join(ENDINGS))


def read(path, axis="Z"):
    """Read a file other than .blend as a `CurveFile`; axis: up axis of arrays that store none. Raises `HairError`."""
    path = Path(path)
    require_readable(path)
    reader = _READERS[path.suffix.lower()]
    return reader(path, axis) if reader is array_grooms.read else reader(path)


def read_all(path):
    """Like `read`, but load the points of all time samples too. Raises `HairError`."""
    for one in read(path).sets:
        for index in range(0 if one.motion is None else len(one.motion.times)):
            one.motion.points_at(index)


def is_read_natively(path):
    """Whether native code reads the file, which can crash on damaged files."""
    return Path(path).suffix.lower() in _USD


def summary(path):
    """Return [{name: value}] of the curves objects in a file other than .blend. Raises `HairError`."""
    kinds = {True: "guides", False: "strands", None: "curves"}
    return [
        {
            "name": one.name,
            "kind": kinds[one.is_guide],
            "group": one.group_name or None,
            "curves": len(one),
            "points": len(one.points),
            "has_widths": one.radii is not None,
            "samples": 1 if one.motion is None else len(one.motion.times),
        }
        for one in read(path).sets
    ]


@contextmanager
def curves_of(path, wanted, surface_object, is_open=False):
    """Context with the `Found` of a file, in the open scene; removes all other data appended with it.

    is_open: whether this file is open. Raises `HairError`.
    """
    path = Path(path)
    require_readable(path)
    if path.suffix.lower() != ".blend":
        with whole_changes.whole_change():
            made = made_of(path, read(path, wanted.axis), wanted, surface_object)
        yield made
        return
    if wanted.convention != Convention():
        raise HairError("{path} has its own unit and axes: leave out the options for unit and axis.", path=path)
    before = set(bpy.data.objects)
    if not is_open:
        _append(path)
        bpy.context.view_layer.update()
    came = set(bpy.data.objects) - (set() if is_open else before)
    chosen = _chosen_objects(path, came, wanted, is_open)
    if is_open:
        yield Found(curve_objects.joined(chosen))
        bpy.context.view_layer.update()
        return
    guides = [] if wanted.kind == "GUIDES" else _guides_of(chosen, came)
    for one in [*chosen, *guides]:
        curve_objects.make_plain(one)
    used = {*chosen, *guides}
    found = Found(curve_objects.joined(chosen), curve_objects.joined(guides) if guides else None)
    others = came - used
    data = {one.data for one in others if one.type == "CURVES"}
    bpy.data.batch_remove(others)
    bpy.data.batch_remove([one for one in data if not one.users])
    bpy.context.view_layer.update()
    yield found


# ---------------------------------------------------------------------------------------------------- files


def reading(path):
    """Run `read` in another thread, as work in steps. Raises `HairError`."""
    path = Path(path)
    require_readable(path)
    if path.suffix.lower() == ".blend":
        raise HairError("{path} is a .blend file: append its objects instead.", path=path)

    def compute(progress):
        progress("Reading curves", 0.0)
        return read(path)

    return (yield compute)


def groups_of(path, wanted, surface_object):
    """Return the `Found` of each group of a groom in a file, in the open scene. Raises `HairError`."""
    path = Path(path)
    require_readable(path)
    if path.suffix.lower() == ".blend":
        raise HairError("{path} is a .blend file, which has objects instead of groups: name one.", path=path)
    parts = parts_of(path, read(path, wanted.axis), wanted, surface_object)
    with whole_changes.whole_change():
        return [made_of(path, part, of_part, surface_object) for part, of_part in parts]


def parts_of(path, file, wanted, surface_object):
    """Return [(`CurveFile`, `Wanted`)] of each group of the requested curves, with the guides of the group.

    Unit and axis are those of the whole file, and notes on the file belong to the first group. Raises `HairError`.
    """
    path = Path(path)
    chosen, guides = _chosen_sets(path, file.sets, wanted)
    surface = curve_objects.world_mesh(surface_object)
    reading = curve_units.choose(file, [*chosen, *guides], wanted.convention, surface, str(path))
    its = replace(wanted, name="", convention=Convention(reading.meters, reading.up))
    groups, notes, parts = dict.fromkeys(_group(one) for one in chosen), [*file.notes, *reading.notes], []
    for group in groups:
        sets = [one for one in [*chosen, *guides] if _group(one) == group]
        parts.append((replace(file, sets=sets, notes=[] if parts else notes), its))
    return parts


def _group(one):
    """Return the ID and the name of the group of a `CurveSet`."""
    return one.group_id, one.group_name


def made_of(path, file, wanted, surface_object):
    """Create the `Found` of a `CurveFile` in the open scene. Raises `HairError`."""
    path = Path(path)
    chosen, guides = _chosen_sets(path, file.sets, wanted)
    surface = curve_objects.world_mesh(surface_object)
    reading = curve_units.choose(file, [*chosen, *guides], wanted.convention, surface, str(path))
    notes = [*file.notes, *reading.notes, *_notes_on_groups(path, chosen)]
    curves, its_guides = ([_now(one.placed(reading.meters, reading.up)) for one in sets] for sets in (chosen, guides))
    joined, made_guides, guide_ids = curve_file.join(curves), None, None
    motion = None
    if wanted.plays and joined.motion is not None:
        if joined.is_smooth.any():
            joined = curve_file.as_polylines(joined)
            notes.append(HairError(curve_file.SPLINES_MOVE, path=path))
        motion = joined.motion
    moving = [one.motion for one in chosen if one.motion is not None]
    if motion is None and moving:
        notes.append(_note_on_motion(path, moving[0]))
    if guides:
        joined_guides = curve_file.join(its_guides)
        made_guides = curve_objects.new_object("Guides", joined_guides, surface_object, groups=_groups(guides))
        guide_ids = joined_guides.ids
    made = curve_objects.new_object(_name(path, chosen), joined, surface_object, guide_ids, _groups(chosen))
    return Found(made, made_guides, notes, motion, curve_offsets(joined.counts))


def _groups(sets):
    """Return (C,) int32 IDs of the groups of curves, or None if they are of no groom."""
    if all(one.is_guide is None and not one.group_id for one in sets):
        return None
    return np.repeat([one.group_id for one in sets], [len(one) for one in sets]).astype(np.int32)


def _name(path, chosen):
    return chosen[0].name if len(chosen) == 1 else path.stem


def _now(curves):
    """Return the curves at the time sample nearest to the scene's time."""
    if curves.motion is None:
        return curves
    return replace(curves, points=curves.motion.points_at(_present_index(curves.motion)))


def _present_index(motion):
    now = scene_time.present_frame() / scene_time.frame_rate(bpy.context.scene)
    return int(np.argmin(np.abs(motion.times - now)))


def _note_on_motion(path, motion):
    frames = np.round(motion.times * scene_time.frame_rate(bpy.context.scene), 3)
    first, last, frame = frames[0], frames[-1], frames[_present_index(motion)]
    sentence = "{path} moves from frame {first:g} to {last:g}: its curves are read only at frame {frame:g}."
    return HairError(sentence, path=path, first=first, last=last, frame=frame)


def _chosen_sets(path, sets, wanted):
    """Return ([requested sets], [sets of their guides]). Raises `HairError`."""
    every = [one for one in sets if len(one)]
    if not every:
        raise HairError("{path} has no curves.", path=path)
    named = [one for one in every if not wanted.name or wanted.name in (one.name, one.group_name)]
    if not named:
        names = _listed([one.name for one in every])
        sentence = '{path} has no curves "{name}", but {names}.'
        raise HairError(sentence, path=path, name=wanted.name, names=names)
    is_guide = wanted.kind == "GUIDES"
    # Prefer sets that the file marks as this kind, then unmarked sets, then the rest.
    chosen = next(
        found
        for found in ([one for one in named if one.is_guide is kind] for kind in (is_guide, None, not is_guide))
        if found
    )
    if is_guide or chosen[0].is_guide is not False:
        return chosen, []
    groups = {_group(one) for one in chosen}
    return chosen, [one for one in every if one.is_guide and _group(one) in groups]


def _notes_on_groups(path, chosen):
    groups = list(dict.fromkeys(one.group_name or str(one.group_id) for one in chosen if one.is_guide is not None))
    if len(groups) > 1:
        sentence = "{path} has {count} groups ({names}): they are read as one, unless one is named."
        yield HairError(sentence, path=path, count=len(groups), names=_listed(groups))


def _listed(names):
    return ", ".join(names[:5]) + ("…" if len(names) > 5 else "")


# ---------------------------------------------------------------------------------------------------- .blend files


def _append(path):
    try:
        with bpy.data.libraries.load(str(path)) as (there, wanted):
            wanted.objects = there.objects
    except (OSError, RuntimeError, ValueError) as error:
        raise HairError("{path} cannot be read: {cause}.", path=path, cause=cause_of(error)) from error
    for read in wanted.objects:
        if read is not None:
            bpy.context.scene.collection.objects.link(read)
            read.hide_viewport = False
            read.hide_set(False)


def _chosen_objects(path, came, wanted, is_open):
    layer = bpy.context.view_layer
    found = [o for o in came if o.type in {"CURVES", "CURVE"} and layer.objects.get(o.name) == o]
    found.sort(key=lambda one: one.name)
    if not found:
        raise HairError("{path} has no curves.", path=path)
    if wanted.name:
        chosen = [one for one in found if one.name == wanted.name]
        if not chosen:
            sentence = '{path} has no curves "{name}", but {names}.'
            raise HairError(sentence, path=path, name=wanted.name, names=_listed([one.name for one in found]))
        return chosen
    kinds = {one: one.data.vellus.kind if one.type == "CURVES" else "NONE" for one in found}
    order = (wanted.kind, "NONE", _OTHER[wanted.kind])
    kind, chosen = next((kind, some) for kind in order if (some := [one for one in found if kinds[one] == kind]))
    if is_open and kind != "NONE" and len(chosen) > 1:
        sentence = "{path} has {count} curves objects of that kind ({names}): name one."
        raise HairError(sentence, path=path, count=len(chosen), names=_listed([one.name for one in chosen]))
    return chosen


def _guides_of(chosen, came):
    """Return the objects of the guides that the hair follows, in the order of the hair."""
    followed = dict.fromkeys(one.data.vellus.guide_curves for one in chosen if one.type == "CURVES")
    shown = {one.data: one for one in came if one.type == "CURVES"}
    return [shown[guides] for guides in followed if guides in shown]
