# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights: Blender's lights and world → arrays."""

from dataclasses import dataclass, replace

import bpy
import numpy as np
from mathutils import Euler, Matrix

from ...core.errors import HairError
from ...core.imaging import lamps
from ..data.pictures import light_linking, light_panoramas, picture_jobs, world_panoramas
from ..data.pictures.rendered_instances import is_rendered
from ..data.pictures.shader_sockets import ShaderInput, shown_shader
from ..host import scene_time
from ..host.caches import Cache
from ..host.notices import can_be_drawn, say
from . import light_patterns
from .programs import uniforms
from .studio_lights import StudioImage, image_of

KINDS = {"SUN": lamps.SUN, "POINT": lamps.POINT, "SPOT": lamps.SPOT, "AREA": lamps.AREA}

frame_cache = Cache()  # session_uid of a sequence or movie → the loaded frame

# Ray types that a light may be invisible to. A light invisible to all of them has no effect.
_RAYS = ("visible_diffuse", "visible_glossy", "visible_transmission")


NO_LIGHTS = np.zeros(0, uniforms.LIGHT.dtype), [], []  # the result of `read_lights` without lights


def read_lights(depsgraph, for_render, places=()):
    """Return ((N,) `uniforms.LIGHT` records of all visible lights, or of all rendered lights; (N,) links; patterns).

    The links are from `light_linking.read_links`; patterns: the `Panorama` of each layer. Lights with non-finite values
    are skipped with a message. places: (P, 3) of hair, for lights whose nodes Cycles renders. Raises `HairError` if
    Cycles cannot render nodes for a render.
    """
    time = scene_time.time_of(depsgraph.scene_eval)
    lights, links, patterns = [], [], []
    for instance in depsgraph.object_instances:
        if instance.object.type == "LIGHT" and _shines(instance, for_render):
            with np.errstate(all="ignore"):  # values are checked below
                matrix = np.array(instance.matrix_world)
                panorama = _panorama_of_light(instance, time, for_render)
                light = _read_light(instance.object.data, matrix, panorama, places)
            if can_be_drawn(instance.object, *(light[name] for name in light.dtype.names)):
                light["group"] = group_of(instance.object, depsgraph.view_layer)
                if panorama is not None and light["kind"] != lamps.SUN and len(patterns) < uniforms.LIGHT_CAPACITY:
                    light_patterns.write(light, panorama, matrix, panorama.factor(matrix, places), len(patterns))
                    patterns.append(panorama)
                lights.append(light)
                links.append(light_linking.read_links(instance.object.original))
    return np.array(lights, uniforms.LIGHT.dtype), links, patterns


def group_of(owner, view_layer):
    """Number of the light group of a light object or a world in a view layer, counted from one; 0 without one."""
    names = [group.name for group in view_layer.lightgroups] if owner.lightgroup else []
    return names.index(owner.lightgroup) + 1 if owner.lightgroup in names else 0


def _shines(instance, for_render):
    return (not for_render or is_rendered(instance)) and any(getattr(instance.object, rays) for rays in _RAYS)


def _panorama_of_light(instance, time, waits):
    """Return the `Panorama` of a light instance, None without one; waits: as of `light_panoramas.find`."""
    try:
        return light_panoramas.find(instance.object.data, np.array(instance.matrix_world), time, waits)
    except HairError as error:
        if waits:
            raise
        say(str(error))
        return None


