# SPDX-License-Identifier: GPL-3.0-or-later
"""The world of simulated guides in meters: gravity, colliders and force fields."""

import bpy
import numpy as np

from ....core import dynamics, geometry
from ....core.dynamics.collision.collider_settings import ColliderSettings, contact_of
from ....core.errors import HairError
from ...host import scene_time
from ...host.caches import Cache
from ...host.notices import name_of, text_of
from ...settings import setting_properties
from .. import scene
from . import force_fields

NO_GRAVITY = (0.0, 0.0, 0.0)

# (topology, fingerprint of the rest positions) of a surface → `closed_parts.open_parts`
parts_cache = Cache(capacity=16)


def meters_of(blender_scene, settings):
    """Meters per unit of the scene's world, for guides with these `DynamicsSettings`."""
    return blender_scene.unit_settings.scale_length * settings.size


def read(blender_scene, depsgraph, settings, guide_pose, surface_object, ways):
    """Return the `World` of guides in a depsgraph's frame, and errors of colliders and force fields that are left
    out.

    guide_pose: their `GuidePose` in that frame; surface_object: their surface; ways: (G, 3) from roots to the next
    points at rest, in local coordinates.
    """
    gravity = tuple(blender_scene.gravity) if blender_scene.use_gravity else NO_GRAVITY
    meters = meters_of(blender_scene, settings)
    obstacles, errors = [], []
    if settings.collides_with_surface:
        triangles = _facing_hair(guide_pose.pose.surface, guide_pose.places[0], ways)
        obstacles.append(_obstacle(surface_object, guide_pose.vertices, triangles, settings, meters))
    for collider in colliders(settings.colliders):
        if settings.collides_with_surface and collider == surface_object:
            continue
        try:
            vertices, triangles = _read_mesh(collider, depsgraph, meters)
        except HairError as error:
            errors.append(error)
            continue
        obstacles.append(_obstacle(collider, vertices, triangles, settings, meters))
    fields, refused = force_fields.read(depsgraph, meters)
    time = scene_time.time_of(blender_scene) / scene_time.animation_rate(blender_scene)
    return dynamics.simulation.World(gravity, tuple(obstacles), fields, time), errors + refused


def _facing_hair(surface, corners, ways):
    """Return (F, 3) triangles of a `Surface`; those of an open mesh are flipped if hair is behind them."""
    key = surface.topology, geometry.fingerprint.fingerprint(surface.rest)
    parts = parts_cache.get(key, lambda: dynamics.collision.closed_parts.open_parts(surface.mesh))
    return dynamics.collision.closed_parts.facing_hair(surface.mesh, parts, corners, surface.from_local(ways))


def _obstacle(mesh_object, vertices, triangles, settings, meters):
    own = setting_properties.to_settings(mesh_object.vellus, ColliderSettings)
    friction, distance = contact_of(own, settings)
    name = f"{name_of(mesh_object)} {mesh_object.session_uid}"
    return dynamics.simulation.Obstacle(name, vertices, triangles, friction, meters * distance, own.is_double_sided)


def require_colliders(settings, depsgraph):
    """Raise `HairError` if guides with these `DynamicsSettings` would not collide with all of their colliders."""
    problem = collider_problem(settings)
    if problem is not None:
        raise problem
    for collider in colliders(settings.colliders):
        if not collider.evaluated_get(depsgraph).is_evaluated:
            sentence = 'The collider "{name}" is not evaluated: show it in viewports, or remove it from "{collection}".'
            raise HairError(sentence, name=name_of(collider), collection=settings.colliders)


def collider_problem(settings):
    """Return the `HairError` of a collection of colliders that is missing or has no meshes, or None.

    settings: `DynamicsSettings`, or properties. No geometry is read.
    """
    name = text_of(settings, "colliders")
    if name and bpy.data.collections.get(name) is None:
        sentence = 'There is no collection "{name}" of colliders: pick another collection, or clear the field.'
        return HairError(sentence, name=name)
    if name and not colliders(name):
        sentence = 'The collection "{name}" has no meshes to collide with: add some, or clear the field.'
        return HairError(sentence, name=name)
    return None


def colliders(collection_name):
    """Return the mesh objects of the collection of this name."""
    collection = bpy.data.collections.get(collection_name) if collection_name else None
    return [] if collection is None else [o for o in collection.all_objects if o.type == "MESH"]


def _read_mesh(mesh_object, depsgraph, meters):
    """Return ((V, 3) float64 [m] in the world, (F, 3) int32) of an evaluated mesh object. Raises `HairError`."""
    surface = scene.read_surface(mesh_object, depsgraph)
    matrix = meters * np.array(mesh_object.evaluated_get(depsgraph).matrix_world, np.float64)[:3]
    return surface.posed @ matrix[:, :3].T + matrix[:, 3], surface.mesh.triangles
