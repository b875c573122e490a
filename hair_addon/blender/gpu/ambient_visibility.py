# SPDX-License-Identifier: GPL-3.0-or-later
"""Visibility of the world from strands and surfaces, as ambient cubes.

Opacity maps are drawn from 14 directions; each point sums their transmittances. The result depends on the geometry, not
on lights or the view.
"""

import numpy as np

from ...core.imaging import ambient_cube
from . import drawing, driver_textures, shadows, strand_batches
from .programs import scene_programs, seen_programs, surface_programs, uniforms
from .strand_textures import seen_points

# Environment light is soft: its maps are coarser than a lamp's, and drawn with as many strands as they can resolve.
# Fewer and thicker strands cover an area less evenly, which lets more light through.
_SIZE = 256
_POINT_COUNT, _LEAST_STRANDS = 11, 10_000
_FULL_WIDTH = 0.5  # maximum width [texels] of a strand that represents several


def measure(hair, blockers, opacities, surfaces, forwards=None):
    """Return the visibility textures {sampler: texture} of each hair and of each surface, as two lists.

    Hair objects that share strands share array textures, with a layer for each object: `layers`.

    hair: [(StrandsOnGPU, object to world)]; blockers: [SurfaceOnGPU] that hide the world; opacities: of a strand of
    each hair, for the visibility of this hair; the visibility of surfaces is for the densest hair; surfaces:
    [SurfaceOnGPU] that receive light; forwards: the fraction of light (3,) that a strand of each hair passes on, None:
    one minus the opacity in all channels.
    """
    if forwards is None:
        forwards = [np.full(3, 1.0 - opacity) for opacity in opacities]
    of_strands = list(zip(opacities, forwards, strict=True))
    lights = _suns(ambient_cube.DIRECTIONS, ambient_cube.WEIGHTS)
    maps = shadows.ShadowMaps(_SIZE, len(ambient_cube.DIRECTIONS))
    maps.draw(lights, hair, blockers, _steps(hair))
    layered = _layers_of(hair) + [None] * len(surfaces)
    targets = [
        _Target(place, not _is_surface(place), layers)
        for place, layers in zip(_places(hair, surfaces, of_strands), layered, strict=True)
    ]
    for target in targets:
        target.add(lights, maps.samplers)
    return _split([target.textures for target in targets], len(hair))


class Renewal:
    """Visibility that follows moving geometry, and adds one direction of the world with each change.

    The last complete visibility is shown while the next is summed, so that all receivers are equally up to date.
    """

    def __init__(self):
        self._lights = _suns(ambient_cube.DIRECTIONS, ambient_cube.WEIGHTS)
        self._maps = shadows.ShadowMaps(_SIZE, len(ambient_cube.DIRECTIONS))  # one per direction, to reuse surfaces
        self._targets, self._turn = [], 0

    def step(self, seen, hair, blockers, through, surfaces):
        """Add a direction; returns the last complete visibility textures, as `measure` does.

        seen: the previous complete textures, of the same receivers; through: (opacity, (3,) fraction that is passed on)
        for each hair; the rest as for `measure`.
        """
        places = _places(hair, surfaces, through)
        if [target.size for target in self._targets] != [_size_of(*place) for place in places]:
            self._targets, self._turn = [_Target(place) for place in places], 0
        found_layers = layers(hair) + [None] * len(surfaces)
        for target, place in zip(self._targets, places, strict=True):
            target.view, target.places = place
        turn = self._turn
        self._maps.draw(self._lights, hair, blockers, _steps(hair), is_steady=True, chosen=turn)
        one = self._lights.copy()
        one["count"], one["light"][0] = 1, self._lights["light"][turn]
        for target in self._targets:
            target.add(one, self._maps.samplers)
        self._turn += 1
        if self._turn < len(ambient_cube.DIRECTIONS):
            return seen
        self._turn = 0
        complete = [
            target.completed(textures, layer)
            for target, textures, layer in zip(self._targets, [*seen[0], *seen[1]], found_layers, strict=True)
        ]
        return _split(complete, len(hair))


def layers(hair):
    """Return the layer of each hair in shared visibility textures; None for a hair with textures of its own.

    hair: [(StrandsOnGPU, object to world)].
    """
    found = [None] * len(hair)
    for group in _groups(hair):
        for layer, index in enumerate(group if len(group) > 1 else ()):
            found[index] = layer
    return found


def _groups(hair):
    """Return [indices] for each group of hair that shares strands."""
    return strand_batches.groups_of(id(strands) for strands, _to_world in hair)


def _layers_of(hair):
    """Return (shared array textures, layer) of each hair; None for a hair with textures of its own."""
    found = [None] * len(hair)
    for group in _groups(hair):
        if len(group) > 1:
            strands = hair[group[0]][0]
            size = strands.row_strands * seen_points(strands.point_count), strands.texture.height
            shared = {
                name: _texture(size, seen_programs.BYTES, len(group)) for name in scene_programs.VISIBILITY_SAMPLERS
            }
            for layer, index in enumerate(group):
                found[index] = shared, layer
    return found


def _places(hair, receivers, through):
    """Return [(`uniforms.VIEW` record, {sampler: texture})] of the receivers: strands, then surfaces."""
    views = [_view_of_strands(strands, to_world) for strands, to_world in hair]
    views += [_view_of_surface(surface) for surface in receivers]
    of_surfaces = through[densest([strands for strands, _ in hair])] if hair else (1.0, np.zeros(3))
    for view, (opacity, forward) in zip(views, through + [of_surfaces] * len(receivers), strict=True):
        view["seen_opacity"], view["hair_forward"][:3] = opacity, forward
    textures = [{"places": strands.texture, "strand_radii": strands.radii_texture} for strands, _ in hair]
    # Surfaces have no radii: any texture will do.
    textures += [{"places": surface.places, "strand_radii": surface.places} for surface in receivers]
    return list(zip(views, textures, strict=True))


