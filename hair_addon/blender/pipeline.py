# SPDX-License-Identifier: GPL-3.0-or-later
"""The report's node graph in Blender: read geometry and settings, compute, write geometry.

mesh object ─ distribute_guides ─▶ Guides Curves ─ interpolate_hair ─▶ Hair Curves. What was made keeps its settings
and its inputs, so `evaluate` can make it again.
"""

import numpy as np

from ..core import groom, strands
from ..core.errors import HairError
from . import curves, materials, preferences, properties, scene


def distribute_guides(surface_object, settings, depsgraph, target=None):
    """Grow guides on a mesh object; returns their Curves object's data, a new object's unless `target` is given.

    Raises `HairError` before anything in the scene changes.
    """
    _check_surface(surface_object)
    surface = scene.read_surface(surface_object, depsgraph)
    density = scene.read_vertex_group(surface_object, depsgraph, settings.density_group)
    guides = groom.distribute_guides(surface.mesh, settings, density=density, device=preferences.device())
    target = target or curves.new_object("Guides", surface_object).data
    _keep_settings(target, "GUIDES", target.vellus.guides, settings)
    indices = np.arange(len(guides.roots), dtype=np.int32)
    radii = np.full(guides.points.shape[1], 0.5e-3, np.float32)
    curves.write_strands(target, surface, guides.numpy(), guides.roots, radii, indices)
    return target


def interpolate_hair(guide_curves, settings, depsgraph, target=None):
    """Grow strands between guides; returns their Curves data, a new object's unless `target` is given.

    Raises `HairError` before anything in the scene changes.
    """
    surface_object = guide_curves.surface
    _check_surface(surface_object)
    surface = scene.read_surface(surface_object, depsgraph)
    guides = read_guides(guide_curves, surface)
    density = scene.read_vertex_group(surface_object, depsgraph, settings.density_group)
    binding = groom.bind_hair(surface.mesh, guides, settings, density=density, device=preferences.device())
    hair = groom.follow_guides(binding, guides)
    target = target or curves.new_object("Hair", surface_object).data
    _keep_settings(target, "HAIR", target.vellus.hair, settings)
    target.vellus.guide_curves = guide_curves
    target.vellus.is_stale = False  # as which another choice of guides marks it
    radii = groom.strand_radii(settings, hair.points.shape[1])
    nearest = binding.guide_weights.indices.numpy()[:, 0]
    curves.write_strands(target, surface, hair.numpy(), hair.roots, radii, nearest)
    evaluate_shading(target)
    return target


def read_guides(guide_curves, surface):
    """Guides as they are combed now: `Strands` of one point count, however many each curve has."""
    counts = curves.point_counts(guide_curves)
    if not len(counts):
        raise HairError(f'"{guide_curves.name}" has no guides: distribute some first.')
    points = surface.from_local(curves.read_points(guide_curves))
    offsets = np.concatenate([[0], np.cumsum(counts)])
    roots = curves.read_roots(guide_curves, surface, points[offsets[:-1]])
    if (counts == groom.POINT_COUNT).all():
        points = points.reshape(len(counts), groom.POINT_COUNT, 3)
    else:
        points = strands.resample(points, offsets, groom.POINT_COUNT)
    return strands.from_numpy(points, roots, preferences.device())


def evaluate(target, depsgraph):
    """Make Curves again from the settings and inputs they keep. What is wrong becomes their status.

    Curves that somebody combed are left as they are: to replace them takes an operator, which is a decision.
    """
    state = target.vellus
    state.is_stale = False
    try:
        if curves.is_combed(target):
            raise HairError(f'"{target.name}" was combed and is kept: run its operator again to replace it.')
        if state.kind == "GUIDES":
            settings = properties.to_settings(state.guides, groom.GuideSettings)
            distribute_guides(target.surface, settings, depsgraph, target)
        elif state.kind == "HAIR":
            if state.guide_curves is None:
                raise HairError(f'"{target.name}" has lost its guides: pick them in the Hair tab.')
            settings = properties.to_settings(state.hair, groom.HairSettings)
            interpolate_hair(state.guide_curves, settings, depsgraph, target)
    except HairError as error:
        state.status = str(error)


def evaluate_shading(target):
    """Bring a hair's material in line with its settings, and what Blender draws with who draws it."""
    target.vellus.is_shading_stale = False
    curves.draw_natively(target, not target.vellus.is_drawn)
    try:
        materials.write_hair_material(target)
        target.vellus.shading_status = ""
    except HairError as error:
        target.vellus.shading_status = str(error)


def _check_surface(surface_object):
    if surface_object is None or surface_object.type != "MESH":
        raise HairError("Hair needs a mesh object to grow on: select one.")
    curves.require_editable(surface_object)


def _keep_settings(target, kind, group, settings):
    curves.require_editable(target)
    properties.assign(group, settings)
    target.vellus.kind = kind
    target.vellus.is_stale = False
    target.vellus.status = ""
