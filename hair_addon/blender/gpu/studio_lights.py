# SPDX-License-Identifier: GPL-3.0-or-later
"""Studio lights of viewports: lamps of Solid shading, panoramas of Material Preview, images of matcaps."""

from dataclasses import dataclass
from pathlib import Path

import bpy
import gpu
import numpy as np

from ...core.errors import HairError
from ...core.files import light_images
from ...core.imaging import lamps
from ..host.caches import Cache
from .programs import uniforms

_MOST_WRAP = 0.5  # the greatest softness of a lamp: of softer lights a part is ambient light
_DIMMED_BEHIND = 0.85  # hair lets light from behind through, which the opaque surfaces that lights are made for do not
_LEAST_DIFFUSE = 1e-3  # least diffuse color relative to the specular color, as highlights are relative to other light

_LARGEST_HALF = 65504.0

image_cache = Cache(capacity=8)  # StudioImage → {layer: (H, W, 3)}
texture_cache = Cache(capacity=8)  # (StudioImage, whether as a matcap) → texture


def lamps_of(lights, has_highlights):
    """Return ((N,) `uniforms.LIGHT` records, (3,) ambient radiance) of `viewport_shading.StudioLight`s.

    A diffuse surface of albedo 1 that faces a light has its diffuse color as radiance: the irradiance is pi times the
    color. A light with softness w reaches a surface at an angle a by max(cos(a) + w, 0) / (1 + w)², which has the total
    of a clamped cosine and 1 - w / 2 of its mean direction: light that is spread by a variance of w / 2 [rad²].
    """
    found, ambient = np.zeros(len(lights), uniforms.LIGHT.dtype), np.zeros(3)
    for lamp, light in zip(found, lights, strict=True):
        diffuse, specular = np.array(light.diffuse), np.array(light.specular)
        diffuse = np.maximum(diffuse, _LEAST_DIFFUSE * specular)
        sun_part = min(1.0, (1.0 - 0.5 * light.wrap) / (1.0 - 0.5 * _MOST_WRAP))
        lamp["kind"], lamp["casts_shadow"] = lamps.SUN, True
        lamp["axis"][:3] = -np.array(light.direction)
        lamp["power"][:3] = sun_part * np.pi * diffuse
        lamp["radius"] = np.sqrt(2.0 * min(light.wrap, _MOST_WRAP))  # a disk's variance is a quarter of its radius²
        highlight = specular.sum() / max(diffuse.sum(), 1e-6) / sun_part if has_highlights else 0.0
        lamp["highlight_excess"], lamp["dimmed_behind"] = highlight - 1.0, _DIMMED_BEHIND
        ambient += (1.0 - sun_part) * 0.25 * diffuse
    return found, ambient


@dataclass(frozen=True)
class StudioImage:
    """The image of a studio light, with the attributes of Blender's images that worlds use."""

    path: str
    changed: int  # time of the file's last change [ns]
    is_dirty: bool = False

    @property
    def layers(self):
        """{name: (H, W, 3) scene-linear colors}."""
        return image_cache.get(self, lambda: _read(self.path))

    @property
    def size(self):
        """(width, height) [pixels]."""
        return next(iter(self.layers.values())).shape[1::-1]

    def panorama(self):
        """Return the texture of the first layer, which repeats."""
        return texture_cache.get((self, False), lambda: _texture(next(iter(self.layers.values())), "REPEAT"))

    def matcap(self):
        """Return the texture of a matcap: its highlights above its diffuse light."""
        return texture_cache.get((self, True), lambda: _texture(_stacked(self.layers), "EXTEND"))


def image_of(path):
    """Return the `StudioImage` of a file. Raises `HairError` if it is missing."""
    try:
        return StudioImage(path, Path(path).stat().st_mtime_ns)
    except OSError as error:
        raise HairError("The image {path} of the studio light is missing: pick another light.", path=path) from error


def _read(path):
    if path.lower().endswith(".exr"):
        return light_images.read_layers(path)
    bpy.utils.expose_bundled_modules()
    try:
        import OpenImageIO as oiio
    except ImportError as error:
        raise HairError("{path} cannot be read: use a studio light in the format OpenEXR.", path=path) from error
    image = oiio.ImageBuf(path)
    if image.has_error or image.nchannels < 3:
        raise HairError("{path} cannot be read: pick another studio light.", path=path)
    if image.spec().format.basetype == oiio.UINT8:
        image = oiio.ImageBufAlgo.colorconvert(image, "sRGB", "linear")
    pixels = np.asarray(image.get_pixels(oiio.FLOAT), np.float32)[::-1, :, :3]
    return {"": np.ascontiguousarray(pixels)}


def _stacked(layers):
    diffuse = layers.get("diffuse", next(iter(layers.values())))
    specular = layers.get("specular")
    if specular is None or specular.shape != diffuse.shape:
        specular = np.zeros_like(diffuse)
    return np.concatenate([diffuse, specular])


def _texture(pixels, extension):
    height, width = pixels.shape[:2]
    texels = np.ones((height, width, 4), np.float32)
    texels[..., :3] = pixels
    data = gpu.types.Buffer("FLOAT", texels.size, texels.ravel())
    texture = gpu.types.GPUTexture((width, height), format=_format_of(pixels), data=data)
    texture.filter_mode(True)
    texture.extend_mode(extension)
    return texture


def _format_of(pixels):
    return "RGBA16F" if float(pixels.max()) < _LARGEST_HALF else "RGBA32F"  # a sun's disk is brighter
