# SPDX-License-Identifier: GPL-3.0-or-later
"""The surfaces of a `drawn_scene.DrawnScene`: meshes on the GPU, which are seen, receive light or block light."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..data.pictures import drawn_meshes, viewport_shading
from ..gpu import scene_lights, surface_shading, surface_textures
from . import light_paths


@dataclass(frozen=True, eq=False)
class Blocker:
    """A surface that blocks light. owner: as in `scene_lights.Receiver`; source: its `DrawnMesh`, where light paths
    may be traced; is_seen: visible to cameras.
    """

    surface: surface_textures.SurfaceOnGPU
    owner: tuple
    source: drawn_meshes.DrawnMesh | None = None
    is_seen: bool = True

    @cached_property
    def mesh(self):
        """(corner positions, their normals, `triangle_materials`); normals are zero if they were not read."""
        source = self.source
        positions = source.positions
        normals = np.zeros_like(positions) if source.normals is None else source.corner_normals
        return positions, normals, source.triangle_materials


# Fields of a `DrawnScene` that `upload` fills.
FIELDS = ("surfaces", "clear", "receivers", "surface_owners", "blockers")


def read_shown(depsgraph, viewport, shown, is_shaded, grown_on, is_played, has_normals):
    """Return {name of `FIELDS`: value} for the surfaces that a viewport, or a render if it is None, shows.

    is_shaded: whether Vellus shades surfaces; grown_on: {session_uid} of the objects that hair grows on; is_played:
    during playback; has_normals: as in `drawn_meshes.read_drawn_meshes`; other parameters: as in `drawn_scene.read`.
    """
    meshes = drawn_meshes.read_drawn_meshes(depsgraph, viewport, is_played, has_normals)
    if is_shaded:
        meshes = drawn_meshes.split_clear(meshes)
    is_lit_by_scene = shown.light.kind == viewport_shading.SCENE
    surroundings = upload(meshes, is_shaded, has_paths=viewport is None or is_lit_by_scene)
    if not is_lit_by_scene:
        below = tuple(blocker for blocker in surroundings["blockers"] if blocker.owner[1] in grown_on)
        surroundings["blockers"] = below  # in Solid shading other surfaces cast no shadows
    return surroundings


def upload(meshes, is_shaded, has_paths):
    """Return {name of `FIELDS`: value} of `DrawnMesh`es.

    is_shaded: whether Vellus shades surfaces; has_paths: whether light paths may be traced against them.
    """
    uploaded, blockers, twins = {False: [], True: []}, [], {}
    for cache in (surface_textures.surface_cache, surface_textures.posed_cache):
        cache.make_room(len(meshes))
    surface_shading.baked_cache.make_room(
        2 * sum(material.is_baked for mesh in meshes for _n, material in mesh.materials)
    )
    for mesh in meshes:
        is_clear, surface = is_shaded and mesh.is_clear, _on_gpu(mesh, twins)
        if mesh.is_seen:
            places = scene_lights.places_on_surface(mesh.vertices, mesh.triangles, mesh.to_world)
            receiver = scene_lights.Receiver(mesh.owner[1::-1], places)
            uploaded[is_clear].append(((surface, mesh.parts), receiver, mesh.owner))
        if mesh.casts_shadow and not is_clear:
            blockers.append(Blocker(surface, mesh.owner[1::-1], mesh if has_paths else None, mesh.is_seen))
    solid, clear = uploaded.values()
    return {
        "surfaces": [surface for surface, _receiver, _owner in solid],
        "clear": tuple(surface for surface, _receiver, _owner in clear),
        "receivers": tuple(receiver for _surface, receiver, _owner in (*solid, *clear)),
        "surface_owners": tuple(owner for _surface, _receiver, owner in solid),
        "blockers": tuple(blockers),
    }


def _on_gpu(mesh, twins):
    """Return the `SurfaceOnGPU` of a `DrawnMesh`; unchanged data of the object's last `SurfaceOnGPU` is reused.

    twins: {shape: `SurfaceOnGPU`} of this scene, updated here: linked objects share its data.
    """
    key, cache = (mesh.owner[0], mesh.is_clear), surface_textures.surface_cache
    shape, known = (len(mesh.vertices), len(mesh.triangles)), cache.get(key)
    twin = twins.get(shape)
    if twin is not None and (known is None or known.places is not twin.places):
        known = twin if np.array_equal(mesh.vertices, twin.vertices) else known
    is_twin = known is not None and known is twin
    places = None if is_twin else surface_textures.known_places(mesh.owner[0], mesh.vertices)
    surface = surface_textures.upload_surface(
        mesh.vertices,
        mesh.triangles,
        mesh.normals,
        mesh.has_vertex_normals,
        mesh.uvs,
        mesh.colors,
        mesh.to_world,
        known,
        places,
    )
    twins.setdefault(shape, surface)
    return cache.keep(key, surface)


def needing_normals(blender_scene, viewport, shown, grown_on, is_moving):
    """Whether surfaces that Blender draws in a viewport need normals, or {session_uid} of those that do.

    Shadows of hair on surfaces need normals, and at rest light paths do. Blender computes normals for each pose.
    """
    if viewport.shading.type != "MATERIAL":
        return False if shown.is_wire else grown_on
    has_paths = light_paths.path_count(blender_scene, (1, 1)) > 0 and not is_moving
    return has_paths or blender_scene.vellus.has_preview_shadow


def lack_normals(drawn):
    """Whether surfaces of a `DrawnScene` were read without normals, because they moved."""
    return any(blocker.source is not None and blocker.source.normals is None for blocker in drawn.blockers)