def _split(textures, hair_count):
    return textures[:hair_count], textures[hair_count:]


def _steps(hair):
    """Return the `drawing.Steps` of the maps; hair: [(StrandsOnGPU, object to world)]."""
    if not hair:
        return drawing.Steps()
    texel = 2.0 * drawing.bounding_sphere(hair)[1] / _SIZE
    widths = [2.0 * strands.mean_radius * drawing.scale_of(to_world) for strands, to_world in hair]
    wanted = max(
        strands.strand_count * width / (_FULL_WIDTH * texel) for (strands, _), width in zip(hair, widths, strict=True)
    )
    return drawing.Steps(_POINT_COUNT, int(max(wanted, _LEAST_STRANDS)))


def densest(hair):
    """Index of the `StrandsOnGPU` with most strands, so that brows do not color the shadow of the hair."""
    return max(range(len(hair)), key=lambda index: hair[index].strand_count)


def _suns(directions, weights):
    lights = uniforms.LIGHTS.record()
    lights["count"] = len(directions)
    chosen = lights["light"][: len(directions)]
    chosen["kind"], chosen["casts_shadow"] = shadows.SUN, True
    chosen["axis"][:, :3] = -directions
    # Each side of the cube covers a sixth of the sphere.
    chosen["power"][:, 0] = 6.0 * weights
    return lights


def _view_of_strands(strands, to_world):
    view = uniforms.VIEW.record()
    view["object_to_world"] = to_world.T
    view["point_count"], view["row_strands"] = strands.point_count, strands.row_strands
    view["radius_strands"], view["radius_unit"] = strands.radius_strands, strands.radius_unit
    view["object_scale"] = drawing.scale_of(to_world)
    view["seen_points"] = seen_points(strands.point_count)
    return view


def _view_of_surface(surface):
    view = surface.placed(uniforms.VIEW.record())
    view["point_count"], view["seen_points"] = 1, 1
    return view


def joined(seen):
    """Return {sampler: array texture} of linked surfaces with a layer for each; seen: [{sampler: texture}] of each."""
    size = next((texture.width, texture.height) for texture in seen[0].values())
    found = {name: _texture(size, seen_programs.SUMS, len(seen)) for name in surface_programs.SEEN_SAMPLERS}
    program = seen_programs.join_program()
    for layer, textures in enumerate(seen):
        with drawing.bound(program, {}, {name: textures[name] for name in found}):
            for name, texture in zip(seen_programs.JOINED, found.values(), strict=True):
                program.image(name, texture)
            program.uniform_int("layer", layer)
            drawing.dispatch_over(program, size, seen_programs.GROUP_SIZE)
    return found


class _Target:
    """Textures in which visibility is summed, with a texel for each place.

    is_in_bytes: whether all lights are added at once and stored as bytes: see shaders/light/visibility_bytes.glsl;
    in_layer: (array textures {sampler: texture} of bytes, the layer to fill), None for textures of its own.
    """

    def __init__(self, place, is_in_bytes=False, in_layer=None):
        self.view, self.places = place
        self.size, self._format = _size_of(*place), seen_programs.BYTES if is_in_bytes else seen_programs.SUMS
        shared, self._layer = in_layer or (None, None)
        self.take(shared or {name: _texture(self.size, self._format) for name in scene_programs.VISIBILITY_SAMPLERS})

    def take(self, textures):
        """Sum in these textures {sampler: texture}, from zero."""
        self.textures, self._is_first = textures, True

    def completed(self, before, layer=None):
        """Return textures {sampler: texture} of the sums, and begin again from zero.

        before: the textures shown so far; layer: the layer of `before`, None if these are no array textures. The bytes
        of strands are written into `before`; for surfaces, `before` takes the next sums.
        """
        found = self.textures
        if _is_surface((self.view, self.places)):
            self.take(before)
            return found
        program = seen_programs.bytes_program(layer is not None)
        with drawing.bound(program, {}, found):
            self._dispatch(program, before, layer)
        self.take(found)
        return before

    def add(self, lights, maps):
        program = seen_programs.visibility_program(self._format, self._layer is not None)
        blocks = {"view": uniforms.uniform_buffer(self.view), "lights": uniforms.uniform_buffer(lights)}
        with drawing.bound(program, blocks, {**self.places, **maps}):
            if self._format == seen_programs.SUMS:
                program.uniform_int("is_first", int(self._is_first))
            self._dispatch(program, self.textures, self._layer)
        self._is_first = False

    def _dispatch(self, program, textures, layer):
        if layer is not None:
            program.uniform_int("layer", layer)
        for name, texture in zip(seen_programs.IMAGES, textures.values(), strict=True):
            program.image(name, texture)
        drawing.dispatch_over(program, self.size, seen_programs.GROUP_SIZE)


def _size_of(view, places):
    return int(view["row_strands"] * view["seen_points"]), places["places"].height


def _is_surface(place):
    """Whether an item of `_places` is a surface."""
    return int(place[0]["point_count"]) == 1


def _texture(size, kind, layer_count=0):
    texture = driver_textures.new_texture(size, kind, layers=layer_count)
    texture.filter_mode(True)
    texture.extend_mode("EXTEND")
    return texture
