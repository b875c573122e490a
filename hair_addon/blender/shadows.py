# SPDX-License-Identifier: GPL-3.0-or-later
"""Deep opacity maps [Yuksel08]: from each light, the front of the hair, its layers, and the front of the surfaces."""

import gpu
import numpy as np

from . import drawing, shaders

SHADOWED_LIGHTS = 4
SIZE = 512  # texels along a side of each map: on a head, 0.8 mm

SUN = 0  # LIGHT_SUN of shaders/include/lights.glsl

# Parts of the hair's diameter: how far apart a surface and itself may be, and how near a light may stand.
_SURFACE_BIAS = 0.01
_NEAREST = 0.01

_POINT_STEP = 2  # a shadow's outline needs half the points

_FAR = 1e4  # depth [m] of what no light meets; not more, as maps are filtered


class ShadowMaps:
    """Textures of every shadowed light and of the world's, made once and read until something moves."""

    def __init__(self):
        self._hair_front = _array("R32F")
        self._hair_layers = _array("RGBA16F")
        self._surface_front = _array("R32F")
        self._volume = _volume_textures(np.zeros((1, 1, 1, 6), np.float32))
        self._depth = gpu.types.GPUTexture((SIZE, SIZE), format="DEPTH_COMPONENT32F")

    @property
    def samplers(self):
        """{sampler: texture} for the shaders that receive shadows."""
        textures = (self._hair_front, self._hair_layers, self._surface_front)
        return dict(zip((*shaders.SHADOW_SAMPLERS, *shaders.VOLUME_SAMPLERS), (*textures, *self._volume), strict=True))

    def fill_volume(self, lights, volume):
        """Take over a `hair_volume.HairVolume`, and write its box into the lights' record."""
        lights["volume_low"][:3] = volume.low
        lights["volume_size"][:3] = volume.high - volume.low
        self._volume = _volume_textures(volume.counts)

    def draw(self, lights, hair, surfaces):
        """Draw the maps and write each light's part in them into its record.

        lights: a `uniforms.LIGHTS` record, changed; hair: [(StrandsOnGPU, object to world)]; surfaces: batches.
        """
        lights["light"]["shadow_layer"] = -1
        if not hair:
            return
        centre, radius = bounding_sphere(hair)
        for index in range(min(int(lights["count"]), SHADOWED_LIGHTS)):
            view = _aim(lights["light"][index], centre, radius)
            if view is not None:
                lights["light"][index]["shadow_layer"] = index
                view["light_index"] = index
                self._draw_light(index, view, lights, hair, surfaces)

    def _draw_light(self, layer, view, lights, hair, surfaces):
        front = drawing.Shading(shaders.strand_program("shadow_front.frag", shadow_samplers=()))
        layers = drawing.Shading(shaders.strand_program("shadow_layers.frag", shadow_samplers=("hair_front",)))
        with self._target(self._surface_front, layer, _FAR), drawing.gpu_state("LESS_EQUAL", depth_writes=True):
            for surface in surfaces:
                drawing.draw_surface_depth(surface, view, lights)
        with self._target(self._hair_front, layer, _FAR), drawing.gpu_state("LESS_EQUAL", depth_writes=True):
            for strands, to_world in hair:
                drawing.draw_strands(strands, front, view, lights, to_world, point_step=_POINT_STEP)
        with (
            self._target(self._hair_layers, layer, 0.0),
            drawing.gpu_state("NONE", depth_writes=False, blend="ADDITIVE_PREMULT"),
        ):
            for strands, to_world in hair:
                drawing.draw_strands(
                    strands, layers, view, lights, to_world, {"hair_front": self._hair_front}, _POINT_STEP
                )

    def _target(self, texture, layer, value):
        framebuffer = gpu.types.GPUFrameBuffer(color_slots={"texture": texture, "layer": layer}, depth_slot=self._depth)
        return _cleared(framebuffer, value)


