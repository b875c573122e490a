# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves of [Alembic26] files as a `CurveFile`, with their transforms and the groom attributes of [UnrealGroom26].

Alembic files have no unit and no up axis. Files of Vellus are in centimeters with Z up; files of another program
are read with the default convention of the program.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...errors import HairError
from ..curve_file import Convention, CurveFile, CurveSet, Motion
from ..groom_curves import GUIDE_SLOTS
from . import shapes, transforms, unreal_groom
from .reader import Archive, Damaged, Property

# Default convention of programs, by the beginning of their names; all have Y up.
_OF_BLENDER = Convention(1.0, "Y")
_USUAL = {"Houdini": Convention(1.0, "Y")}
_OF_OTHERS = Convention(0.01, "Y")

_MOST_OBJECTS = 1_000_000


@dataclass(frozen=True)
class _Node:
    """An object of curves: its path, the properties of its schema, and of its parent transforms by depth."""

    path: tuple[str, ...]
    properties: Mapping[str, Property]
    transforms: Mapping[int, Mapping[str, Property]]


def read(path: Path) -> CurveFile:
    """Return the curves of an Alembic file, animated curves at their first sample. Raises `HairError`."""
    with _damage_as_error(path), Archive(path) as archive:
        nodes = _nodes(archive.top())
        application = archive.metadata.get("_ai_Application", "")
        notes: list[HairError] = []
        sets = []
        for node, name in zip(nodes, _names(nodes), strict=True):
            sets += _sets_of(archive, node, name, application, notes)
    return CurveFile(sets, _stated(application), _usual(application), notes)


@contextmanager
def _damage_as_error(path) -> Iterator[None]:
    try:
        # Curves with non-finite points are reported and skipped by the code that uses them.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            yield
    except (Damaged, OSError, MemoryError) as error:
        raise HairError("{path} is a damaged Alembic file.", path=path) from error


def _stated(application):
    if application.startswith("Vellus "):
        return Convention(1.0 / unreal_groom.PER_METRE, "Z")
    return _OF_BLENDER if application == "Blender" else Convention()


def _usual(application):
    return next((usual for name, usual in _USUAL.items() if application.startswith(name)), _OF_OTHERS)


# ---------------------------------------------------------------------------------------------------- objects


def _nodes(top) -> list[_Node]:
    """Return all objects of curves; instances repeat the objects of their sources."""
    found, instances, pending, count = [], [], [(top, {})], 0
    while pending:
        one, transforms = pending.pop()
        count += 1
        if count > _MOST_OBJECTS:
            raise Damaged
        properties, schema = one.properties, one.metadata.get("schema", "")
        if ".instanceSource" in properties:
            (source,) = one.archive.values(properties[".instanceSource"])[:1]
            instances.append((one.path, transforms, tuple(source.strip("/").split("/"))))
            continue
        if schema.startswith("AbcGeom_Xform") and ".xform" in properties:
            transforms = {**transforms, len(one.path): properties[".xform"].children}
        if schema.startswith("AbcGeom_Curve") and ".geom" in properties:
            found.append(_Node(one.path, properties[".geom"].children, transforms))
        pending += [(child, transforms) for child in reversed([*one.children()])]
    expanded = [*found]
    for path, transforms, source in instances:
        for node in found:
            if node.path[: len(source)] == source:
                # The parent transforms of the source do not apply to its instances.
                below = {
                    depth + len(path) - len(source): t for depth, t in node.transforms.items() if depth >= len(source)
                }
                expanded.append(_Node((*path, *node.path[len(source) :]), node.properties, {**transforms, **below}))
                if len(expanded) > _MOST_OBJECTS:
                    raise Damaged
    return expanded


def _names(nodes):
    """Return unique names: of the transform if the curves are its only child, else of the curves; paths if equal."""
    siblings = Counter(node.path[:-1] for node in nodes)
    own = [node.path[-2] if len(node.path) > 1 and siblings[node.path[:-1]] == 1 else node.path[-1] for node in nodes]
    counts = Counter(own)
    return [name if counts[name] == 1 else "/".join(node.path) for node, name in zip(nodes, own, strict=True)]


# ---------------------------------------------------------------------------------------------------- curves


