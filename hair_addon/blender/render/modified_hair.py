# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair with modifiers of the artist in viewports: the strands of Blender's evaluation, as renders have them."""

from dataclasses import dataclass

import bpy
import numpy as np

from ..data.strands import delivered_hair, stored_roots
from ..gpu import strand_textures
from ..gpu.strand_textures import StrandsOnGPU
from ..host.caches import Cache
from . import read_strands

modified_cache = Cache()  # session_uid of an object → _Modified


@dataclass
class _Modified:
    """The evaluated strands of an object; is_current: whether its evaluation has not been reported since.

    spare: an array for the next radii, None before these are read.
    """

    owner: int  # session_uid of the object
    datablock: int  # session_uid of its Curves
    arrays: tuple
    on_gpu: StrandsOnGPU
    is_current: bool = True
    spare: np.ndarray | None = None


def is_modified(hair_object: bpy.types.Object) -> bool:
    """Whether viewports show an object of hair with modifiers other than those of Vellus."""
    return hair_object.mode == "OBJECT" and bool(delivered_hair.modifiers_in_viewports(hair_object))


def strands_on_gpu(hair_object: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> StrandsOnGPU:
    """Return the evaluated strands of an object; only changes are uploaded.

    Raises `HairError` if modifiers leave no strands.
    """
    known = modified_cache.get(hair_object.session_uid)
    if known is not None and known.is_current:
        return known.on_gpu
    evaluated = hair_object.evaluated_get(depsgraph).data
    if known is None:
        read, spare = read_strands.read(evaluated), None
    else:
        radii, spare = known.arrays[1], known.spare
        if spare is None or spare.shape != radii.shape:
            spare = np.empty(radii.shape, np.float32)
        read = read_strands.read(evaluated, radii, spare)
    if known is not None and read_strands.are_same(read.arrays, known.arrays):
        known.is_current, known.spare = True, spare
        return known.on_gpu
    forget_deleted()
    if known is not None and read_strands.have_same_details(read.arrays, known.arrays):
        on_gpu = strand_textures.with_points(known.on_gpu, read.points)
    else:
        on_gpu = strand_textures.upload_strands(*read.arrays)
    made = _Modified(hair_object.session_uid, hair_object.data.session_uid, read.arrays, on_gpu, spare=spare)
    return modified_cache.keep(hair_object.session_uid, made).on_gpu


def places(hair_object: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> tuple | None:
    """Return (root vertices, barycentric coordinates), each (S, 3), of evaluated strands; None if modifiers drop
    them.
    """
    return stored_roots.places(hair_object.evaluated_get(depsgraph).data, np.inf)


def forget(hair_object: bpy.types.Object) -> None:
    """Free the strands of an object that has no modifiers of the artist any more."""
    modified_cache.invalidate(hair_object.session_uid)


def forget_deleted() -> None:
    """Free the strands of objects that were deleted."""
    present = {one.session_uid for one in bpy.data.objects} if len(modified_cache) else set()
    for known in modified_cache.values():
        if known.owner not in present:
            modified_cache.invalidate(known.owner)


def invalidate(hair_object: bpy.types.Object) -> None:
    """Note that an object was evaluated again."""
    known = modified_cache.get(hair_object.session_uid)
    if known is not None:
        known.is_current = False


def invalidate_users(datablock: bpy.types.Curves) -> None:
    """Note that Curves have changed, and all of their objects with them."""
    for known in modified_cache.values():
        if known.datablock == datablock.session_uid:
            known.is_current = False
