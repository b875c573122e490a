# SPDX-License-Identifier: GPL-3.0-or-later
"""The hair of a `drawn_scene.DrawnScene`: strands on the GPU with their looks, in viewports and in renders."""

import numpy as np

from ...core.errors import HairError
from ..data.pictures import drawn_meshes
from ..gpu import level_of_detail, strand_textures
from ..host import running
from ..host.notices import can_be_drawn
from . import hair_cache, modified_hair, read_strands, solid_hair


def is_hair(evaluated):
    """Whether an evaluated object shows hair."""
    if evaluated.type != "CURVES" or evaluated.original.data.vellus.kind != "HAIR":
        return False
    return len(evaluated.data.curves) > 0


def read_rendered(depsgraph, known, refused, noted):
    """Yield (hair, owner, texture of UVs or None) as in a `DrawnScene`."""
    has_uvs = depsgraph.view_layer.use_pass_uv
    for instance in depsgraph.object_instances:
        hair_object = instance.object
        if not is_hair(hair_object):
            continue
        original = hair_object.original.data
        to_world = np.array(instance.matrix_world, np.float64)
        if not can_be_drawn(hair_object, to_world):
            continue
        try:
            read = read_strands.read(hair_object.data)
            if read.note is not None:
                noted(original, read.note)
            uid = hair_object.original.session_uid
            if uid not in known or not read_strands.are_same(read.arrays, known[uid][:-1]):
                known[uid] = (*read.arrays, strand_textures.upload_strands(*read.arrays))
            strands = known[uid][-1]
            shading = hair_cache.shading_of(original.evaluated_get(depsgraph), strands)  # settings may be keyed
        except HairError as error:
            refused(original, error)
            continue
        uvs = read_strands.read_root_uvs(hair_object.data, read.is_sound) if has_uvs else None
        texture = None if uvs is None else strand_textures.pairs_texture(uvs, strands.row_strands)
        yield (strands, shading, to_world, level_of_detail.NO_LIMITS), drawn_meshes.owner_of(instance), texture


def read_shown(places, viewport, refused, shown, depsgraph):
    """Return (hair of a `DrawnScene`, the `HairPlace` of each) for all places whose hair can be drawn."""
    hair, drawn_places = [], []
    solid_hair.make_room(len(places))
    hair_cache.read_boxes()
    for place in places:
        datablock = place.hair_object.data
        if viewport is not None and not datablock.vellus.is_drawn:
            continue
        if not can_be_drawn(place.hair_object, place.to_world):
            continue
        try:
            strands, shading = _drawn_hair(place.hair_object, depsgraph, viewport is not None, shown)
        except HairError as error:
            if refused is None:
                raise
            refused(datablock, error)
            continue
        if strands is not None:
            state = datablock.vellus
            limits = level_of_detail.Limits(0.01 * state.viewport_percentage, state.is_reduced_in_viewport)
            hair.append((strands, shading, place.to_world, limits))
            drawn_places.append(place)
    return hair, drawn_places


def _drawn_hair(hair_object, depsgraph, is_viewport, shown):
    """Return (`StrandsOnGPU`, shading) of an object, as Blender evaluates it if an artist has added modifiers."""
    is_modified, datablock = modified_hair.is_modified(hair_object), hair_object.data
    if is_modified:
        strands = modified_hair.strands_on_gpu(hair_object, depsgraph)
    else:
        modified_hair.forget(hair_object)
        strands = hair_cache.drawn_strands(datablock, is_viewport)
    if strands is None:
        return None, None
    tints = None
    if solid_hair.has_root_colors(shown):
        places = modified_hair.places(hair_object, depsgraph) if is_modified else hair_cache.places_of(datablock)
        tints = solid_hair.strand_tints(shown, hair_object, depsgraph, strands, places)
    is_neutral = tints is not None or solid_hair.is_tinted(shown)
    waits = not (is_viewport and running.has_window())
    shading = hair_cache.shading_of(datablock, strands, is_neutral, waits)
    return strands, solid_hair.shown_as(shading, shown, hair_object, tints)