def _sets_of(archive, node, name, application, notes) -> Iterator[CurveSet]:
    """Yield the `CurveSet`s of an object, none if it has no curves; appends warnings to notes."""
    stack = [node.transforms[depth] for depth in sorted(node.transforms)]
    shape = shapes.Shape(archive, node.properties, is_of_blender=application == "Blender")
    drawn = shape.drawn()
    for sentence, count in drawn.notes:
        notes.append(HairError(sentence, name=name, path=archive.path, count=count))
    if not len(drawn.counts):
        return
    times = transforms.times_of([shape.points, *(one[".vals"] for one in stack if ".vals" in one)])
    first = float(times[0]) if len(times) else 0.0
    matrix = transforms.matrix_at(archive, stack, first)
    scale = abs(np.linalg.det(matrix[:3, :3])) ** (1.0 / 3.0)
    radii = None if drawn.widths is None else (0.5 * scale * drawn.widths).astype(np.float32)

    def points_at(index):
        with _damage_as_error(archive.path), Archive(archive.path) as reopened:
            placed = transforms.matrix_at(reopened, stack, float(times[index]))
            return _placed(shape.points_at(reopened, float(times[index]), drawn), placed)

    motion = Motion(times, points_at) if len(times) > 1 else None
    if motion is not None and not shape.keeps_counts:
        motion = None
        sentence = '"{name}" in {path} changes its number of points over time: only its first sample is read.'
        notes.append(HairError(sentence, name=name, path=archive.path))
    curves = CurveSet(
        name,
        _placed(drawn.points, matrix),
        drawn.counts,
        np.full(len(drawn.counts), drawn.is_smooth),
        radii,
        motion=motion,
    )
    parameters = _Parameters(archive, node, stack)
    colors = _colors(parameters, drawn)
    if colors is None and parameters.values("groom_color", "f", 3) is not None:
        sentence = '"{name}" in {path} has colors neither for each point nor for each curve: they are left out.'
        notes.append(HairError(sentence, name=name, path=archive.path))
    yield from _split_by_group(replace(curves, colors=colors), parameters, drawn.kept)


def _colors(parameters, drawn):
    """Return linear RGB (N, 3) at the points of `Drawn`, from colors of points, of curves or of all; None without."""
    colors, count = parameters.values("groom_color", "f", 3), len(drawn.kept)
    if colors is None:
        return None
    if len(colors) in (1, count):
        colors = np.repeat(np.broadcast_to(colors, (count, 3))[drawn.kept], drawn.counts, axis=0)
    elif len(colors) != len(drawn.points) or drawn.lines is not None or not drawn.kept.all():
        return None
    return colors.astype(np.float32)


def _placed(points, matrix):
    return points @ matrix[:3, :3].T + matrix[:3, 3]


class _Parameters:
    """Geometry parameters of curves and of their parent transforms; the nearest object takes precedence."""

    def __init__(self, archive, node, stack):
        self._archive, self._places = archive, []
        for properties in (node.properties, *reversed(stack)):
            for name in (".arbGeomParams", ".userProperties"):
                if name in properties:
                    self._places.append(properties[name].children)

    def values(self, name, kind, width=1):
        """Return (n,) or (n, width) values of a parameter, None if missing or of another kind: "iu", "f", "" (text)."""
        for place in self._places:
            if name not in place:
                continue
            values = shapes.parameter(self._archive, place[name])
            if not kind:
                return values if isinstance(values, list) else None
            if not isinstance(values, list) and values.dtype.kind in kind and values.shape[1:] in ((), (width,)):
                return values if width == 1 or values.ndim == 2 else None
            return None
        return None


def _split_by_group(curves, parameters, kept) -> Iterator[CurveSet]:
    """Yield the curves with their parameters: one set for each group, separately for guides and strands.

    kept: (C,) mask of the given curves among all curves of the object; parameters have values for all curves.
    """
    file_count = len(kept)

    def of_curves(name, kind, width=1):
        values = parameters.values(name, kind, width)
        return None if values is None or len(values) != file_count else values[kept]

    def of_all(name):
        """Return (C,) int64, or None."""
        values = parameters.values(name, "iu")
        if values is None or len(values) not in (1, file_count):
            return None
        return np.broadcast_to(values.astype(np.int64), file_count)[kept]

    is_guide, groups, names = of_all("groom_guide"), of_all("groom_group_id"), parameters.values("groom_group_name", "")
    of_each = np.array(names, object)[kept] if names and len(names) == file_count else None
    whole = _with_attributes(curves, of_curves, names[0] if names else "")
    if is_guide is None and groups is None:
        yield whole
        return
    guides = np.full(len(whole), -1) if is_guide is None else is_guide
    groups = np.zeros(len(whole), np.int64) if groups is None else groups
    for guide, group in sorted(set(zip(guides.tolist(), groups.tolist(), strict=True))):
        chosen = (guides == guide) & (groups == group)
        name = whole.group_name if of_each is None else of_each[chosen][0]
        is_of_guides = None if is_guide is None else guide != 0
        yield replace(whole.some(chosen), is_guide=is_of_guides, group_id=group, group_name=name)


def _with_attributes(curves, of_curves, group_name):
    """Return curves with their IDs, root UVs and guides; of_curves(name, kind, width) returns a parameter or None."""
    ids, uvs = of_curves("groom_id", "iu"), of_curves("groom_root_uv", "f", 2)
    guide_ids = of_curves("groom_closest_guides", "iu", GUIDE_SLOTS)
    weights = of_curves("groom_guide_weights", "f", GUIDE_SLOTS)
    has_map = guide_ids is not None and weights is not None
    return CurveSet(
        curves.name,
        curves.points,
        curves.counts,
        curves.is_smooth,
        curves.radii,
        group_name=group_name,
        ids=None if ids is None else ids.astype(np.int32),
        root_uvs=None if uvs is None else uvs.astype(np.float32),
        guide_ids=guide_ids.astype(np.int32) if has_map else None,
        guide_weights=weights.astype(np.float32) if has_map else None,
        colors=curves.colors,
        motion=curves.motion,
    )
