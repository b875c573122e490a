# SPDX-License-Identifier: GPL-3.0-or-later
"""Deep opacity maps [Yuksel08]: for each light, front and back depth of hair, its layers, and the depth of surfaces."""

from dataclasses import replace

import gpu
import numpy as np

from . import drawing, scene_programs, shadow_programs, surface_textures, uniforms

SUN = 0  # LIGHT_SUN of shaders/light/lights.glsl

_NEAREST = 0.01  # minimum distance of a light, as a part of the hair's diameter
_WIDEST = np.radians(80.0)  # between the axis of a map and its border
_FAR = 2.0  # FAR of shaders/shadows/opacity.glsl
_NO_SURFACE = (_FAR, -1.0, 0.0, 0.0)  # its depth, and a color that there is none of
_NOTHING = int(np.float32(_FAR + 1.0).view(np.int32))  # front_bits() of it; of a back that is nowhere, 0

# Texels by which shadows of surfaces are blurred, at least and as a part of a map at most; and how far, as a part of
# the hair's diameter, a surface is taken to be from the hair that it shades.
_LEAST_BLUR, _MOST_BLUR = 0.7, 1 / 64
_SHADE_DISTANCE = 0.15
_LEAST_WIDE = 1e-4  # [m] radius of what a wide map holds
_ALL = drawing.Steps()

# Strands at rest are drawn with so few points that they are shorter by this part at most: bends that are left out are
# smaller than a texel.
_LENGTHENING = 0.005

# While hair moves, the sphere that maps are aimed at stays until it has to be larger, and is then larger by one factor,
# or until it may be smaller by the other: maps whose texels move with every edit flicker.
_SPARE, _LOOSEST = 1.1, 1.4

_AIMED = ("world_to_shadow", "near", "extent")  # of a light, by `_aim`
_SHADED_BY = ("kind", "position", "axis", "near", "extent", "radius")  # of a light, what maps of surfaces follow from


