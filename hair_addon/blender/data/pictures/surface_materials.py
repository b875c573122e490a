# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of the surfaces drawn around hair: base color, roughness, reflectance, and images of these."""

from dataclasses import dataclass, replace

import numpy as np
from mathutils import Euler, Matrix

from ...host.notices import name_of, say
from .shader_sockets import LUMINANCE, ShaderInput, shown_shader

_CHANNELS = {
    "Red": (1.0, 0.0, 0.0, 0.0),
    "Green": (0.0, 1.0, 0.0, 0.0),
    "Blue": (0.0, 0.0, 1.0, 0.0),
    "Alpha": (0.0, 0.0, 0.0, 1.0),
}

# Extension modes of Blender's images → those of GPU textures.
_EXTENSIONS = {"REPEAT": "REPEAT", "EXTEND": "EXTEND", "CLIP": "CLAMP_TO_BORDER", "MIRROR": "MIRRORED_REPEAT"}


@dataclass(frozen=True)
class ImageMap:
    """An image of a material: an image of Blender or a `surface_bakes.BakedPicture`.

    uv_map: name of its UV map, "" for the active UV map; rows: (2, 3) float, from (u, v, 1) to coordinates of
    the image; channels: (4,) weights of RGBA for an image that is read as a number; extension: of a GPU texture;
    is_opaque: whether alpha does not darken the color.
    """

    image: object
    uv_map: str
    rows: np.ndarray
    channels: tuple
    extension: str
    is_smooth: bool
    is_opaque: bool


@dataclass(frozen=True)
class SurfaceMaterial:
    """Inputs of a Principled BSDF. color: linear RGB; reflectance: of non-metals at normal incidence.

    is_clear: whether the surface lets light through, like glass or a cornea, and only shows its reflections.
    """

    color: tuple = (0.8, 0.8, 0.8)
    roughness: float = 1.0
    metallic: float = 0.0
    reflectance: float = 0.0
    normal_strength: float = 1.0
    is_clear: bool = False
    color_image: ImageMap | None = None
    roughness_image: ImageMap | None = None
    normal_image: ImageMap | None = None
    name: str = ""  # of the Blender material, "" for none
    index: int = 0  # its pass index
    is_baked: bool = False  # whether its images have the UVs of a `surface_bakes.Bake`

    @property
    def is_invisible(self):
        """Whether the surface is not visible at all."""
        return self.is_clear and self.reflectance == 0.0

    @property
    def uv_map(self):
        """Name of the UV map of all images, "" for the active one; None without images."""
        images = (self.color_image, self.roughness_image, self.normal_image)
        return next((image.uv_map for image in images if image is not None), None)


def read_material(material):
    """Return the `SurfaceMaterial` of a Blender material; matte with its viewport color without a shader of
    `_READERS`.

    None is a Principled BSDF with default values, as in EEVEE and Cycles.
    """
    if material is None:
        return SurfaceMaterial(roughness=0.5, reflectance=_reflectance(1.5, 0.5))
    shader = shown_shader(material.node_tree, _READERS)
    if shader is None:
        found = SurfaceMaterial(tuple(material.diffuse_color[:3]))
    else:
        found = _READERS[shader.type](shader, material)
    return replace(found, name=material.name, index=material.pass_index)


def _read_principled(sockets, material):
    if float(sockets["Alpha"].value()) < 0.5:
        return _INVISIBLE
    normal_map = sockets["Normal"].source()[0]
    is_mapped = normal_map is not None and normal_map.type == "NORMAL_MAP" and normal_map.node.space == "TANGENT"
    return SurfaceMaterial(
        tuple(sockets["Base Color"].value()[:3]),
        float(sockets["Roughness"].value()),
        float(sockets["Metallic"].value()),
        _reflectance(float(sockets["IOR"].value()), float(sockets["Specular IOR Level"].value())),
        float(normal_map["Strength"].value()) if is_mapped else 1.0,
        float(sockets["Transmission Weight"].value()) > 0.5,
        _image_map(sockets["Base Color"], material),
        _image_map(sockets["Roughness"], material),
        _image_map(normal_map["Color"], material, normal_map.node.uv_map) if is_mapped else None,
    )


def _read_diffuse(sockets, material):
    color, image = tuple(sockets["Color"].value()[:3]), _image_map(sockets["Color"], material)
    return SurfaceMaterial(color, color_image=image)


def _read_glass(sockets, _material):
    reflectance = _reflectance(float(sockets["IOR"].value()), 0.5)
    return SurfaceMaterial(roughness=float(sockets["Roughness"].value()), reflectance=reflectance, is_clear=True)


def _read_transparent(_sockets, _material):
    return _INVISIBLE


_INVISIBLE = SurfaceMaterial(is_clear=True)
_READERS = {
    "BSDF_PRINCIPLED": _read_principled,
    "BSDF_DIFFUSE": _read_diffuse,
    "BSDF_GLASS": _read_glass,
    "BSDF_REFRACTION": _read_transparent,  # refraction itself is not drawn
    "BSDF_TRANSPARENT": _read_transparent,
}


