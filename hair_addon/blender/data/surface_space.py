# SPDX-License-Identifier: GPL-3.0-or-later
"""The space of strands: the local coordinates of their surface, the former surface, and changes of the coordinates.

*Apply*, *Set Origin* and similar operators change the local coordinates of a mesh and leave it in place in the world.
Other data in these coordinates, such as baked frames, is transformed by `applied`.
"""

import bpy
import numpy as np

from ...core.geometry.affine import Affine
from ..host.notices import name_of

# Properties of Curves. They are groups, because Blender's USD exporter warns about bare arrays.
_STORED_SURFACE = "vellus_stood_on"  # the surface, when strands were rooted on it
_APPLIED = "vellus_applied"
_KNOWN_AS = "vellus_known_as"

_SAME_SCALE = 1e-5  # tolerance of squared scales: Blender's matrices have single precision


def to_world(an_object, depsgraph=None):
    """Return the `Affine` from an object's local coordinates to the world, in a depsgraph's frame if one is given."""
    placed = an_object if depsgraph is None else an_object.evaluated_get(depsgraph)
    return Affine.of(placed.matrix_world)


def is_flattened(an_object):
    """Whether an object's scale is zero along an axis or its transform is not finite: nothing can be placed on it."""
    to_world_axes = np.array(an_object.matrix_world.to_3x3(), np.float64)
    return not np.isfinite(to_world_axes).all() or bool(abs(np.linalg.det(to_world_axes)) < 1e-30)


def has_scale(an_object, axes):
    """Whether an object has the scale of axes (3, 3) from local coordinates to the world; it may be turned."""
    present = np.array(an_object.matrix_world.to_3x3(), np.float64)
    if not np.isfinite(present).all() or (np.linalg.det(present) < 0.0) != (np.linalg.det(axes) < 0.0):
        return False
    squares, known = present.T @ present, axes.T @ axes
    return bool(np.allclose(squares, known, rtol=_SAME_SCALE, atol=_SAME_SCALE * np.abs(known).max()))


def between(an_object, surface_object):
    """Return the `Affine` from an object's local coordinates to those of a surface."""
    return to_world(surface_object).inverse @ to_world(an_object)


def keep_surface(curves, surface):
    """Store a `Surface` at rest and its object's transform, from which strands are transformed after an edit."""
    matrix = np.eye(4) if curves.surface is None else np.array(curves.surface.matrix_world)
    values = {"rest": surface.rest.ravel(), "to_world": matrix.ravel(), "name": surface.name}
    if curves.surface is not None:
        values["surface"] = curves.surface
    _store(curves, _STORED_SURFACE, values)


def remember_place(curves):
    """Store the surface's transform before a file is saved, as transforms may be applied without the add-on."""
    stored = curves.get(_STORED_SURFACE)
    if stored is not None and curves.surface is not None and curves.library is None and not has_other_surface(curves):
        stored["to_world"], stored["name"] = np.array(curves.surface.matrix_world).ravel(), name_of(curves.surface)
        stored["surface"] = curves.surface


def has_other_surface(curves):
    """Whether another surface was picked for Curves to which their objects are not attached yet as children."""
    stored = curves.get(_STORED_SURFACE)
    if curves.surface is None or stored is None:
        return False
    known, name = _stored_surface(stored), stored.get("name")
    # Files of older versions only store the name: a renamed surface counts as another surface.
    is_same = known == curves.surface if known is not None else name == name_of(curves.surface)
    if is_same or (known is None and not isinstance(name, str)):
        return False
    return not any(user.parent == curves.surface for user in bpy.data.objects if user.data == curves)


def surface_before(curves):
    """Return the object that Curves stand on, even if another was picked since; None if deleted or unknown."""
    if not has_other_surface(curves):
        return curves.surface
    stored = curves[_STORED_SURFACE]
    return _stored_surface(stored) or bpy.data.objects.get(stored.get("name", ""))


def _stored_surface(stored):
    """Return the object stored by `keep_surface`, a reference that follows renaming; None if deleted, or in older
    files.
    """
    found = stored.get("surface")
    return found if isinstance(found, bpy.types.Object) else None


