# SPDX-License-Identifier: GPL-3.0-or-later
"""Visibility of the world from strands and surfaces, as ambient cubes.

Opacity maps are drawn from 14 directions; each point sums their transmittances. The result changes with the
geometry, not with the light or the view.
"""

import gpu
import numpy as np

from ...core.imaging import ambient_cube
from . import drawing, shaders, shadows, uniforms
from .strand_textures import seen_points

# Environment light is soft: its maps are coarser than a lamp's, and drawn from as many strands as they can resolve.
# Fewer and thicker strands cover places less evenly, which lets more light through.
_SIZE = 256
_POINT_COUNT, _LEAST_STRANDS = 11, 10_000
_FULL_WIDTH = 0.5  # texels that a strand may be wide that is drawn for several
_DIRECTIONS_AT_ONCE = 7


def measure(hair, surfaces, opacities, clear=(), forwards=None):
    """Visibility textures {sampler: texture} of each strands and of each surface: two lists.

    hair: [(StrandsOnGPU, object to world)]; surfaces: [SurfaceOnGPU]; opacities: of each hair's strands, for which its
    visibility holds; the surfaces' is for the densest; clear: surfaces that hide nothing, which follow the others;
    forwards: what a strand of each hair passes on, (3,) each, None: the same of all channels, by the opacities.
    """
    receivers = [*surfaces, *clear]
    views = [_view_of_strands(strands, to_world) for strands, to_world in hair]
    views += [_view_of_surface(surface) for surface in receivers]
    if forwards is None:
        forwards = [np.full(3, 1.0 - opacity) for opacity in opacities]
    through = list(zip(opacities, forwards, strict=True))
    of_surfaces = through[densest([strands for strands, _ in hair])] if hair else (1.0, np.zeros(3))
    for view, (opacity, forward) in zip(views, through + [of_surfaces] * len(receivers), strict=True):
        view["seen_opacity"], view["hair_forward"][:3] = opacity, forward
    places = [strands.texture for strands, _ in hair] + [surface.places for surface in receivers]
    targets = [_Target(view, texture) for view, texture in zip(views, places, strict=True)]
    maps = shadows.ShadowMaps(_SIZE, _DIRECTIONS_AT_ONCE)
    steps = _steps(hair)
    for first in range(0, len(ambient_cube.DIRECTIONS), _DIRECTIONS_AT_ONCE):
        chosen = slice(first, first + _DIRECTIONS_AT_ONCE)
        lights = _suns(ambient_cube.DIRECTIONS[chosen], ambient_cube.WEIGHTS[chosen])
        maps.draw(lights, hair, [surface.batch for surface in surfaces], steps)
        for target in targets:
            target.add(lights, maps.samplers)
    textures = [target.textures for target in targets]
    return textures[: len(hair)], textures[len(hair) :]


def _steps(hair):
    """The `drawing.Steps` in which the maps are drawn of [(StrandsOnGPU, object to world)]."""
    if not hair:
        return drawing.Steps()
    texel = 2.0 * drawing.bounding_sphere(hair)[1] / _SIZE
    widths = [2.0 * strands.mean_radius * drawing.scale_of(to_world) for strands, to_world in hair]
    wanted = max(
        strands.strand_count * width / (_FULL_WIDTH * texel) for (strands, _), width in zip(hair, widths, strict=True)
    )
    return drawing.Steps(_POINT_COUNT, int(max(wanted, _LEAST_STRANDS)))


def densest(hair):
    """Index of the `StrandsOnGPU` with most strands: brows do not color the shadow of the hair beside them."""
    return max(range(len(hair)), key=lambda index: hair[index].strand_count)


def _suns(directions, weights):
    lights = uniforms.LIGHTS.record()
    lights["count"] = len(directions)
    chosen = lights["light"][: len(directions)]
    chosen["kind"], chosen["casts_shadow"] = shadows.SUN, True
    chosen["axis"][:, :3] = -directions
    # Each side is open to a sixth of the sphere.
    chosen["power"][:, 0] = 6.0 * weights
    return lights


def _view_of_strands(strands, to_world):
    view = uniforms.VIEW.record()
    view["object_to_world"] = to_world.T
    view["point_count"], view["row_strands"] = strands.point_count, strands.row_strands
    view["object_scale"] = drawing.scale_of(to_world)
    view["seen_points"] = seen_points(strands.point_count)
    return view


def _view_of_surface(surface):
    view = uniforms.VIEW.record()
    view["object_to_world"] = np.eye(4)
    view["point_count"], view["row_strands"] = 1, surface.row_corners
    view["seen_points"] = 1
    return view


class _Target:
    """Textures that visibility is added up in, a texel for each place."""

    def __init__(self, view, places):
        self.view, self.places = view, places
        size = int(view["row_strands"] * view["seen_points"]), places.height
        self.textures = {name: _texture(size) for name in shaders.VISIBILITY_SAMPLERS}
        self.framebuffer = gpu.types.GPUFrameBuffer(color_slots=tuple(self.textures.values()))
        with self.framebuffer.bind():
            self.framebuffer.clear(color=(0.0, 0.0, 0.0, 0.0))

    def add(self, lights, maps):
        with self.framebuffer.bind(), drawing.gpu_state("NONE", depth_writes=False, blend="ADDITIVE_PREMULT"):
            blocks = {"view": self.view, "lights": lights}
            drawing.draw_cover(shaders.visibility_program(), blocks, {"places": self.places, **maps})


def _texture(size):
    texture = gpu.types.GPUTexture(size, format="RGBA16F")
    texture.filter_mode(True)
    texture.extend_mode("EXTEND")
    return texture
