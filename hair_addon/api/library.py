# SPDX-License-Identifier: GPL-3.0-or-later
"""Python interface: grooms in asset libraries."""

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..core import grooming
from ..core.errors import HairError
from ..core.long_work import Progress, no_progress, run_now
from ..core.params import array_of, described, is_text
from .arguments import checked_progress, choice, path_of
from .blender_access import blender

Curves = Any
MeshObject = Any

__all__ = ["apply_groom", "groom_names", "save_groom"]


def save_groom(
    hair: Curves, path: str | os.PathLike, *, name: str = "", catalog: str = "Hair", picture: ArrayLike | None = None
) -> Path:
    """Save hair Curves and their guides as an asset; returns the file.

    path: the folder of an asset library, or a .blend file, which is replaced if it contains only grooms; name: of the
    groom, "" for the hair's; catalog: of the library, such as "Hair/Short", "" for none; picture: (height, width, 4),
    sRGB, bottom row first, None to draw one. The file contains the guides at rest, their surface, masks and settings,
    but not the strands, which are generated again.

    >>> file = api.save_groom(bpy.data.objects["Hair"], "library", name="Bob")
    >>> file.name
    'Bob.asset.blend'
    """
    target = blender.data.arguments.curves_of(hair, "HAIR")
    for given in (name, catalog):
        if not isinstance(given, str) or not is_text(given):
            raise HairError(f"name and catalog must be strings, not {described(given)}.")
    return run_now(blender.io.groom_library.saving(target, path_of(path), name, catalog, _pixels(picture)))


def _pixels(picture):
    """Return a picture as (height, width, 4) float32, None for None. Raises `HairError`."""
    if picture is None:
        return None
    pixels = array_of(picture, np.float32)
    if pixels is None or pixels.ndim != 3 or pixels.shape[2] != 4 or not pixels.size or not np.isfinite(pixels).all():
        raise HairError("picture must be an array (height, width, 4) of finite numbers.")
    return pixels


def groom_names(path: str | os.PathLike) -> list[str]:
    """Return the names of the assets in a .blend file, in alphabetical order.

    >>> api.groom_names("library/Bob.asset.blend")
    ['Bob']
    """
    return blender.io.groom_library.names_in(path_of(path))


def apply_groom(
    surface: MeshObject,
    path: str | os.PathLike,
    name: str = "",
    *,
    method: str = "AUTO",
    progress: Progress = no_progress,
) -> tuple[Curves, Curves]:
    """Apply a saved groom to a mesh object as new guides and hair; returns the Curves of both.

    path: a .blend file with grooms; name: of the groom, if there are several; method: "UV" transfers guides by UV
    coordinates, "NEAREST" to the nearest surface; "AUTO" chooses an exact copy if the mesh equals the saved surface,
    else UV maps that agree, else the nearest surface. Lengths scale with the surface.

    >>> guides, hair = api.apply_groom(bpy.data.objects["Scalp"], "library/Bob.asset.blend")
    >>> len(guides.curves)
    75
    """
    choice(method, "method", grooming.groom_passage.METHODS)
    if not isinstance(name, str):
        raise HairError(f"name must be a string, not {described(name)}.")
    target = blender.data.arguments.surface_object(surface)
    groom = blender.io.groom_library.read(path_of(path), name)
    work = blender.groom.transfer.library_groom.adding_groom(
        target, groom, blender.data.scene.present_depsgraph(), method
    )
    applied = run_now(work, checked_progress(progress))
    return applied.made.guides, applied.made.hair
