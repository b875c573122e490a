# SPDX-License-Identifier: GPL-3.0-or-later
"""All that a picture is drawn of, on the GPU: hair, the surfaces around it, lights and their shadow maps."""

from dataclasses import dataclass

import numpy as np

from ..core import hair_volume
from ..core.errors import HairError
from ..core.mesh import TriMesh, positions
from ..core.sampling import sample_surface
from . import drawing, hair_cache, scene, uniforms
from .shadows import ShadowMaps

_VOLUME_STRANDS = 20_000
_PLACES_PER_MESH = 50_000


@dataclass(frozen=True)
class DrawnScene:
    """Read once by `read`, drawn from any number of views until something moves."""

    hair: list  # (StrandsOnGPU, Shading, object to world, linear RGB of the surface it grows on)
    surfaces: list  # (batch of triangles, linear RGB)
    lights: np.ndarray  # uniforms.LIGHTS
    world_radiance: np.ndarray
    shadow_maps: ShadowMaps | None  # None in a viewport without hair


def read(blender_scene, view_layer, depsgraph, viewport=None, refused=None):
    """Bring a scene to the GPU and draw its shadow maps.

    viewport: the 3-D viewport whose visibility counts, None for a render; refused: called with the datablock and the
    `HairError` of hair that cannot be drawn, which otherwise is raised.
    """
    hair = []
    for hair_object in scene.curves_objects(view_layer, "HAIR", viewport):
        if viewport is not None and not hair_object.data.vellus.is_drawn:
            continue
        try:
            strands, shading = hair_cache.hair_on_gpu(hair_object.data)
        except HairError as error:
            if refused is None:
                raise
            refused(hair_object.data, error)
            continue
        if strands is not None:
            color = scene.surface_color(hair_object.data.surface)
            hair.append((strands, shading, np.array(hair_object.matrix_world, np.float64), color))
    if viewport is not None and not hair:
        # Blender draws the rest by itself: a scene without hair pays nothing for the add-on.
        return DrawnScene([], [], uniforms.LIGHTS.record(), np.zeros(3), None)
    meshes = scene.read_drawn_meshes(depsgraph, for_render=viewport is None)
    surfaces = [(drawing.upload_surface(mesh.positions, mesh.normals), mesh.color) for mesh in meshes]
    lights = scene.read_lights(depsgraph, for_render=viewport is None)
    shadow_maps = ShadowMaps()
    placed = [(strands, to_world) for strands, _, to_world, _ in hair]
    shadow_maps.draw(lights, placed, [batch for batch, _ in surfaces])
    if placed:
        shadow_maps.fill_volume(lights, _volume(placed, meshes))
    return DrawnScene(hair, surfaces, lights, scene.read_world_radiance(blender_scene), shadow_maps)


def _volume(placed, meshes):
    """`HairVolume` of [(StrandsOnGPU, object to world)] among meshes."""
    starts, ends, widths = [], [], []
    for strands, to_world in placed:
        # A part of the strands, each as thick as all that it stands for, is as good a cloud.
        step = -(-strands.strand_count // _VOLUME_STRANDS)
        points = strands.points[::step] @ to_world[:3, :3].T + to_world[:3, 3]
        radii = strands.radii[::step] * (drawing.scale_of(to_world) * strands.strand_count / len(points))
        starts.append(points[:, :-1].reshape(-1, 3))
        ends.append(points[:, 1:].reshape(-1, 3))
        widths.append((radii[:, :-1] + radii[:, 1:]).ravel())
    solid = [np.empty((0, 3)), *map(_places_on, meshes)]
    return hair_volume.measure(*map(np.concatenate, (starts, ends, widths, solid)))


def _places_on(mesh):
    """(M, 3) places all over a `DrawnMesh`, close enough together to leave no hole in a volume's cells."""
    triangles = TriMesh(mesh.positions, np.arange(len(mesh.positions), dtype=np.int32).reshape(-1, 3))
    if not np.any(triangles.areas > 0.0):
        return np.empty((0, 3))
    return positions(triangles, sample_surface(triangles, _PLACES_PER_MESH, seed=0))


def draw_hair_depth(drawn, view):
    """Draw the depth of all hair into the bound framebuffer, before anything is shaded.

    Strands overlap many times, so with many samples a pixel it pays to shade only what stays visible; with one sample a
    pixel a second pass over the strands costs more than it saves.
    """
    with drawing.gpu_state("LESS_EQUAL", depth_writes=True):
        for strands, _shading, to_world, _color in drawn.hair:
            drawing.draw_strands(strands, drawing.depth_only(), view, drawn.lights, to_world)


def draw_hair(drawn, view):
    """Draw all hair with depth test into the bound framebuffer; view: a `uniforms.VIEW` record."""
    view["world_radiance"][:3] = drawn.world_radiance
    with drawing.gpu_state("LESS_EQUAL", depth_writes=True):
        for strands, shading, to_world, color in drawn.hair:
            drawing.draw_strands(
                strands, shading, view, drawn.lights, to_world, drawn.shadow_maps.samplers, surface_color=color
            )


def draw_surfaces(drawn, view):
    """Draw all surfaces with depth test into the bound framebuffer."""
    view["world_radiance"][:3] = drawn.world_radiance
    # The hair's shadow on a surface takes the first hair's colour: one colour a draw call.
    view["hair_forward"][:3] = drawn.hair[0][1].forward if drawn.hair else 0.0
    with drawing.gpu_state("LESS_EQUAL", depth_writes=True):
        for batch, color in drawn.surfaces:
            drawing.draw_surface(batch, color, view, drawn.lights, drawn.shadow_maps.samplers)
