# SPDX-License-Identifier: GPL-3.0-or-later
"""Inputs of styles, read from Blender: masks, cutting planes and directions of objects."""

from collections.abc import Sequence

import bpy
import numpy as np

from ....core import geometry
from ....core.errors import HairError
from ....core.styling import lean, trim
from ....core.styling.base import Cutter, StyleSettings, guide_set, has_effect
from ....core.styling.masks import Inputs, Mask
from ....core.styling.program import mask_keys
from ...host.notices import name_of
from .. import scene
from . import attributes, selection_sets

# Luminance of linear colors, Rec. 709.
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)
_NUMBERS = {"FLOAT": ("value", 1), "FLOAT_COLOR": ("color", 4), "BYTE_COLOR": ("color", 4), "BOOLEAN": ("value", 1)}


def read(surface_object, surface, guide_curves, styles: Sequence[StyleSettings], depsgraph) -> Inputs:
    """Return the `Inputs` of styles on a `Surface`; guide_curves: None if there are none yet. Raises `HairError`."""
    active = [settings for settings in styles if has_effect(settings)]
    masks = {key: read_mask(surface_object, surface, guide_curves, key, depsgraph) for key in mask_keys(active)}
    origin = np.array(surface_object.matrix_world.translation, np.float64)
    cutters, targets = {}, {}
    for settings in active:
        if isinstance(settings, trim.Settings) and settings.cutter:
            matrix = _matrix_of(settings.cutter, "Trim")
            cutters[settings.cutter] = Cutter(matrix[:3, 3] - origin, _z_axis(matrix, settings.cutter))
        if isinstance(settings, lean.Settings) and settings.direction == "OBJECT" and settings.target:
            matrix = _matrix_of(settings.target, "Lean")
            targets[settings.target] = _z_axis(matrix, settings.target)
    return Inputs(masks, cutters, targets, guide_sets=guide_sets(guide_curves, active))


def guide_sets(guide_curves, styles: Sequence[StyleSettings]) -> dict[str, np.ndarray]:
    """Return {name: (G,) bool} of the selections of guides at the centers of locks; a missing one is left out."""
    names = set(filter(None, map(guide_set, styles)))
    found = {name: None if guide_curves is None else selection_sets.read_guides(guide_curves, name) for name in names}
    return {name: are_chosen for name, are_chosen in found.items() if are_chosen is not None}


def _matrix_of(name, label):
    """Return (4, 4) float64 world matrix of an object. Raises `HairError`."""
    found = bpy.data.objects.get(name)
    if found is None:
        sentence = 'There is no object "{name}" for the style {style}: pick another object, or clear the field.'
        raise HairError(sentence, name=name, style=label)
    return np.array(found.matrix_world, np.float64)


def _z_axis(matrix, name):
    axis = matrix[:3, 2]
    size = np.linalg.norm(axis)
    if not (np.isfinite(matrix).all() and size > 1e-12):
        raise HairError('"{name}" has a scale of zero or a non-finite transform: change its scale.', name=name)
    return axis / size


def read_mask(surface_object, surface, guide_curves, key, depsgraph):
    """Return the `Mask` of a `mask_key` on the `Surface` of an object; guide_curves: None if there are none yet.

    Raises `HairError`.
    """
    name, image, is_inverted = key
    texture = scene.read_texture(surface, image, may_be_black=True)
    if not name:
        return Mask(None, texture, None, is_inverted)
    if surface_object.vertex_groups.get(name) is not None:
        weights = scene.read_weights(surface_object, surface, depsgraph, name)
        require_same(surface_object, len(weights) == len(surface.rest))
        return Mask(weights[surface.mesh.triangles], texture, None, is_inverted)
    corners = _read_surface_attribute(surface_object, surface, name, depsgraph)
    guides = None if corners is not None or guide_curves is None else _read_guide_attribute(guide_curves, name)
    if corners is None and guides is None:
        sentence = 'Neither "{name}" nor its guides have a vertex group or attribute "{mask}": pick another mask.'
        raise HairError(sentence, name=name_of(surface_object), mask=name)
    return Mask(corners, texture, guides, is_inverted)


def _read_surface_attribute(surface_object, surface, name, depsgraph):
    """Return (F, 3) float32 at the corners of triangles; None without such an attribute."""
    evaluated = surface_object.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        attribute = mesh.attributes.get(name)
        if attribute is None:
            return None
        domain, values = attribute.domain, _numbers(attribute, name_of(surface_object))
    finally:
        evaluated.to_mesh_clear()
    return at_corners(surface_object, surface, depsgraph, values, domain)


def at_corners(surface_object, surface, depsgraph, values, domain):
    """Return (F, 3, …) at the corners of a `Surface`'s triangles, from an evaluated mesh's values (N, …) on a
    domain.

    domain: POINT, FACE or CORNER. Raises `HairError` if the mesh has changed since the `Surface` was read.
    """
    values = scene.on_surface(surface_object, surface, depsgraph, values, domain)
    faces, triangles = surface.faces, surface.mesh.triangles
    sizes = {"POINT": len(surface.rest), "CORNER": len(faces.corner_vertices), "FACE": len(faces.starts) - 1}
    require_same(surface_object, domain in sizes and len(values) == sizes[domain])
    if domain == "POINT":
        return values[triangles]
    owners = geometry.faces.face_places.owners(faces)
    if domain == "FACE":
        return np.repeat(values[owners][:, None], 3, axis=1)
    return values[faces.starts[owners][:, None] + geometry.faces.face_places.corners_of(faces, owners, triangles)]


def require_same(surface_object, is_same):
    """Raise `HairError` if a mesh has changed since its `Surface` was read."""
    if not is_same:
        sentence = 'The mesh of "{name}" has changed: the hair updates when you leave its paint mode.'
        raise HairError(sentence, name=name_of(surface_object))


def _numbers(attribute, owner):
    """Return (N,) float32 of an attribute: numbers, or the luminance of colors. Raises `HairError`."""
    if attribute.data_type not in _NUMBERS or attribute.domain not in ("POINT", "CORNER", "FACE"):
        sentence = 'The attribute "{attribute}" of "{name}" cannot mask hair: use numbers or colors.'
        raise HairError(sentence, attribute=name_of(attribute), name=owner)
    field, width = _NUMBERS[attribute.data_type]
    values = np.empty(len(attribute.data) * width, bool if attribute.data_type == "BOOLEAN" else np.float32)
    attribute.data.foreach_get(field, values)
    if width == 1:
        return values.astype(np.float32)
    return values.reshape(-1, 4)[:, :3] @ _LUMINANCE


def _read_guide_attribute(guide_curves, name):
    """Return (G,) float32; None without such an attribute. Raises `HairError` for other types."""
    if guide_curves.attributes.get(name) is None:
        return None
    values = attributes.read(guide_curves, name, "FLOAT", "CURVE")
    if values is None:
        sentence = 'The attribute "{attribute}" of "{name}" cannot mask hair: use numbers on curves.'
        raise HairError(sentence, attribute=name, name=name_of(guide_curves))
    return values