def _read_light(light, matrix, panorama, places):
    record = uniforms.LIGHT.record()
    record["kind"] = KINDS[light.type]
    record["position"][:3] = matrix[:3, 3]
    if light.type != "POINT":
        axis = -matrix[:3, 2]  # a light shines along its local -Z
        record["axis"][:3] = axis / np.linalg.norm(axis)
    record["power"][:3] = _color(light, panorama, matrix, places) * light.energy * 2.0**light.exposure
    if not light.normalize:
        record["power"][:3] *= _emitting_area(light, matrix)
    record["casts_shadow"] = light.use_shadow
    if light.type == "SUN":
        record["radius"] = np.tan(0.5 * min(light.angle, 3.0))
        # The strength of a sun is the irradiance of a perpendicular plane. A small ball receives more;
        # shaders/surfaces/surface_light.glsl multiplies by the factor again.
        record["power"][:3] /= 1.0 - 0.25 * min(float(record["radius"]) ** 2, 1.0)
    elif light.type == "AREA":
        record["cos_cone"] = np.cos(0.5 * light.spread)
        record["radius"] = np.sqrt(_area(light, matrix) / np.pi)
    else:
        record["radius"] = light.shadow_soft_size
    if light.type == "SPOT":
        record["cos_cone"] = np.cos(0.5 * light.spot_size)
        record["blend"] = light.spot_blend
    return record


def _color(light, panorama, matrix, places):
    """RGB: the light's color times the emission of its nodes."""
    color = np.array(light.color)
    if light.use_temperature:
        color = color * light.temperature_color
    if panorama is not None:
        return color * panorama.factor(matrix, places)
    emission = shown_shader(light.node_tree, ["EMISSION"])
    if emission is None:
        return color
    return color * emission["Color"].value()[:3] * emission["Strength"].value()


def _emitting_area(light, matrix):
    """Return the factor for a light without Normalize: its area [m²], or the sun's solid angle.

    As in Cycles, 1 replaces the disk's area of a point light without size.
    """
    if light.type == "AREA":
        return _area(light, matrix)
    if light.type == "SUN":
        return np.pi * np.sin(0.5 * light.angle) ** 2 or 1.0
    return 4.0 * (np.pi * light.shadow_soft_size**2 or 1.0)


def _area(light, matrix):
    """Area of an area light [m²]."""
    width, height = light.size, light.size_y if light.shape in {"RECTANGLE", "ELLIPSE"} else light.size
    x_scale, y_scale = np.linalg.norm(matrix[:3, :2], axis=0)
    part = 0.25 * np.pi if light.shape in {"DISK", "ELLIPSE"} else 1.0
    return part * width * x_scale * height * y_scale


@dataclass(frozen=True)
class World:
    """Environment lighting: (3,) radiance, multiplied by the image if there is one.

    to_image: (4, 4), from world directions to directions of the image; is_mirror_ball: the projection of the image,
    else equirectangular; frame: of a sequence or movie; group: of lights, by `group_of`.
    """

    color: np.ndarray
    image: bpy.types.Image | StudioImage | None = None
    to_image: np.ndarray | None = None
    is_mirror_ball: bool = False
    frame: int = 0
    group: int = 0

    @property
    def key(self):
        """A key that is equal for worlds with the same light, given the same pixels of their image."""
        if self.image is None:
            return tuple(self.color)
        image = self.image
        read_as = image.colorspace_settings.name, image.alpha_mode, *image.size
        return (*self.color, image.session_uid, self.frame, *read_as, self.to_image.tobytes(), self.is_mirror_ball)


def world_of_hdri(hdri):
    """Return the `World` of a `viewport_shading.Hdri`. Raises `HairError`."""
    to_image = np.eye(4)
    to_image[:3, :3] = hdri.to_image
    return World(np.full(3, hdri.strength), image_of(hdri.path), to_image)


def read_world(scene, view_layer=None, waits=True):
    """Return the `World` of a scene, or of a view layer that overrides it.

    Cycles renders nodes that Vellus does not read as a panorama; waits: for that panorama. Else the world has its
    viewport color meanwhile, and with a message if Cycles cannot render it. A world with non-finite values is black,
    with a message. Raises `HairError`.
    """
    world = (view_layer and view_layer.world_override) or scene.world
    if world is None:
        return World(np.zeros(3))
    with np.errstate(all="ignore"):
        found = _read_world(world, scene_time.frame_of(scene))
    if found is None:
        found = _panorama_of(world, scene_time.time_of(scene), waits)
    is_finite = can_be_drawn(world, found.color, () if found.to_image is None else found.to_image)
    group = 0 if view_layer is None else group_of(world, view_layer)
    return replace(found, group=group) if is_finite else World(np.zeros(3))