class ShadowMaps:
    """Shadow textures of the first lights, reused until something moves.

    size: texels along a side of each map; layer_count: of lights that have one; in_compute: whether compute programs
    draw the strands, None: where they can; is_wide: whether each light has a map of the surfaces around the hair too.
    """

    def __init__(self, size, layer_count, in_compute=None, is_wide=False):
        self._size, self.layer_count, self.is_wide = size, layer_count, is_wide
        self._hair_front = _array(size, layer_count, "RG32F")
        self._hair_layers = _array(size, layer_count, "RGBA16F")
        self._surface_moments = _array(size, 2 * layer_count if is_wide else layer_count, "RGBA32F")
        self._in_compute = scene_programs.has_image_atomics() if in_compute is None else in_compute
        self._sphere = None  # that maps were aimed at last
        self._views = {}  # index of a light not near hair → (what it was aimed by, view, what `_aim` wrote)
        self._surfaces = {}  # layer → what its surfaces were drawn with
        self._hidden = {}  # layer → texture of the depth that they hide strands behind
        # Target of the drawing before it is filtered into a map.
        self._surface_depth = _array(size, 1, "RG32F")  # and their color
        self._half_blurred = _array(size, 1, "RGBA32F")
        self._fronts, self._backs = (gpu.types.GPUTexture((size, size), format="R32UI") for _ in range(2))
        self._row_ends = gpu.types.GPUTexture((size, size), format="RG32F")
        self._counts = gpu.types.GPUTexture((4 * size, size), format="R32UI") if self._in_compute else None
        self._is_empty = False  # whether nothing is in the images that strands are walked into
        self._depth = gpu.types.GPUTexture((size, size), format="DEPTH_COMPONENT32F")
        self._drawing_depth = gpu.types.GPUFrameBuffer(
            color_slots=_slot(self._surface_depth, 0), depth_slot=self._depth
        )

    @property
    def samplers(self):
        """{sampler: texture} for the shaders that receive shadows."""
        textures = (self._hair_front, self._hair_layers, self._surface_moments)
        return dict(zip(scene_programs.SHADOW_SAMPLERS, textures, strict=True))

    def draw(self, lights, hair, surfaces, steps=_ALL, casters=None, is_steady=False, chosen=None):
        """Draw the maps and write each light's part in them into its record.

        lights: a `uniforms.LIGHTS` record, changed; hair: [(StrandsOnGPU, object to world)]; surfaces: [SurfaceOnGPU];
        steps: what is drawn of each hair for all of it; casters: a light's index → (hair, surfaces) that cast its
        shadow, None: all; is_steady: whether maps stay aimed where they are as long as hair fits; chosen: index of the
        only light whose map is drawn, None: of all.
        """
        lights["light"]["shadow_layer"] = lights["light"]["wide_layer"] = -1
        if not hair:
            return
        loose = drawing.bounding_sphere(hair)
        self._sphere = loose = _steady(loose, self._sphere) if is_steady and self._sphere else loose
        views = {}
        for index in range(min(int(lights["count"]), self.layer_count)) if chosen is None else (chosen,):
            view = self._aimed(index, lights["light"][index], hair, loose)
            if view is not None and lights["light"][index]["casts_shadow"]:
                lights["light"][index]["shadow_layer"] = index
                view["light_index"] = index
                views[index] = view
        if views:
            light_block = uniforms.uniform_buffer(lights)  # each map reads its own light alone
            for index, view in views.items():
                cast = (hair, surfaces) if casters is None else casters(index)
                self._draw_light(index, view, lights, light_block, *cast, steps, is_steady)

    def _aimed(self, index, light, hair, loose):
        """What `_aim` returns and writes, kept while the light and the sphere stay."""
        aimed_by = (
            light["position"].tobytes(),
            light["axis"].tobytes(),
            int(light["kind"]),
            *loose[0].tolist(),
            loose[1],
        )
        before, view, written = self._views.get(index, (None, None, None))
        if before == aimed_by:
            for name, value in written.items():
                light[name] = value
            return view.copy()
        view = _aim(light, hair, loose, self._size)
        if view is not None and (light["kind"] == SUN or not _is_inside(light["position"][:3].astype(float), *loose)):
            self._views[index] = aimed_by, view.copy(), {name: light[name].copy() for name in _AIMED}
        return view

    def _draw_light(self, layer, view, lights, light_block, hair, surfaces, steps, is_steady):
        hidden = {"hidden_depth": self._hiding_depth(layer, view, lights, surfaces)}
        placed = [(strands, _record(strands, view, to_world, steps, is_steady)) for strands, to_world in hair]
        if self._in_compute:
            self._walk(layer, placed, light_block, hidden)
        else:
            self._draw_strips(layer, placed, light_block, hidden)

    def draw_wide(self, lights, surfaces, sphere, casters=None):
        """Draw the maps of surfaces around the hair and write each light's part in them into its record.

        sphere: (centre, radius) that maps hold as far as a light sees it; the rest as for `draw`.
        """
        for index in range(min(int(lights["count"]), self.layer_count)):
            light = lights["light"][index]
            view = _aim_wide(light, *sphere, self._size) if light["casts_shadow"] else None
            light["wide_layer"] = -1 if view is None else self.layer_count + index
            if view is None:
                continue
            view["light_index"] = index
            seen_from = lights.copy()
            for name, wide_name in (("near", "wide_near"), ("extent", "wide_extent")):
                seen_from["light"][index][name] = light[wide_name]
            chosen = surfaces if casters is None else casters(index)[1]
            self._are_surfaces_new(self.layer_count + index, view, seen_from, chosen)

    def _hiding_depth(self, layer, view, lights, surfaces):
        """Draw surfaces into a map, unless they are there; returns the depth behind which they hide strands."""
        hidden = self._hidden.get(layer)
        if not self._are_surfaces_new(layer, view, lights, surfaces):
            return hidden
        if hidden is None:
            hidden = self._hidden[layer] = gpu.types.GPUTexture((self._size, self._size), format="R32F")
        self._filter(shadow_programs.hidden_program(), hidden, surface_depth=self._surface_depth)
        return hidden

    def _are_surfaces_new(self, layer, view, lights, surfaces):
        """Draw surfaces into a layer, by the light that a view looks from, unless they are there; whether it did."""
        light = lights["light"][int(view["light_index"])]
        drawn_with = view.tobytes(), *(light[name].tobytes() for name in _SHADED_BY), tuple(surfaces)
        if self._surfaces.get(layer) == drawn_with:
            return False
        with (
            drawing.cleared(self._drawing_depth, _NO_SURFACE),
            drawing.gpu_state("LESS_EQUAL", depth_writes=True),
        ):
            for surface in surfaces:
                surface_textures.draw_depth(surface, view, lights)
        self._blur(layer, _blur_of(light, self._size))
        self._surfaces[layer] = drawn_with
        return True

    def _walk(self, layer, placed, lights, hidden):
        """Draw a map of strands by compute programs: integer sums are independent of the order."""
        samplers = {"hair_front": self._hair_front, **hidden}
        images = {"fronts": self._fronts, "backs": self._backs, "counts": self._counts}
        if not self._is_empty:
            self._clear_ends()
            self._counts.clear(format="UINT", value=(0,))
        self._is_empty = False
        placed = [(*one, {"view": uniforms.uniform_buffer(one[1]), "lights": lights}) for one in placed]
        fronts, counts = map(scene_programs.strand_shadow_program, (True, False))
        for strands, record, blocks in placed:
            drawing.walk_strands(strands, fronts, record, blocks, samplers, images, {})
        self._fill_fronts(layer)
        for strands, record, blocks in placed:
            drawing.walk_strands(strands, counts, record, blocks, samplers, images, {})
        self._filter(shadow_programs.counts_program(), self._hair_layers, layer, images)
        self._is_empty = True

    def _clear_ends(self):
        self._fronts.clear(format="UINT", value=(_NOTHING,))
        self._backs.clear(format="UINT", value=(0,))

    def _draw_strips(self, layer, placed, lights, hidden):
        """Draw the same map with triangle strips."""
        self._clear_ends()
        end = scene_programs.strip_program(
            "shadows/shadow_front.frag", targets=(("front", "UINT"),), samplers=tuple(hidden)
        )
        layers = scene_programs.strip_program("shadows/shadow_layers.frag", ("hair_front",), samplers=tuple(hidden))
        for texture, depth, test in ((self._fronts, 1.0, "LESS_EQUAL"), (self._backs, 0.0, "GREATER_EQUAL")):
            target = gpu.types.GPUFrameBuffer(color_slots=texture, depth_slot=self._depth)
            with target.bind(), drawing.gpu_state(test, depth_writes=True):
                target.clear(depth=depth)
                for strands, record in placed:
                    drawing.draw_strip(strands, end, record, lights, hidden)
        self._fill_fronts(layer)
        with (
            self._target(self._hair_layers, layer),
            drawing.gpu_state("NONE", depth_writes=False, blend="ADDITIVE_PREMULT"),
        ):
            for strands, record in placed:
                drawing.draw_strip(strands, layers, record, lights, {"hair_front": self._hair_front, **hidden})

    def _fill_fronts(self, layer):
        ends = {"fronts": self._fronts, "backs": self._backs}
        self._filter(shadow_programs.rows_program(), self._row_ends, **ends)
        self._filter(shadow_programs.fill_program(), self._hair_front, layer, **ends, row_ends=self._row_ends)

    def _blur(self, layer, deviation):
        """Fill a layer of the surfaces' moments from their raw depth, blurred by a deviation in texels."""
        program = shadow_programs.moments_program()
        passes = (
            (self._half_blurred, 0, self._surface_depth, (1, 0)),
            (self._surface_moments, layer, self._half_blurred, (0, 1)),
        )
        for target, target_layer, source, along in passes:
            program.bind()
            program.uniform_int("along", along)
            program.uniform_int("taps", int(np.ceil(2.0 * deviation)))
            program.uniform_int("is_depth", int(source is self._surface_depth))
            program.uniform_float("deviation", deviation)
            self._filter(program, target, target_layer, surface_depth=source)

    def _filter(self, program, target, layer=None, images=None, **sources):
        """Write all of a texture, or of its layer, with a program that reads others: nothing needs to be cleared."""
        with drawing.bound(program, {}, sources):
            for name, image in ({"filtered": target} | (images or {})).items():
                program.image(name, image)
            if layer is not None:
                program.uniform_int("layer", layer)
            drawing.dispatch_over(program, (self._size, self._size))

    def _target(self, texture, layer=None, value=(0.0,) * 4):
        framebuffer = gpu.types.GPUFrameBuffer(color_slots=_slot(texture, layer), depth_slot=self._depth)
        return drawing.cleared(framebuffer, value)


