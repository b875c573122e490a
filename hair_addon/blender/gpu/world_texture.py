# SPDX-License-Identifier: GPL-3.0-or-later
"""The world's image on the GPU: as a background, and decomposed into lights."""

from dataclasses import dataclass, replace

import gpu
import numpy as np

from ...core import geometry
from ...core.errors import HairError
from ...core.imaging import environment
from ..host.caches import Cache
from . import drawing
from .programs import scene_programs, uniforms
from .studio_lights import StudioImage

_HEIGHT = 64  # pixels of the picture that is decomposed
_MOST_TAPS = 32

light_cache = Cache(capacity=1)  # World.key → _ImageLight
studio_cache = Cache(capacity=8)  # StudioImage → the result of `environment.decompose`
turned_cache = Cache(capacity=8)  # (StudioImage, axes as bytes) → the result of `environment.turned`


@dataclass
class _ImageLight:
    """Light of a world's image, and the pixels it was computed from."""

    light: tuple  # the result of `environment.split`
    pixels: str  # their fingerprint
    is_checked: bool = True  # whether Blender has reported no change of the image since


def light_of(world):
    """Return ([`environment.Lobe`, ...], (6, 3) mean radiance of the sides) of a `lights.World`."""
    if world.image is None:
        return [], np.broadcast_to(world.color, (6, 3))
    if isinstance(world.image, StudioImage):
        return _light_of_studio(world)
    known = light_cache.get(world.key)
    # Blender does not report changes of an image by a script: an unsaved image may change at any time.
    if known is None or not known.is_checked or world.image.is_dirty:
        pixels = _pixel_fingerprint(world.image)
        if known is None or known.pixels != pixels:
            known = light_cache.keep(world.key, _ImageLight(environment.split(_unrolled(world)), pixels))
        known.is_checked = True
    return known.light


def _light_of_studio(world):
    """`light_of` a studio light. Its lobes are found once, so that they turn with it."""
    even = replace(world, color=np.ones(3), to_image=np.eye(4))
    known = studio_cache.get(world.image, lambda: environment.decompose(_unrolled(even)))
    axes = world.to_image[:3, :3]
    lobes, sides = turned_cache.get((world.image, axes.tobytes()), lambda: environment.turned(*known, axes))
    return [replace(lobe, irradiance=world.color * lobe.irradiance) for lobe in lobes], world.color * sides


def picture_of(world):
    """Return (H, W, 3) radiance of a `lights.World`, in the projection of core/imaging/environment.py."""
    if world.image is None:
        return np.asarray(world.color, float).reshape(1, 1, 3)
    return _unrolled(world)


def check_image():
    """Compare the pixels of the world's image on the next read, as they may have changed."""
    for known in light_cache.values():
        known.is_checked = False


def _pixel_fingerprint(image):
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return geometry.fingerprint.fingerprint(pixels)


def draw_background(world, view, width, height):
    """Fill the bound framebuffer with the world in a view of this size [pixels]."""
    record = _record(world, width, height)
    record["clip_to_world"] = np.linalg.inv(view["world_to_clip"].astype(np.float64))
    with drawing.gpu_state("NONE", depth_writes=False):
        _draw("light/background.frag", world, record)


def _unrolled(world):
    """Return (H, W, 3) radiance for `environment.split`."""
    width, height = 2 * _HEIGHT, _HEIGHT
    record = _record(world, width, height)
    record["taps"] = np.clip(-(-max(world.image.size) // width), 2, _MOST_TAPS)
    target = gpu.types.GPUTexture((width, height), format="RGBA32F")
    framebuffer = gpu.types.GPUFrameBuffer(color_slots=target)
    with framebuffer.bind(), drawing.gpu_state("NONE", depth_writes=False):
        _draw("light/environment.frag", world, record)
        pixels = framebuffer.read_color(0, 0, width, height, 4, 0, "FLOAT")
    return np.nan_to_num(np.array(pixels, np.float32).reshape(height, width, 4)[..., :3], posinf=0.0)


def _record(world, width, height):
    record = uniforms.ENVIRONMENT.record()
    record["to_image"] = world.to_image.T
    record["color"][:3] = world.color
    record["size"][:2] = width, height
    record["is_mirror_ball"] = world.is_mirror_ball
    return record


def _draw(fragment, world, record):
    if isinstance(world.image, StudioImage):
        picture = world.image.panorama()
    else:
        picture = _texture_of(world)
    drawing.draw_cover(scene_programs.environment_program(fragment), {"environment": record}, {"surroundings": picture})


def _texture_of(world):
    try:
        return gpu.texture.from_image(world.image)
    except RuntimeError as error:
        sentence = 'The image "{name}" of the world cannot be read: {error}.'
        raise HairError(sentence, name=world.image.name, error=error) from error