class _cleared:
    """Bind a framebuffer, all its channels set to one value."""

    def __init__(self, framebuffer, value):
        self.binding, self.framebuffer, self.value = framebuffer.bind(), framebuffer, value

    def __enter__(self):
        self.binding.__enter__()
        self.framebuffer.clear(color=(self.value,) * 4, depth=1.0)

    def __exit__(self, *error):
        return self.binding.__exit__(*error)


def _array(texture_format):
    texture = gpu.types.GPUTexture((SIZE, SIZE), layers=SHADOWED_LIGHTS, format=texture_format)
    texture.filter_mode(True)
    texture.extend_mode("EXTEND")
    return texture


def _volume_textures(counts):
    """(D, H, W, 6) counts → textures of the sides along x and y, and along z."""
    depth, height, width, _sides = counts.shape
    along_z = np.zeros((depth, height, width, 4), np.float32)
    along_z[..., :2] = counts[..., 4:]
    textures = []
    for texels in (np.ascontiguousarray(counts[..., :4]), along_z):
        data = gpu.types.Buffer("FLOAT", texels.size, texels.ravel())
        texture = gpu.types.GPUTexture((width, height, depth), format="RGBA16F", data=data)
        texture.filter_mode(True)
        texture.extend_mode("EXTEND")
        textures.append(texture)
    return textures


def bounding_sphere(hair):
    """Centre (3,) and radius [m] of a sphere around all strands; hair: [(StrandsOnGPU, object to world)]."""
    corners = []
    for strands, to_world in hair:
        box = np.array(np.meshgrid(*strands.bounds.T)).reshape(3, -1).T
        corners.append(box @ to_world[:3, :3].T + to_world[:3, 3])
    corners = np.concatenate(corners)
    centre = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    return centre, float(np.linalg.norm(corners - centre, axis=1).max())


def _aim(light, centre, radius):
    """The view of a light that holds the sphere of the hair, also written into the light; None from inside it."""
    position = light["position"][:3].astype(np.float64)
    is_sun = light["kind"] == SUN
    axis = light["axis"][:3].astype(np.float64) if is_sun else centre - position
    distance = float(np.linalg.norm(axis))
    if not is_sun and distance < 1.01 * radius:
        return None
    eye = centre - axis * (2.0 * radius) if is_sun else position
    world_to_view = _look_at(eye, axis / distance)
    view_to_clip = _orthographic(radius) if is_sun else _perspective(radius, distance)
    view = drawing.view_record(world_to_view, view_to_clip, SIZE, least_width=1.0)
    light["world_to_shadow"] = view["world_to_clip"]
    light["extent"] = 2.0 * radius
    light["surface_bias"] = 2.0 * radius * _SURFACE_BIAS
    return view


def _look_at(eye, forward):
    """(4, 4) world to view of a camera at `eye` that looks along a unit vector, -Z of the view."""
    helper = np.array([0.0, 0.0, 1.0]) if abs(forward[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    right = np.cross(forward, helper)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = right, np.cross(right, forward), -forward
    matrix[:3, 3] = -matrix[:3, :3] @ eye
    return matrix


def _orthographic(radius):
    """(4, 4) view to clip of a cube around a sphere two radii ahead; what stands before it still casts."""
    return np.array([[1 / radius, 0, 0, 0], [0, 1 / radius, 0, 0], [0, 0, -0.1 / radius, -0.8], [0, 0, 0, 1.0]])


def _perspective(radius, distance):
    """(4, 4) view to clip of a cone around a sphere; what stands before it still casts."""
    cotangent = np.sqrt(distance**2 - radius**2) / radius
    near, far = _NEAREST * 2.0 * radius, distance + 4.0 * radius
    depth_scale, depth_offset = (far + near) / (near - far), 2.0 * far * near / (near - far)
    return np.array([[cotangent, 0, 0, 0], [0, cotangent, 0, 0], [0, 0, depth_scale, depth_offset], [0, 0, -1.0, 0]])