def _steady(sphere, before):
    """The sphere (centre, radius) that maps are aimed at for what is in one; before: that of the last time."""
    apart = float(np.linalg.norm(sphere[0] - before[0]))
    if apart + sphere[1] <= before[1] * (1.0 + 1e-6) and before[1] <= _LOOSEST * sphere[1]:
        return before
    return sphere[0], _SPARE * sphere[1]


def _slot(texture, layer):
    return texture if layer is None else {"texture": texture, "layer": layer}


def _record(strands, view, to_world, steps, is_steady):
    """`drawing.strand_record` of strands that cover as much with fewer points, which cut curls short.

    Strands at rest are drawn with as few as show them.
    """
    if steps.point_count is None and not is_steady:
        steps = replace(steps, point_count=strands.points_that_show(_LENGTHENING))
    record = drawing.strand_record(strands, view, to_world, steps)
    drawn_points = int(record["drawn_points"])
    if drawn_points < strands.point_count:
        record["thickness"] *= strands.lengthening(drawn_points)
    return record


def _array(size, layer_count, texture_format):
    texture = gpu.types.GPUTexture((size, size), layers=layer_count, format=texture_format)
    texture.filter_mode(True)
    texture.extend_mode("EXTEND")
    return texture


def _aim(light, hair, loose, size):
    """The view of a light that holds the hair, also written into the light.

    loose: (centre, radius) of a sphere around the hair; lights in it take a tight one. Of a light in both, or next to
    them, the view holds what is up to `_WIDEST` off its axis; None without an axis.
    """
    position = light["position"][:3].astype(np.float64)
    is_sun = light["kind"] == SUN
    is_near = not is_sun and _is_inside(position, *loose)
    centre, radius = drawing.tight_sphere(hair) if is_near else loose
    is_inside = is_near and _is_inside(position, centre, radius)
    axis = light["axis"][:3].astype(np.float64) if is_sun else centre - position
    distance = float(np.linalg.norm(axis))
    if is_inside and light["axis"][:3].any():  # where a spot or an area light shines
        axis = light["axis"][:3].astype(np.float64)
    length = float(np.linalg.norm(axis))
    if length == 0.0:
        return None
    eye = centre - axis * (2.0 * radius) if is_sun else position
    world_to_view = _look_at(eye, axis / length)
    view_to_clip = _orthographic(radius) if is_sun else _perspective(radius, distance)
    view = drawing.view_record(world_to_view, view_to_clip, size, least_width=1.0)
    near = (centre @ axis / length if is_sun else distance) - radius
    light["world_to_shadow"] = view["world_to_clip"]
    light["near"] = near if is_sun else max(near, 0.0)
    light["extent"] = radius + (radius if is_sun else min(distance, radius))
    return view


