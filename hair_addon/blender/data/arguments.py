# SPDX-License-Identifier: GPL-3.0-or-later
"""Validation of surfaces, guides and hair passed by scripts."""

import bpy

from ...core.errors import HairError
from ...core.params import described
from ..host.notices import name_of
from . import usable_surfaces

_KINDS = {"GUIDES": "Vellus guides", "HAIR": "Vellus hair", None: "Vellus guides or hair"}


def curves_of(given, kind=None):
    """Return a Curves datablock, given directly or as its object; for an evaluated copy, the original.

    Raises `HairError` unless it is hair or guides; kind: only "GUIDES" or only "HAIR".
    """
    found = _original(given)
    if isinstance(found, bpy.types.Object):
        found = found.data
    # The result of modifiers on Curves is not in the file, and its original is unknown.
    is_of_file = isinstance(found, bpy.types.Curves) and found in {*bpy.data.hair_curves}
    if not is_of_file or found.vellus.kind == "NONE" or kind not in {None, found.vellus.kind}:
        raise HairError(f"{_called(given)} is not {_KINDS[kind]}.")
    return found


def object_with_curves(given, view_layer):
    """Return a curves object, given directly or as the data of an object in the view layer.

    For an evaluated copy, returns the original. Raises `HairError`.
    """
    found = _original(given)
    if isinstance(found, bpy.types.Curves | bpy.types.Curve):
        found = next((o for o in view_layer.objects if o is not None and o.data == found), None)
    if not isinstance(found, bpy.types.Object) or found.type not in {"CURVE", "CURVES"}:
        raise HairError(f"{_called(given)} is not a curves object.")
    return found


def guides_of(given):
    """Return guide Curves like `curves_of`. Raises `HairError` unless their surface is evaluated."""
    guides = curves_of(given, "GUIDES")
    if guides.surface is not None:
        usable_surfaces.require_evaluated(guides.surface)
    return guides


def surface_object(given):
    """Return a mesh object; for an evaluated copy, the original. Raises `HairError`."""
    found = _original(given)
    if not isinstance(found, bpy.types.Object) or found.type != "MESH":
        raise HairError(f"{_called(given)} is neither a mesh object nor the arrays of a mesh.")
    usable_surfaces.require_evaluated(found)
    return found


def _original(given):
    """Return the original of a datablock, other values unchanged. Raises `HairError` for a removed datablock."""
    if not isinstance(given, bpy.types.ID):
        return given
    try:
        return given.original if given.is_evaluated else given
    except ReferenceError as error:
        kind = type(given).__name__
        raise HairError(f"The {kind} was removed from the file or replaced by an undo: look it up again.") from error


def _called(given):
    return repr(name_of(given)) if isinstance(given, bpy.types.ID) else described(given)
