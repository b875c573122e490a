# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of surfaces as they are drawn around hair: base color, roughness, reflectance, and images of these."""

from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Euler, Matrix

from ...host.notices import name_of, say

_LUMINANCE = (0.2126, 0.7152, 0.0722, 0.0)  # Rec. 709: a color that is read as a number
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
    """An image of a material: which UV map it lies on, "" for the active one, and where.

    rows: (2, 3) float, from (u, v, 1) to coordinates of the image; channels: weights (4,) of RGBA where it is read as a
    number; extension: of a GPU texture; is_opaque: whether its alpha does not darken its color.
    """

    image: bpy.types.Image
    uv_map: str
    rows: np.ndarray
    channels: tuple
    extension: str
    is_smooth: bool
    is_opaque: bool


@dataclass(frozen=True)
class SurfaceMaterial:
    """Inputs of a Principled BSDF. color: linear RGB; reflectance: at normal incidence, of all but metal.

    is_clear: whether it lets light through, as glass or a cornea does: it is seen by what it reflects.
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

    @property
    def is_invisible(self):
        """Whether it is not seen at all."""
        return self.is_clear and self.reflectance == 0.0

    @property
    def uv_map(self):
        """Name of the UV map of all its images, "" for the active one; None without images."""
        images = (self.color_image, self.roughness_image, self.normal_image)
        return next((image.uv_map for image in images if image is not None), None)


def read_material(material):
    """The `SurfaceMaterial` of a Blender material; without a shader of `_READERS` it is matt, of its viewport's color.

    Without a material a surface has a Principled BSDF as it is added, as in EEVEE and Cycles.
    """
    if material is None:
        return SurfaceMaterial(roughness=0.5, reflectance=_reflectance(1.5, 0.5))
    shader = _shader(material.node_tree)
    if shader is None:
        return SurfaceMaterial(tuple(material.diffuse_color[:3]))
    return _READERS[shader.type](shader.inputs, material)


def _read_principled(sockets, material):
    if float(_value(sockets["Alpha"])) < 0.5:
        return _INVISIBLE
    normal_map = _source(sockets["Normal"])[0]
    is_mapped = normal_map is not None and normal_map.type == "NORMAL_MAP" and normal_map.space == "TANGENT"
    return SurfaceMaterial(
        tuple(_value(sockets["Base Color"])[:3]),
        float(_value(sockets["Roughness"])),
        float(_value(sockets["Metallic"])),
        _reflectance(float(_value(sockets["IOR"])), float(_value(sockets["Specular IOR Level"]))),
        float(_value(normal_map.inputs["Strength"])) if is_mapped else 1.0,
        float(_value(sockets["Transmission Weight"])) > 0.5,
        _image_map(sockets["Base Color"], material),
        _image_map(sockets["Roughness"], material),
        _image_map(normal_map.inputs["Color"], material, normal_map.uv_map) if is_mapped else None,
    )


def _read_diffuse(sockets, material):
    color, image = tuple(_value(sockets["Color"])[:3]), _image_map(sockets["Color"], material)
    return SurfaceMaterial(color, color_image=image)


def _read_glass(sockets, _material):
    reflectance = _reflectance(float(_value(sockets["IOR"])), 0.5)
    return SurfaceMaterial(roughness=float(_value(sockets["Roughness"])), reflectance=reflectance, is_clear=True)


def _read_transparent(_sockets, _material):
    return _INVISIBLE


_INVISIBLE = SurfaceMaterial(is_clear=True)
_READERS = {
    "BSDF_PRINCIPLED": _read_principled,
    "BSDF_DIFFUSE": _read_diffuse,
    "BSDF_GLASS": _read_glass,
    "BSDF_REFRACTION": _read_transparent,  # which it is without what it bends
    "BSDF_TRANSPARENT": _read_transparent,
}


def _reflectance(refractive_index, level):
    """Reflectance at normal incidence; level: ½ leaves it as it is."""
    return min(2.0 * level * ((refractive_index - 1.0) / (refractive_index + 1.0)) ** 2, 0.99)


def _shader(tree):
    """The shader that a material shows, if it can be read; or its first Principled BSDF; or None."""
    if tree is None:
        return None
    output = tree.get_output_node("ALL")
    shown = _source(output.inputs["Surface"])[0] if output else None
    if shown is not None and shown.type in _READERS:
        return shown
    return next((node for node in tree.nodes if node.type == "BSDF_PRINCIPLED"), None)


def _source(socket):
    """(node, output) that a socket is linked to, past reroutes; (None, None) of one that is not."""
    while socket.is_linked:
        link = socket.links[0]
        if link.from_node.type != "REROUTE":
            return link.from_node, link.from_socket
        socket = link.from_node.inputs[0]
    return None, None


def _value(socket):
    """What a socket is set to, or the constant that is linked to it."""
    node, output = _source(socket)
    if node is None or node.type not in {"RGB", "VALUE"}:
        return socket.default_value
    value = output.default_value
    is_color = hasattr(socket.default_value, "__len__")
    if is_color == hasattr(value, "__len__"):
        return value
    return (value,) * 3 if is_color else float(np.dot(_LUMINANCE, value))


def _image_map(socket, material, uv_map=""):
    """The `ImageMap` that is linked to a socket, also by one of its channels; None where there is none."""
    node, output = _source(socket)
    channels = _LUMINANCE
    if node is not None and node.type == "SEPARATE_COLOR" and node.mode == "RGB":
        channels = _CHANNELS[output.name]
        node, output = _source(node.inputs["Color"])
    if node is None or node.type != "TEX_IMAGE" or node.image is None:
        return None
    if output.name == "Alpha":
        channels = _CHANNELS["Alpha"]
    if not _is_readable(node.image, material):
        return None
    mapping = _mapping(node.inputs["Vector"])
    if mapping is None:
        say(f'The texture coordinates of "{name_of(material)}" are no UV map: it is drawn without its image.')
        return None
    rows, own_map = mapping
    extension, is_smooth = _EXTENSIONS[node.extension], node.interpolation != "Closest"
    # Blender lays straight alpha over black, unless a material reads it.
    is_opaque = node.outputs["Alpha"].is_linked or node.image.is_float or node.image.alpha_mode != "STRAIGHT"
    return ImageMap(node.image, own_map or uv_map, rows, channels, extension, is_smooth, is_opaque)


def _is_readable(image, material):
    """Whether an image has pixels of one picture; if not, say so."""
    if image.source not in {"FILE", "GENERATED"}:
        say(f'"{name_of(image)}" is not a single picture: "{name_of(material)}" is drawn in its plain color.')
    elif not all(image.size):  # the access loads the file if necessary
        say(f'The image "{name_of(image)}" is missing: "{name_of(material)}" is drawn in its plain color.')
    else:
        return True
    return False


def _mapping(vector):
    """((2, 3) rows, name of the UV map) of a texture's coordinates; None where they are no UVs."""
    node, output = _source(vector)
    if node is None:
        return np.eye(2, 3), ""
    if node.type == "UVMAP":
        return np.eye(2, 3), node.uv_map
    if node.type == "TEX_COORD":
        return (np.eye(2, 3), "") if output.name == "UV" else None
    if node.type != "MAPPING" or node.vector_type not in {"POINT", "TEXTURE"}:
        return None
    inner = _mapping(node.inputs["Vector"]) if node.inputs["Vector"].is_linked else None
    if inner is None or any(socket.is_linked for socket in node.inputs if socket.name != "Vector"):
        return None
    values = {socket.identifier: socket.default_value for socket in node.inputs}
    placed = Matrix.LocRotScale(values["Location"], Euler(values["Rotation"]), values["Scale"])
    matrix = np.array(placed, np.float64)
    if node.vector_type == "TEXTURE":
        matrix = np.linalg.pinv(matrix)
    plane = matrix[np.ix_((0, 1, 3), (0, 1, 3))]
    return (plane @ np.vstack([inner[0], (0.0, 0.0, 1.0)]))[:2], inner[1]
