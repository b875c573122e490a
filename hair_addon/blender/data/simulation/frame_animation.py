# SPDX-License-Identifier: GPL-3.0-or-later
"""Digests of the animation of each frame, by which baked frames detect changes.

Only vertices are read, as a digest is computed for every played frame.
"""

from dataclasses import asdict

import numpy as np

from ....core.dynamics.collision.collider_settings import ColliderSettings, contact_of
from ....core.errors import HairError
from ....core.files import frame_manifest
from ....core.styling.strand_wetness import mean_amount
from ...host.notices import name_of
from ...settings import properties, setting_properties, shared_wetness
from .. import scene
from ..strands import stored_roots
from . import force_fields, simulated_world

_HALF = 16  # digits of a digest for the surface, and for everything else that acts on guides
_LEVEL = 4  # the first of these digits: the level of subdivision of the surface

SURFACE, SURROUNDINGS = "the surface", "colliders, force fields, gravity or keyed settings"


def digest_of(guides, blender_scene, depsgraph, settings):
    """32 hexadecimal digits of all that moves guides with these `DynamicsSettings` in a depsgraph's frame.

    The first half covers the surface's size and its points at the roots, the second half colliders, force fields,
    gravity and keyed settings. Raises `HairError` if the surface cannot be read.
    """
    meters = simulated_world.meters_of(blender_scene, settings)
    surface = guides.surface
    if surface is None or surface.type != "MESH":
        raise HairError('"{name}" has no surface: attach the guides to a mesh.', name=name_of(guides))
    vertices = _vertices(surface, depsgraph, meters)
    places = stored_roots.places(guides, len(vertices))
    if places is None or not len(vertices):
        sentence = 'The guides "{name}" are not rooted on their current surface: comb or regenerate them.'
        raise HairError(sentence, name=name_of(guides))
    roots = np.einsum("nc,ncx->nx", places[1].astype(np.float64), vertices[places[0]])
    carrying = np.float32(np.concatenate([roots, *_bounds(vertices), _matrix(surface, depsgraph)[:3, :3]]))
    acting = _acting(guides, blender_scene, depsgraph, settings, meters)
    of_surface = frame_manifest.digest([len(vertices)])[:_LEVEL] + frame_manifest.digest(carrying)
    return of_surface[:_HALF] + frame_manifest.digest(acting)[:_HALF]


def change(baked, now, is_carried=False):
    """Return the part of the animation that differs from the digest of a baked frame, SURFACE or SURROUNDINGS, or
    None.

    is_carried: whether the surface's local coordinates have changed since; the first half of the digest is then
    ignored, as also after a change of its level of subdivision. `guide_baking.key_of` detects other faces.
    """
    is_other = is_carried or baked[:_LEVEL] != now[:_LEVEL]
    if baked == now or (is_other and baked[_HALF:] == now[_HALF:]):
        return None
    return SURROUNDINGS if is_other or baked[:_HALF] == now[:_HALF] else SURFACE


def _acting(guides, blender_scene, depsgraph, settings, meters):
    """Everything but the surface that acts on guides, as JSON values in single precision."""
    gravity = blender_scene.gravity if blender_scene.use_gravity else simulated_world.NO_GRAVITY
    colliders = [
        _collider(collider, depsgraph, settings, meters)
        for collider in simulated_world.colliders(settings.colliders)
        if not (settings.collides_with_surface and collider == guides.surface)
    ]
    fields, _refused = force_fields.read(depsgraph, meters)
    keyed = [getattr(settings, name) for name in sorted(properties.keyed_dynamics_of(guides.vellus))]
    if shared_wetness.is_keyed(guides.vellus):
        keyed += [style.is_on * mean_amount(style) for style in shared_wetness.masked_styles(guides.vellus)]
    acting_fields = [[_rounded(value) for value in asdict(one).values()] for one in fields]
    return [_rounded(gravity), colliders, acting_fields, [_rounded(value) for value in keyed]]


def _collider(collider, depsgraph, settings, meters):
    own = setting_properties.to_settings(collider.vellus, ColliderSettings)
    vertices = _vertices(collider, depsgraph, meters)
    bounds = np.concatenate(_bounds(vertices)).ravel() if len(vertices) else ()
    contact = (*contact_of(own, settings), own.is_double_sided)
    return [name_of(collider), len(vertices), _rounded(contact), _rounded(bounds)]


def _rounded(value):
    """Numbers, also in tuples, in single precision; strings and None unchanged."""
    if isinstance(value, str) or value is None:
        return value
    return np.float32(value).tolist()


def _vertices(mesh_object, depsgraph, meters):
    """Return (V, 3) float64 [m] in the world, of an evaluated mesh object."""
    local = scene.evaluated_positions(mesh_object, depsgraph)
    matrix = meters * _matrix(mesh_object, depsgraph)
    return local @ matrix[:, :3].T + matrix[:, 3]


def _matrix(mesh_object, depsgraph):
    return np.array(mesh_object.evaluated_get(depsgraph).matrix_world, np.float64)[:3]


def _bounds(vertices):
    return vertices.min(axis=0)[None], vertices.max(axis=0)[None]