class _Noted:
    """A `ShaderNode` that records the names of the inputs that a reader reads."""

    def __init__(self, sockets):
        self._sockets, self.names = sockets, []

    def __getitem__(self, name):
        self.names.append(name)
        return _WithoutNodes(self._sockets[name].socket, self._sockets[name].groups)


class _WithoutNodes(ShaderInput):
    """A `ShaderInput` without the nodes before it, so that files of images are not loaded."""

    def source(self):
        return None, None


def inputs_read(sockets, material):
    """Return the names of the inputs that the reader of a `ShaderNode` reads; None for types without a reader."""
    if sockets.type not in _READERS:
        return None
    noted = _Noted(sockets)
    _READERS[sockets.type](noted, material)
    return list(dict.fromkeys(noted.names))


def _reflectance(refractive_index, level):
    """Reflectance at normal incidence; level: a factor, 1 at ½."""
    return min(2.0 * level * ((refractive_index - 1.0) / (refractive_index + 1.0)) ** 2, 0.99)


def _image_map(shader_input, material, uv_map=""):
    """Return the `ImageMap` that is linked to a `ShaderInput`, directly or by one of its channels; or None."""
    found, output = shader_input.source()
    channels = LUMINANCE
    if found is not None and found.type == "SEPARATE_COLOR" and found.node.mode == "RGB":
        channels = _CHANNELS[output.name]
        found, output = found["Color"].source()
    if found is None or found.type != "TEX_IMAGE" or found.node.image is None:
        return None
    node = found.node
    if output.name == "Alpha":
        channels = _CHANNELS["Alpha"]
    if not _is_readable(node.image, material):
        return None
    mapping = _mapping(found["Vector"])
    if mapping is None:
        say(f'The texture coordinates of "{name_of(material)}" are not UV coordinates: it is drawn without its image.')
        return None
    rows, own_map = mapping
    extension, is_smooth = _EXTENSIONS[node.extension], node.interpolation != "Closest"
    # Blender multiplies colors by straight alpha, unless a material reads the alpha.
    is_opaque = node.outputs["Alpha"].is_linked or node.image.is_float or node.image.alpha_mode != "STRAIGHT"
    return ImageMap(node.image, own_map or uv_map, rows, channels, extension, is_smooth, is_opaque)


def reads_image(shader_input):
    """Whether a `ShaderInput` reads an image that `read_material` reads, or a movie or sequence, which is not baked.

    The file is not loaded.
    """
    found, _output = shader_input.source()
    if found is not None and found.type == "SEPARATE_COLOR" and found.node.mode == "RGB":
        found, _output = found["Color"].source()
    if found is None or found.type != "TEX_IMAGE":
        return False
    image = found.node.image
    if image is None or image.source in {"SEQUENCE", "MOVIE"}:
        return True
    return image.source != "TILED" and _mapping(found["Vector"]) is not None


def _is_readable(image, material):
    """Whether an image has pixels of a single picture; if not, print a message; UDIM tiles are baked instead."""
    if image.source == "TILED":
        return False
    if image.source not in {"FILE", "GENERATED"}:
        say(f'"{name_of(image)}" is not a single picture: "{name_of(material)}" is drawn in its plain color.')
    elif not all(image.size):  # the access loads the file if necessary
        say(f'The image "{name_of(image)}" is missing: "{name_of(material)}" is drawn in its plain color.')
    else:
        return True
    return False


def _mapping(vector):
    """Return ((2, 3) rows, name of the UV map) of a texture's coordinates, a `ShaderInput`; None if they are not
    UVs.
    """
    found, output = vector.source()
    if found is None:  # a constant set by a group is a single point
        return None if vector.socket.is_linked else (np.eye(2, 3), "")
    node = found.node
    if node.type == "UVMAP":
        return np.eye(2, 3), node.uv_map
    if node.type == "TEX_COORD":
        return (np.eye(2, 3), "") if output.name == "UV" else None
    if node.type != "MAPPING" or node.vector_type not in {"POINT", "TEXTURE"}:
        return None
    inner = _mapping(found["Vector"]) if found["Vector"].source()[0] is not None else None
    # The location of a Mapping node of type Vector is hidden.
    inputs = {socket.identifier: ShaderInput(socket, found.groups).constant() for socket in node.inputs}
    values = [inputs.get(name) for name in ("Location", "Rotation", "Scale")]
    if inner is None or any(value is None for value in values):
        return None
    placed = Matrix.LocRotScale(values[0], Euler(values[1]), values[2])
    matrix = np.array(placed, np.float64)
    if node.vector_type == "TEXTURE":
        matrix = np.linalg.pinv(matrix)
    plane = matrix[np.ix_((0, 1, 3), (0, 1, 3))]
    return (plane @ np.vstack([inner[0], (0.0, 0.0, 1.0)]))[:2], inner[1]