def rest_before(curves):
    """Return (V, 3) float32 vertices of the surface that `keep_surface` stored, or None."""
    stored = curves.get(_STORED_SURFACE)
    return None if stored is None else np.array(stored["rest"], np.float32).reshape(-1, 3)


def vertex_count_before(curves):
    """Return the number of vertices of the surface that `keep_surface` stored, or None."""
    stored = curves.get(_STORED_SURFACE)
    return None if stored is None else len(stored["rest"]) // 3


def to_world_before(curves):
    """Return the `Affine` that was stored with the surface; None in files of older versions."""
    stored = curves.get(_STORED_SURFACE)
    if stored is None or len(stored.get("to_world", ())) != 16:
        return None
    return Affine.of(stored["to_world"])


def applied(curves):
    """Return the `Affine` from the local coordinates in which strands were made to the current local coordinates."""
    stored = curves.get(_APPLIED)
    found = Affine.identity() if stored is None or len(stored.get("matrix", ())) != 16 else Affine.of(stored["matrix"])
    return found if found.is_valid else Affine.identity()


def note_applied(curves, change, rest_before=None, vertices=None):
    """Note that an `Affine` was applied to the local coordinates.

    rest_before: (V, 3) rest positions until then, in the current order of vertices; vertices: (V,) of `FlippedFaces` if
    the order has changed.
    """
    values = {"matrix": (change @ applied(curves)).matrix.ravel(), "turns": _turns(curves) + int(change.is_mirroring)}
    first = curves.get(_APPLIED, {}).get("rest")
    if rest_before is not None:
        values["rest"] = rest_before.ravel() if first is None else np.array(first, np.float32)
        if first is not None and vertices is not None and len(first) == 3 * len(vertices):
            values["rest"] = values["rest"].reshape(-1, 3)[vertices].ravel()
    _store(curves, _APPLIED, values)


def made_on(curves, rest):
    """Return the exact (V, 3) rest positions when strands were made, if `applied` leads from them to `rest`; else
    None.

    Random distributions over a surface depend on their exact values.
    """
    first = curves.get(_APPLIED, {}).get("rest")
    if first is None or len(first) != rest.size:
        return None
    before = np.array(first, np.float32).reshape(-1, 3)
    tolerance = 1e-5 * np.ptp(rest, axis=0).max() + 1e-6 * abs(rest).max()
    return before if np.allclose(applied(curves).points(before), rest, rtol=0.0, atol=tolerance) else None


def note_same(curves, before, now):
    """Note that data with the digest `before` has the digest `now` in new local coordinates, unchanged in the world."""
    known = dict(curves.get(_KNOWN_AS, {}))
    first = known.pop(before, before)
    _store(curves, _KNOWN_AS, known | {now: first})


def known_as(curves, digest):
    """Return the original digest, before any `note_same`, of data with a digest now."""
    found = curves.get(_KNOWN_AS, {}).get(digest, digest)
    return found if isinstance(found, str) else digest


def is_turned(surface_object):
    """Whether a mirroring scale was applied to a mesh object with hair, so that Blender has flipped its faces.

    Hair that has not followed the last flip yet does not count.
    """
    grown = (datablock for datablock in bpy.data.hair_curves if datablock.surface == surface_object)
    return max((_turns(datablock) for datablock in grown if _APPLIED in datablock), default=0) % 2 == 1


def _turns(curves):
    """Return the number of mirroring scales that were applied to the surface of Curves."""
    turns = curves.get(_APPLIED, {}).get("turns")
    return turns if isinstance(turns, int) else int(applied(curves).is_mirroring)


def forget_applied(curves):
    """Forget applied transforms, as for Curves that were copied to another surface."""
    for name in (_APPLIED, _KNOWN_AS):
        if name in curves:
            del curves[name]


def _store(curves, name, values):
    if name in curves:
        # Blender 5.2 writes a longer array past the end of an existing shorter array.
        del curves[name]
    curves[name] = values
