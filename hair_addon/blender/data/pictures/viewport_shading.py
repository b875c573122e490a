# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of a viewport's shading → the lights and colors with which hair is drawn in it.

Values are as in Blender's Workbench and EEVEE engines. Records are equal if hair looks the same.
"""

from dataclasses import dataclass, replace

import bpy
import numpy as np

# From directions of an image that follows the view to those of the view.
_AHEAD = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])

SCENE, STUDIO, MATCAP, FLAT = "SCENE", "STUDIO", "MATCAP", "FLAT"  # kinds of light
_EVEN = (1.0, 1.0, 1.0)  # ambient radiance without lights: surfaces have the radiance of their color

# Parts of the scene's color management that Blender applies to a viewport.
ALL, VIEW_TRANSFORM, NO_SETTINGS = "ALL", "VIEW_TRANSFORM", "NO_SETTINGS"


@dataclass(frozen=True)
class StudioLight:
    """One of the lights of Solid shading.

    direction: unit vector in world space towards the light; diffuse, specular: colors; wrap: its softness, from 0 to 1,
    by which it reaches surfaces that face away.
    """

    direction: tuple
    diffuse: tuple
    specular: tuple
    wrap: float


@dataclass(frozen=True)
class Hdri:
    """A studio light that surrounds the scene. path: of its image; rotation: about Z [radians].

    axes: of the view, from its directions to world space, row by row, for a light that follows the view; else ().
    """

    path: str
    strength: float = 1.0
    rotation: float = 0.0
    axes: tuple = ()

    @property
    def to_image(self):
        """(3, 3) from directions in world space to those of the image."""
        cosine, sine = np.cos(self.rotation), np.sin(self.rotation)
        turned = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        if not self.axes:
            return turned
        # The image's +Y is ahead, and its +Z is up on the screen.
        return turned @ (np.reshape(self.axes, (3, 3)) @ _AHEAD).T


@dataclass(frozen=True)
class ViewportLight:
    """The light of a viewport.

    kind: SCENE, STUDIO, MATCAP or FLAT. Of the scene's light: has_lights, has_world: whether lights and world of the
    scene are included; hdri: replaces the world. Of STUDIO: lights, with directions in world space, and the ambient
    radiance. matcap: path of its image. has_highlights: whether STUDIO and MATCAP show highlights.
    """

    kind: str = SCENE
    has_lights: bool = True
    has_world: bool = True
    hdri: Hdri | None = None
    lights: tuple = ()
    ambient: tuple = (0.0, 0.0, 0.0)
    matcap: str = ""
    has_highlights: bool = True


SCENE_LIGHT = ViewportLight()


@dataclass(frozen=True)
class HairColor:
    """The color of hair in a viewport.

    kind: MATERIAL for the look; else OBJECT or RANDOM, by object, SINGLE, VERTEX or TEXTURE as in Blender's color type.
    color: of all hair, for SINGLE.
    """

    kind: str = "MATERIAL"
    color: tuple = ()


LOOK = HairColor()


@dataclass(frozen=True)
class ViewportShading:
    """How hair looks in a viewport. is_wire: strands are drawn as thin lines; management: of colors."""

    light: ViewportLight = SCENE_LIGHT
    color: HairColor = LOOK
    is_wire: bool = False
    management: str = ALL

    @property
    def strands(self):
        """A key of all settings that affect the shading of strands, except lights, and of whether surfaces cast
        shadows.
        """
        light = self.light
        matcap = (light.matcap, light.has_highlights) if light.matcap else None
        return light.kind == SCENE, matcap, self.color, self.is_wire


BY_SCENE = ViewportShading()  # by the look and the light of the scene


def read(viewport, scene, world_to_view):
    """Return the `ViewportShading` of a `SpaceView3D` that shows a scene; world_to_view: (4, 4) of the view."""
    shading = viewport.shading
    if shading.type == "RENDERED" and scene.render.engine == "BLENDER_WORKBENCH":
        return _solid(scene.display.shading, world_to_view, ALL)
    if shading.type == "SOLID":
        return _solid(shading, world_to_view, NO_SETTINGS)
    if shading.type == "WIREFRAME":
        color = _WIRE_COLORS.get(shading.wireframe_color_type) or _theme_color()
        return ViewportShading(ViewportLight(FLAT, ambient=_EVEN), color, True, NO_SETTINGS)
    light = _scene_light(shading, world_to_view)
    return ViewportShading(light, management=ALL if light.has_lights or light.has_world else VIEW_TRANSFORM)


_WIRE_COLORS = {"OBJECT": HairColor("OBJECT"), "RANDOM": HairColor("RANDOM")}


def _theme_color():
    wire = bpy.context.preferences.themes[0].view_3d.wire
    return HairColor("SINGLE", tuple(map(float, wire)))


def _scene_light(shading, world_to_view):
    """Return the `ViewportLight` of Material Preview or Rendered shading."""
    is_rendered = shading.type == "RENDERED"
    has_lights = shading.use_scene_lights_render if is_rendered else shading.use_scene_lights
    has_world = shading.use_scene_world_render if is_rendered else shading.use_scene_world
    hdri = None
    studio = None if has_world else shading.selected_studio_light
    if studio is not None and studio.type == "WORLD":
        is_fixed = shading.use_studiolight_view_rotation
        axes = () if is_fixed else tuple(_view_axes(world_to_view).ravel())
        hdri = Hdri(studio.path, shading.studiolight_intensity, shading.studiolight_rotate_z, axes)
    return ViewportLight(has_lights=has_lights, has_world=has_world, hdri=hdri)


def _view_axes(world_to_view):
    """Return (3, 3) from directions of a view to world space."""
    return np.linalg.inv(world_to_view[:3, :3])


def _solid(shading, world_to_view, management):
    color = HairColor(shading.color_type, tuple(shading.single_color) if shading.color_type == "SINGLE" else ())
    return ViewportShading(_solid_light(shading, world_to_view), color, management=management)


def _solid_light(shading, world_to_view):
    """Return the `ViewportLight` of Solid shading."""
    has_highlights, studio = shading.show_specular_highlight, shading.selected_studio_light
    if shading.light == "MATCAP" and studio is not None and studio.type == "MATCAP":
        return ViewportLight(MATCAP, ambient=_EVEN, matcap=studio.path, has_highlights=has_highlights)
    if shading.light == "FLAT":
        return ViewportLight(FLAT, ambient=_EVEN)
    system = bpy.context.preferences.system
    source = system if system.use_studio_light_edit or studio is None else studio
    to_world = _to_world(shading, world_to_view)
    return ViewportLight(
        STUDIO,
        lights=tuple(_studio_light(light, to_world) for light in source.solid_lights if light.use),
        ambient=tuple(map(float, source.light_ambient)),
        has_highlights=has_highlights and (source is system or studio.has_specular_highlight_pass),
    )


_NEAR = np.cos(np.radians(5.0))  # rotation of lights that is hardly visible while the view rotates too


def is_near(light, other):
    """Whether two `ViewportLight`s differ only by a small rotation of lights that follow the view."""
    if _turnless(light) != _turnless(other) or len(light.lights) != len(other.lights):
        return False
    if light.hdri is not None and light.hdri != other.hdri:
        turn = np.reshape(light.hdri.axes, (3, 3)) @ np.reshape(other.hdri.axes, (3, 3)).T
        if 0.5 * (np.trace(turn) - 1.0) < _NEAR:
            return False
    return all(
        replace(one, direction=two.direction) == two and float(np.dot(one.direction, two.direction)) >= _NEAR
        for one, two in zip(light.lights, other.lights, strict=True)
    )


def _turnless(light):
    """Return a `ViewportLight` without directions, and whether its HDRI follows the view."""
    hdri = light.hdri
    follows = hdri is not None and bool(hdri.axes)
    return replace(light, lights=(), hdri=hdri and replace(hdri, axes=())), follows


def _studio_light(light, to_world):
    direction = to_world @ light.direction
    colors = (tuple(map(float, color)) for color in (light.diffuse_color, light.specular_color))
    return StudioLight(tuple(map(float, direction / np.linalg.norm(direction))), *colors, light.smooth)


# Studio lights that do not follow the view are those of the view from the front.
_FROM_FRONT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def _to_world(shading, world_to_view):
    """Return (3, 3) from the directions of studio lights to world space."""
    if not shading.use_world_space_lighting:
        return _view_axes(world_to_view)
    cosine, sine = np.cos(shading.studiolight_rotate_z), np.sin(shading.studiolight_rotate_z)
    return np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]]) @ _FROM_FRONT