def _aim_wide(light, centre, radius, size):
    """The view of a light that holds a sphere, also written into the light; of a light in it, a smaller sphere.

    None of a light in the sphere's middle.
    """
    position, is_sun = light["position"][:3].astype(np.float64), light["kind"] == SUN
    axis = light["axis"][:3].astype(np.float64) if is_sun else centre - position
    distance = float(np.linalg.norm(axis))
    if not is_sun:
        radius = min(radius, 0.99 * distance * np.sin(_WIDEST))
    if radius < _LEAST_WIDE or distance == 0.0:
        return None
    axis = axis / distance
    eye = centre - axis * (2.0 * radius) if is_sun else position
    view_to_clip = _orthographic(radius) if is_sun else _perspective(radius, distance)
    view = drawing.view_record(_look_at(eye, axis), view_to_clip, size, least_width=1.0)
    light["world_to_wide"] = view["world_to_clip"]
    light["wide_near"] = centre @ axis - radius if is_sun else distance - radius
    light["wide_extent"] = 2.0 * radius
    return view


def _is_inside(position, centre, radius):
    return float(np.linalg.norm(centre - position)) * np.sin(_WIDEST) < radius


def _blur_of(light, size):
    """Standard deviation [texels] of the blur of surface shadows by a light's size."""
    is_sun = light["kind"] == SUN
    angle = light["radius"] / (1.0 if is_sun else light["near"] + 0.5 * light["extent"])
    # A disk's deviation along an axis is half its radius.
    return float(np.clip(0.5 * angle * _SHADE_DISTANCE * size, _LEAST_BLUR, _MOST_BLUR * size))


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
    """(4, 4) view to clip of a cube around a sphere two radii ahead; objects in front of it still cast shadows."""
    return np.array([[1 / radius, 0, 0, 0], [0, 1 / radius, 0, 0], [0, 0, -0.1 / radius, -0.8], [0, 0, 0, 1.0]])


def _perspective(radius, distance):
    """(4, 4) view to clip of a cone around a sphere, `_WIDEST` at most; objects in front of it still cast shadows."""
    sine = min(radius / max(distance, radius), np.sin(_WIDEST))
    cotangent = np.sqrt(1.0 - sine**2) / sine
    near, far = _NEAREST * 2.0 * radius, distance + 4.0 * radius
    depth_scale, depth_offset = (far + near) / (near - far), 2.0 * far * near / (near - far)
    return np.array([[cotangent, 0, 0, 0], [0, cotangent, 0, 0], [0, 0, depth_scale, depth_offset], [0, 0, -1.0, 0]])
