# SPDX-License-Identifier: GPL-3.0-or-later
"""The space of strands: the local coordinates of their surface, what it was, and what has become of these coordinates.

*Apply*, *Set Origin* and their like change the local coordinates of a mesh and leave it where it is in the world. What
is stored in these coordinates beside Curves, such as baked frames, is carried by `applied`.
"""

import bpy
import numpy as np

from ...core.geometry.affine import Affine
from ..host.notices import name_of

# Properties of Curves. In groups, because Blender's USD exporter warns about bare arrays.
_STOOD_ON = "vellus_stood_on"  # the surface, when strands were rooted on it
_APPLIED = "vellus_applied"
_KNOWN_AS = "vellus_known_as"


def to_world(an_object, depsgraph=None):
    """The `Affine` from an object's local coordinates to the world; of a depsgraph's frame where one is given."""
    placed = an_object if depsgraph is None else an_object.evaluated_get(depsgraph)
    return Affine.of(placed.matrix_world)


def between(an_object, surface_object):
    """The `Affine` from an object's local coordinates to those of a surface."""
    return to_world(surface_object).inverse @ to_world(an_object)


def keep_surface(curves, surface):
    """Store a `Surface` at rest and where its object is: strands are transformed from there after an edit."""
    matrix = np.eye(4) if curves.surface is None else np.array(curves.surface.matrix_world)
    kept = {"rest": surface.rest.ravel(), "to_world": matrix.ravel(), "name": surface.name}
    if curves.surface is not None:
        kept["surface"] = curves.surface
    _keep(curves, _STOOD_ON, kept)


def remember_place(curves):
    """Store where the surface's object is now, before a file is saved: transforms are applied elsewhere, too."""
    kept = curves.get(_STOOD_ON)
    if kept is not None and curves.surface is not None and curves.library is None and not has_other_surface(curves):
        kept["to_world"], kept["name"] = np.array(curves.surface.matrix_world).ravel(), name_of(curves.surface)
        kept["surface"] = curves.surface


def has_other_surface(curves):
    """Whether a surface was picked for Curves that they do not stand on yet: they are children of no such object."""
    kept = curves.get(_STOOD_ON)
    if curves.surface is None or kept is None:
        return False
    known, name = _stood_on(kept), kept.get("name")
    # Names do for files of older versions: a surface that was renamed there is taken for another one.
    is_same = known == curves.surface if known is not None else name == name_of(curves.surface)
    if is_same or (known is None and not isinstance(name, str)):
        return False
    return not any(user.parent == curves.surface for user in bpy.data.objects if user.data == curves)


def surface_before(curves):
    """The object that Curves stand on, whichever was picked for them since; None where it is gone, or unknown."""
    if not has_other_surface(curves):
        return curves.surface
    kept = curves[_STOOD_ON]
    return _stood_on(kept) or bpy.data.objects.get(kept.get("name", ""))


def _stood_on(kept):
    """The object in what `keep_surface` stored, which Blender renames; None where it is gone, or in older files."""
    found = kept.get("surface")
    return found if isinstance(found, bpy.types.Object) else None


def rest_before(curves):
    """(V, 3) float32 vertices of the surface that `keep_surface` stored, or None."""
    kept = curves.get(_STOOD_ON)
    return None if kept is None else np.array(kept["rest"], np.float32).reshape(-1, 3)


def vertex_count_before(curves):
    """How many vertices the surface had that `keep_surface` stored, or None."""
    kept = curves.get(_STOOD_ON)
    return None if kept is None else len(kept["rest"]) // 3


def to_world_before(curves):
    """The `Affine` that was stored with the surface, or None: files of older versions have none."""
    kept = curves.get(_STOOD_ON)
    if kept is None or len(kept.get("to_world", ())) != 16:
        return None
    return Affine.of(kept["to_world"])


def applied(curves):
    """The `Affine` from the local coordinates that strands were made in to those that they have now."""
    kept = curves.get(_APPLIED)
    found = Affine.identity() if kept is None or len(kept.get("matrix", ())) != 16 else Affine.of(kept["matrix"])
    return found if found.is_valid else Affine.identity()


def note_applied(curves, change, rest_before=None, vertices=None):
    """Note that an `Affine` was applied to the local coordinates.

    rest_before: (V, 3) vertices at rest until then, in their present order; vertices: (V,) of `TurnedFaces` where this
    is another than that of before.
    """
    kept = {"matrix": (change @ applied(curves)).matrix.ravel(), "turns": _turns(curves) + int(change.is_mirroring)}
    first = curves.get(_APPLIED, {}).get("rest")
    if rest_before is not None:
        kept["rest"] = rest_before.ravel() if first is None else np.array(first, np.float32)
        if first is not None and vertices is not None and len(first) == 3 * len(vertices):
            kept["rest"] = kept["rest"].reshape(-1, 3)[vertices].ravel()
    _keep(curves, _APPLIED, kept)


def made_on(curves, rest):
    """(V, 3) vertices, to the last bit, that were at rest when strands were made, if they are (V, 3) now; else None.

    What is spread over a surface at random follows their bits.
    """
    first = curves.get(_APPLIED, {}).get("rest")
    if first is None or len(first) != rest.size:
        return None
    before = np.array(first, np.float32).reshape(-1, 3)
    tolerance = 1e-5 * np.ptp(rest, axis=0).max() + 1e-6 * abs(rest).max()
    return before if np.allclose(applied(curves).points(before), rest, rtol=0.0, atol=tolerance) else None


def note_same(curves, before, now):
    """Note that what had one digest has another in the coordinates of now, and is the same in the world."""
    known = dict(curves.get(_KNOWN_AS, {}))
    first = known.pop(before, before)
    _keep(curves, _KNOWN_AS, known | {now: first})


def known_as(curves, digest):
    """The digest, before any `note_same`, of what has a digest now."""
    found = curves.get(_KNOWN_AS, {}).get(digest, digest)
    return found if isinstance(found, str) else digest


def is_turned(surface_object):
    """Whether a mirroring scale was applied to a mesh object on which hair grows, as then Blender turns its faces.

    Hair that has not followed the last turn yet does not count.
    """
    grown = (datablock for datablock in bpy.data.hair_curves if datablock.surface == surface_object)
    return max((_turns(datablock) for datablock in grown if _APPLIED in datablock), default=0) % 2 == 1


def _turns(curves):
    """How often a scale that mirrors was applied to what Curves are rooted on."""
    turns = curves.get(_APPLIED, {}).get("turns")
    return turns if isinstance(turns, int) else int(applied(curves).is_mirroring)


def forget_applied(curves):
    """Count from the present local coordinates on, as for Curves that were copied to another surface."""
    for name in (_APPLIED, _KNOWN_AS):
        if name in curves:
            del curves[name]


def _keep(curves, name, values):
    if name in curves:
        # Blender 5.2 writes an array over a shorter one, past its end.
        del curves[name]
    curves[name] = values
