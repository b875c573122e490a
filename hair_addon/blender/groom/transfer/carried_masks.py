# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertex groups that mask a groom, transferred to another mesh; groups that exist there are not changed."""

import numpy as np
from bpy.types import Curves, Depsgraph, Object

from ....core import grooming
from ....core.geometry.landmark_warp import Warp
from ....core.geometry.mesh import interpolate
from ....core.grooming.groom_transfer import TransferSurface
from ...data import scene, usable_surfaces, vertex_groups
from ...data.strands import curves
from ...data.surfaces import Surface
from ...host.notices import text_of
from ...settings import style_items


def read(guides: Curves, hair: Curves | None, target: Object, depsgraph: Depsgraph) -> dict[str, np.ndarray]:
    """Return {name: (V,) weights} of the vertex groups in the settings of a groom that the target mesh object lacks."""
    source = guides.surface
    names = [text_of(guides.vellus.guides, "density_group")]
    names += [text_of(item, "mask") for item in guides.vellus.layers]
    for mapped in (guides, *([] if hair is None else [hair])):
        names += [text_of(item, "source") for item in mapped.vellus.maps if item.kind == "GROUP"]
    if hair is not None:
        names += [text_of(hair.vellus.hair, name) for name in ("density_group", "region_group")]
        names += [style_items.masks_of(item)[0] for item in hair.vellus.styles]
    found = {}
    for name in names:
        is_wanted = name in source.vertex_groups and name not in target.vertex_groups
        weights = scene.read_vertex_group(source, depsgraph, name if is_wanted else "")
        if weights is not None:
            found[name] = weights
    return found


def carried(
    masks: dict[str, np.ndarray], source: TransferSurface, target: TransferSurface, warp: Warp | None, reach: float
) -> dict[str, np.ndarray]:
    """Return {name: (W,) weights} at the vertices of the target; arguments as of `groom_passage.carried_weights`."""
    if not masks:
        return {}
    weights = np.stack(list(masks.values()), axis=1)
    there = grooming.groom_passage.carried_weights(source, target, weights, warp, reach)
    return dict(zip(masks, there.T, strict=True))


def paint(target: Object, surface: Surface, masks: dict[str, np.ndarray]) -> list[str]:
    """Create vertex groups of weights (W,) at the vertices of a read surface; returns their names."""
    return [new_group(target, name, at_own_vertices(target, surface, weights)) for name, weights in masks.items()]


def at_own_vertices(surface_object: Object, surface: Surface, values: np.ndarray) -> np.ndarray:
    """Convert values (W, …) at the vertices of a read surface to those of its mesh without modifiers."""
    own = scene.read_own_mesh(surface_object, surface.to_world_axes).vertices
    if np.array_equal(own, surface.mesh.vertices):
        return values
    at = interpolate(values.reshape(len(values), -1), surface.mesh, curves.nearest_roots(surface, own))
    return at.reshape(len(own), *values.shape[1:])


def new_group(surface_object: Object, name: str, weights: np.ndarray) -> str:
    """Create a vertex group of weights (V,); returns its name. Raises `HairError`."""
    usable_surfaces.require_paintable(surface_object)
    group = surface_object.vertex_groups.new(name=name)
    vertex_groups.paint(group, np.round(weights, 6))
    return group.name
