# SPDX-License-Identifier: GPL-3.0-or-later
"""Validation of the Python interface's arguments. Invalid arguments raise `HairError` before any change."""

import os
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from ..core.errors import HairError
from ..core.geometry import mesh as mesh_math
from ..core.geometry.mesh import TriMesh
from ..core.long_work import Progress
from ..core.params import Settings, declared, described, require_class
from .blender_access import blender

S = TypeVar("S", bound=Settings)

# Settings that refer to data in a .blend file.
_OF_BLENDER = ("density_group", "density_image", "region_group", "region_attribute", "part_lines", "flow_lines")


def changed(settings_class: type[S], settings: S | None, changes: dict[str, Any], skip: Collection[str] = ()) -> S:
    """Return `Settings` with some fields changed; settings: None for the defaults. Raises `HairError`.

    skip: names of fields that may not be changed.
    """
    known = [name for name, _default, _details in declared(settings_class) if name not in skip]
    unknown = next((name for name in changes if name not in known), None)
    if unknown is not None:
        raise HairError(f'Unknown setting "{unknown}": choose from {", ".join(known)}.')
    if settings is None:
        return settings_class(**changes)
    require_class(settings, settings_class, "settings")
    return replace(settings, **changes)


def are_arrays(surface: object) -> bool:
    """Return whether a surface is given as arrays instead of a mesh object."""
    return isinstance(surface, TriMesh | tuple | list)


def mesh_of(arrays: object) -> TriMesh:
    """Return the `TriMesh` of (vertices, triangles), or of a `TriMesh`, which is validated. Raises `HairError`."""
    if isinstance(arrays, TriMesh):
        arrays = arrays.vertices, arrays.triangles
    if not isinstance(arrays, tuple | list) or len(arrays) != 2:
        raise HairError("A mesh must be a pair of arrays: vertices (V, 3) and triangles (F, 3).")
    return mesh_math.from_arrays(*arrays)


def require_no_names(settings: Settings) -> None:
    """Raise `HairError` if settings refer to data in a .blend file."""
    named = next((name for name in _OF_BLENDER if getattr(settings, name, "")), None)
    if named is not None:
        raise HairError(f'"{named}" refers to data in a .blend file: with plain arrays, use core.grooming.groom.')


def path_of(given: str | os.PathLike[str]) -> Path:
    """Return a `Path`; a leading // is the folder of the open .blend file. Raises `HairError`."""
    try:
        named = os.fspath(given)
        os.fsencode(named)
    except (TypeError, UnicodeEncodeError):
        named = None
    if not isinstance(named, str) or not named or "\0" in named:
        raise HairError(f"A path must be a non-empty string or a Path, not {described(given)}.")
    if not named.startswith("//"):
        return Path(named)

    return blender.host.paths.resolve(named)


def choice(given: object, kind: str, known: Collection[str]) -> str:
    """Return a name that must be one of the known ones. Raises `HairError`."""
    if not isinstance(given, str) or given not in known:
        raise HairError(f"Unknown {kind} {described(given)}: choose from {', '.join(known)}.")
    return given


def checked_progress(progress: object) -> Progress:
    """Return a progress callback. Raises `HairError` if it is not callable."""
    if not callable(progress):
        raise HairError(f"progress must be a function of (step, part), not {described(progress)}.")
    return progress


def curves_object_of(given: Any) -> Any:
    """Return a curves object that is neither guides nor hair; given: the object or its Curves. Raises `HairError`."""
    view_layer = blender.data.scene.present_depsgraph().view_layer
    curves_object = blender.data.arguments.object_with_curves(given, view_layer)
    if not blender.groom.foreign.foreign_curves.is_foreign(curves_object):
        raise HairError(f"{blender.host.notices.name_of(curves_object)!r} is already guides or hair.")
    return curves_object