def _read_world(world, scene_frame):
    """Return the `World` of nodes that are a background of one color or one environment texture; None for other
    nodes.
    """
    background = shown_shader(world.node_tree, ["BACKGROUND"])
    if background is None:
        return World(np.array(world.color))
    strength, color = background["Strength"].constant(), background["Color"]
    if strength is None or not _is_shown(background, world.node_tree):
        return None
    constant = color.constant()
    if constant is not None:
        return World(strength * np.array(constant[:3]))
    source = color.source()[0]
    to_image = _mapping(source["Vector"]) if source.type == "TEX_ENVIRONMENT" else None
    if to_image is None:
        return None
    texture = source.node
    if texture.image is None:
        return World(strength * np.array(world.color))
    frame = _load_frame(texture.image, texture.image_user, scene_frame)
    if not all(texture.image.size):  # the access loads the file if necessary
        return World(strength * np.array(world.color))
    return World(np.full(3, strength), texture.image, to_image, texture.projection == "MIRROR_BALL", frame)


def _is_shown(shader, tree):
    """Whether a tree's output reads a `ShaderNode`, or nothing."""
    output = tree.get_output_node("ALL")
    found = ShaderInput(output.inputs["Surface"]).source()[0] if output else None
    return found is None or found.node == shader.node


def _panorama_of(world, time, waits):
    """Return the `World` of a panorama that Cycles renders of a world at a time [frames]; the last panorama
    meanwhile.
    """
    try:
        image = picture_jobs.read(lambda: _read_panorama(world, time, waits), waits)
    except HairError as error:
        if waits:
            raise
        say(str(error))
        image = None
    return World(np.array(world.color)) if image is None else World(np.ones(3), image, np.eye(4))


def _read_panorama(world, time, waits):
    """Return the `StudioImage` of a panorama; None if there is none or its file was damaged."""
    path = world_panoramas.file_of(world, time, waits) or picture_jobs.last_of(world)
    if path is None:
        return None
    image = image_of(str(path))
    try:
        image.layers  # noqa: B018 reads the file
    except HairError:
        path.unlink(missing_ok=True)
        return None
    return image


def _load_frame(image, user, scene_frame):
    """Load the frame of a sequence or movie for a frame of the scene; returns its number, 0 for a still image."""
    if image.source not in {"SEQUENCE", "MOVIE"}:
        return 0
    frame = scene_frame - user.frame_start + 1
    if user.use_cyclic and user.frame_duration:
        frame = (frame - 1) % user.frame_duration + 1
    frame = min(max(frame, 0), user.frame_duration) + user.frame_offset
    if frame_cache.get(image.session_uid) != frame or not image.has_data:
        # Blender loads another frame only if there is no texture.
        image.gl_free()
        image.gl_load(frame=frame)
        frame_cache.keep(image.session_uid, frame)
    return frame


def _mapping(vector):
    """Return (4, 4) from world directions to those of a texture's `ShaderInput`; None if other nodes compute them."""
    found, output = vector.source()
    if found is None:
        return None if vector.socket.is_linked else np.eye(4)
    node = found.node
    if node.type == "TEX_COORD":
        return np.eye(4) if output.name in {"Generated", "Normal"} else None
    if node.type != "MAPPING":
        return None
    # A Mapping node of type Vector or Normal hides the location, which is only accessible by its identifier.
    inputs = {socket.identifier: ShaderInput(socket, found.groups) for socket in node.inputs}
    location, rotation, scale = (inputs[name].constant() for name in ("Location", "Rotation", "Scale"))
    if location is None or rotation is None or scale is None:
        return None
    if node.vector_type not in {"POINT", "TEXTURE"}:
        location = (0.0, 0.0, 0.0)
    scale = np.array(scale)
    if node.vector_type == "NORMAL":
        scale = 1.0 / np.where(scale == 0.0, 1.0, scale)
    matrix = np.array(Matrix.LocRotScale(location, Euler(rotation), scale.tolist()), np.float64)
    return np.linalg.pinv(matrix) if node.vector_type == "TEXTURE" else matrix
