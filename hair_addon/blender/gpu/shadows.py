# SPDX-License-Identifier: GPL-3.0-or-later
"""Deep opacity maps [Yuksel08]: for each light, front and back depth of hair, its layers, and depths of surfaces."""

import weakref
from collections import Counter
from dataclasses import replace
from functools import partial
from itertools import batched

import gpu
import numpy as np

from . import drawing, level_of_detail, light_patterns, strand_batches, surface_textures
from .programs import scene_programs, shadow_programs, uniforms

SUN = 0  # LIGHT_SUN of shaders/light/lights.glsl

_NEAREST = 0.01  # minimum distance of a light, as a fraction of the hair's diameter
_WIDEST = np.radians(80.0)  # maximum angle between the axis of a map and its border
_FAR = 2.0  # FAR of shaders/shadows/opacity.glsl
_NO_SURFACE = (_FAR, -1.0, 0.0, 0.0)  # depth, and an invalid color
_NOTHING = int(np.float32(_FAR + 1.0).view(np.int32))  # front_bits() without hair; backs without hair are 0

# Blur of surfaces' shadows: minimum [texels] and maximum [fraction of a map]; and the assumed distance of a surface
# from the hair that it shades, as a fraction of the hair's diameter.
_LEAST_BLUR, _MOST_BLUR = 0.7, 1 / 64
_SHADE_DISTANCE = 0.15
_LEAST_WIDE = 1e-4  # minimum radius [m] of a wide map
_ALL = drawing.Steps()

# Maximum distance [texels] from their curves of strands at rest that are drawn with fewer points. Chords lie on the
# inner side of curved hair, so with longer chords the outer strands would lie in front of all shadows.
_GREATEST_BEND = 0.1

# While hair moves, the sphere that maps are aimed at stays until hair does not fit, and is then enlarged by the first
# factor, or until it is too large by the second factor: maps whose texels move with every edit flicker.
_SPARE, _LOOSEST = 1.1, 1.4

_AIMED = ("world_to_shadow", "near", "extent")  # members of a light that `_aim` writes
_SHADED_BY = ("kind", "position", "axis", "near", "extent", "radius")  # members of a light that affect surfaces' maps


class ShadowMaps:
    """Shadow textures of the first lights, reused until something moves.

    size: texels along each side of a map; layer_count: number of lights with a map; in_compute: draw strands by compute
    programs, None: if supported; is_wide: whether each light also has a map of the surfaces around the hair.
    """

    def __init__(self, size, layer_count, in_compute=None, is_wide=False):
        self._size, self.layer_count, self.is_wide = size, layer_count, is_wide
        self.patterns = []  # panoramas of the lights' patterns
        self._hair_front = _array(size, layer_count, "RG32F")
        self._hair_layers = _array(size, layer_count, "RGBA16F")
        self._surface_moments = _array(size, 2 * layer_count if is_wide else layer_count, "RGBA32F")
        self._in_compute = scene_programs.has_image_atomics() if in_compute is None else in_compute
        self._sphere = None  # bounding sphere that the maps were last aimed at
        self._views = {}  # index of a light outside of the hair → (inputs of `_aim`, view, members that it wrote)
        self._surfaces = {}  # layer → inputs that its surfaces were drawn with
        self._strands = {}  # layer → (its value in `_surfaces`, what its strands were drawn with, references to these)
        self._linked = (), []  # the surfaces of the last map, and `linked` of them
        self._hidden = _array(size, layer_count, "R32F")  # depth behind which surfaces hide strands
        # Targets of drawing, which are then filtered into a map.
        self._surface_depth = _array(size, 1, "RG32F")  # depth and color of surfaces
        self._half_blurred = _array(size, 1, "RGBA32F")
        self._room = 0  # number of maps that are stacked in the images that strands are rasterized into
        self._fronts = self._backs = self._row_ends = self._counts = None
        self._is_empty = False  # whether these images are cleared
        self._depth = gpu.types.GPUTexture((size, size), format="DEPTH_COMPONENT32F")
        self._drawing_depth = gpu.types.GPUFrameBuffer(
            color_slots=_slot(self._surface_depth, 0), depth_slot=self._depth
        )

    @property
    def samplers(self):
        """{sampler: texture} for the shaders that receive shadows and patterns of lights."""
        patterns = light_patterns.texture_of(self.patterns)
        textures = (self._hair_front, self._hair_layers, self._surface_moments, patterns)
        return dict(zip(scene_programs.SHADOW_SAMPLERS, textures, strict=True))

    def draw(self, lights, hair, surfaces, steps=_ALL, casters=None, is_steady=False, chosen=None, counted=None):
        """Draw the maps and write each light's part in them into its record.

        lights: a `uniforms.LIGHTS` record, changed; hair: [(StrandsOnGPU, object to world)]; surfaces: [SurfaceOnGPU];
        steps: level of detail of each hair; casters: a light's index → (hair, surfaces) that cast its shadow, None:
        all; is_steady: keep the aim of maps as long as hair fits; chosen: index of the only light whose map is drawn,
        None: all; counted: maximum number of strands of each hair that layers count, thickened in proportion, None: all
        strands; the ends of the hair are those of all strands.
        """
        lights["light"]["shadow_layer"] = lights["light"]["wide_layer"] = -1
        if not hair:
            return
        strand_batches.make_room(len({id(strands) for strands, _to_world in hair}))
        draw = partial(self._draw, lights, hair, surfaces, steps, casters, is_steady, chosen, counted)
        is_kept, before = is_steady and self._sphere is not None, self._sphere
        is_drawn = is_kept and any(strands.box.is_pending for strands, _to_world in hair)
        if is_drawn:
            draw()  # reading the bounds waits until the GPU has made the strands, and the last aim usually fits
        loose = drawing.bounding_sphere(hair)
        self._sphere = _steady(loose, before) if is_kept else loose
        if not (is_drawn and self._sphere is before):
            draw()

    def contain(self, hair):
        """Whether the maps contain hair, [(StrandsOnGPU, object to world)]."""
        return self._sphere is not None and _is_within(drawing.bounding_sphere(hair), self._sphere)

    def _draw(self, lights, hair, surfaces, steps, casters, is_steady, chosen, counted):
        """`draw` with the maps aimed at the present sphere."""
        views = {}
        for index in range(min(int(lights["count"]), self.layer_count)) if chosen is None else (chosen,):
            view = self._aimed(index, lights["light"][index], hair, self._sphere)
            lights["light"][index]["shadow_layer"] = -1
            if view is not None and lights["light"][index]["casts_shadow"]:
                lights["light"][index]["shadow_layer"] = index
                view["light_index"] = index
                views[index] = view
        if views:
            light_block = uniforms.uniform_buffer(lights)  # each map only reads its own light
            casts = {index: (hair, surfaces) if casters is None else casters(index) for index in views}
            all_placed, new = _placed(views, casts, steps, is_steady, counted), {}
            for index, view in views.items():
                self._hide(index, view, lights, casts[index][1])
                drawn_with = self._new_strands(index, view, lights, all_placed[index])
                if drawn_with is not None:
                    self._strands.pop(index, None)  # in case drawing fails
                    new[index] = drawn_with
            draw, most = (self._walk, uniforms.MAP_CAPACITY) if self._in_compute else (self._draw_strips, 1)
            for some in batched(new, most, strict=False):
                draw([(views[index], all_placed[index]) for index in some], light_block)
                self._strands.update({index: new[index] for index in some})

    def _aimed(self, index, light, hair, loose):
        """`_aim`, cached while the light and the sphere stay the same."""
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

    def _new_strands(self, layer, view, lights, placed):
        """Return the value of a layer in `_strands` for strands and a light; None if it was drawn with these.

        Most maps stay while one of many lights moves. Changed strands are another `StrandsOnGPU`.
        """
        light, strands = lights["light"][int(view["light_index"])], [one for one, *_records in placed]
        all_records = [records.tobytes() for _one, *both in placed for records in both]
        drawn_with = view.tobytes(), light.tobytes(), *all_records
        surfaces, drawn_before, before = self._strands.get(layer, (None, None, ()))
        if surfaces is self._surfaces[layer] and drawn_before == drawn_with:
            if all(known() is one for known, one in zip(before, strands, strict=True)):
                return None
        return self._surfaces[layer], drawn_with, [weakref.ref(one) for one in strands]

    def draw_wide(self, lights, surfaces, sphere, casters=None):
        """Draw the maps of surfaces around the hair and write each light's part in them into its record.

        sphere: (center, radius) that maps cover as far as possible; the rest as for `draw`.
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

    def _hide(self, layer, view, lights, surfaces):
        """Draw surfaces into a map, and the depth behind which they hide strands, if they have changed."""
        if self._are_surfaces_new(layer, view, lights, surfaces):
            self._filter(shadow_programs.hidden_program(), self._hidden, layer, surface_depth=self._surface_depth)

    def _are_surfaces_new(self, layer, view, lights, surfaces):
        """Draw surfaces into a layer from the light of a view, if changed; returns whether they were drawn."""
        light = lights["light"][int(view["light_index"])]
        drawn_with = view.tobytes(), *(light[name].tobytes() for name in _SHADED_BY), tuple(surfaces)
        if self._surfaces.get(layer) == drawn_with:
            return False
        with (
            drawing.cleared(self._drawing_depth, _NO_SURFACE),
            drawing.gpu_state("LESS_EQUAL", depth_writes=True),
        ):
            light_block = uniforms.uniform_buffer(lights)
            for surface in self._linked_surfaces(tuple(surfaces)):
                if isinstance(surface, surface_textures.LinkedSurfaces):
                    surface.draw_depth(view, light_block)
                else:
                    surface_textures.draw_depth(surface, view, light_block)
        self._blur(layer, _blur_of(light, self._size))
        self._surfaces[layer] = drawn_with
        return True

    def _linked_surfaces(self, surfaces):
        """Return `surface_textures.linked` of surfaces; the last result is reused, as most lights have the same."""
        if self._linked[0] != surfaces:
            self._linked = surfaces, surface_textures.linked(surfaces, has_color=True)
        return self._linked[1]

    def _make_room(self, count):
        """Allocate the images that strands are rasterized into, for at least `count` maps."""
        if count <= self._room:
            return
        size, self._is_empty = self._size, False
        self._fronts, self._backs = (gpu.types.GPUTexture((size, size * count), format="R32UI") for _ in range(2))
        self._row_ends = gpu.types.GPUTexture((size, size * count), format="RG32F")
        self._counts = gpu.types.GPUTexture((4 * size, size * count), format="R32UI") if self._in_compute else None
        self._room = count  # last, in case memory is short

    def _walk(self, maps, lights):
        """Draw maps of strands by compute programs, with integer sums that do not depend on the order.

        maps: [(view, value of `_placed`)], at most `uniforms.MAP_CAPACITY`. They are drawn together: for each hair and
        pass the call of a program takes the processor longer than its threads take a GPU.
        """
        self._make_room(len(maps))
        samplers = {"hair_front": self._hair_front, "hidden_depth": self._hidden}
        images = {"fronts": self._fronts, "backs": self._backs, "counts": self._counts}
        block = _block_of({place: view for place, (view, _placed) in enumerate(maps)})
        if not self._is_empty:
            self._clear_ends()
            self._counts.clear(format="UINT", value=(0,))
        self._is_empty = False
        objects = _objects_in(maps)
        for is_front in (True, False):
            program = scene_programs.strand_shadow_program(is_front)
            with drawing.rasterizing(program, {"lights": lights}, samplers, images, {}):
                for strands, views, bounding, counting in objects:
                    (bounding if is_front else counting).rasterize(strands, program, {"shadow_views": views}, {})
            if is_front:
                self._fill_fronts(block, len(maps))
        self._filter(shadow_programs.counts_program(), self._hair_layers, images=images, block=block, count=len(maps))
        self._is_empty = True

    def _clear_ends(self):
        self._fronts.clear(format="UINT", value=(_NOTHING,))
        self._backs.clear(format="UINT", value=(0,))

    def _draw_strips(self, maps, lights):
        """Draw a map of strands as triangle strips; maps: as for `_walk`, a single one."""
        self._make_room(1)
        ((view, placed),) = maps
        layer, hidden = int(view["light_index"]), {"hidden_depth": self._hidden}
        each = [(strands, record) for strands, records, _counted in placed for record in records]
        counting = [(strands, record) for strands, _records, counted in placed for record in counted]
        self._clear_ends()
        end = scene_programs.strip_program("shadows/shadow_front.frag", tuple(hidden), (("front", "UINT"),))
        layers = scene_programs.strip_program("shadows/shadow_layers.frag", ("hair_front", *hidden))
        for texture, depth, test in ((self._fronts, 1.0, "LESS_EQUAL"), (self._backs, 0.0, "GREATER_EQUAL")):
            target = gpu.types.GPUFrameBuffer(color_slots=texture, depth_slot=self._depth)
            with target.bind(), drawing.gpu_state(test, depth_writes=True):
                target.clear(depth=depth)
                for strands, record in each:
                    drawing.draw_strip(strands, end, record, lights, hidden)
        self._fill_fronts(_block_of({0: view}), 1)
        with (
            self._target(self._hair_layers, layer),
            drawing.gpu_state("NONE", depth_writes=False, blend="ADDITIVE_PREMULT"),
        ):
            for strands, record in counting:
                drawing.draw_strip(strands, layers, record, lights, {"hair_front": self._hair_front, **hidden})

    def _fill_fronts(self, block, count):
        """Fill gaps of the fronts and backs of `count` maps; block: of their views."""
        ends, program = {"fronts": self._fronts, "backs": self._backs}, shadow_programs.fill_program()
        self._filter(shadow_programs.rows_program(), self._row_ends, count=count, **ends)
        self._filter(program, self._hair_front, block=block, count=count, **ends, row_ends=self._row_ends)

    def _blur(self, layer, deviation):
        """Fill a layer of the surfaces' moments from their raw depth, blurred by a deviation [texels]."""
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

    def _filter(self, program, target, layer=None, images=None, block=None, count=1, **sources):
        """Write a whole texture, or layers of it, with a program; sources: {sampler: texture}.

        layer: the layer; block: of the views of the maps whose layers are written; count: of stacked maps.
        """
        with drawing.bound(program, {} if block is None else {"shadow_views": block}, sources):
            for name, image in ({"filtered": target} | (images or {})).items():
                program.image(name, image)
            if layer is not None:
                program.uniform_int("layer", layer)
            drawing.dispatch_over(program, (self._size, self._size * count))

    def _target(self, texture, layer=None, value=(0.0,) * 4):
        framebuffer = gpu.types.GPUFrameBuffer(color_slots=_slot(texture, layer), depth_slot=self._depth)
        return drawing.cleared(framebuffer, value)


def _steady(sphere, before):
    """Return the sphere (center, radius) to aim maps at for hair within `sphere`; before: the previous sphere."""
    if _is_within(sphere, before) and before[1] <= _LOOSEST * sphere[1]:
        return before
    return sphere[0], _SPARE * sphere[1]


def _is_within(sphere, other):
    """Whether a sphere (center, radius) is within another."""
    return float(np.linalg.norm(sphere[0] - other[0])) + sphere[1] <= other[1] * (1.0 + 1e-6)


def _slot(texture, layer):
    return texture if layer is None else {"texture": texture, "layer": layer}


def _linked(hair):
    """Return [(StrandsOnGPU, (N, 4, 4) object to world)] of hair that shares strands; hair: [(StrandsOnGPU, object to
    world)].
    """
    groups = strand_batches.groups_of(id(strands) for strands, _to_world in hair)
    return [(hair[group[0]][0], np.stack([hair[index][1] for index in group])) for group in groups]


def _placed(views, casts, steps, is_steady, counted):
    """Return {light's index: [(StrandsOnGPU, (N,) `_records`, (N,) records of counted strands)]}.

    views: {light's index: view}; casts: {light's index: (hair, surfaces)}; the rest as for `ShadowMaps.draw`. Records
    of lights with the same hair are computed in one call, as each call has a cost.
    """
    found, indices = {}, list(views)
    for group in strand_batches.groups_of(tuple(map(id, casts[index][0])) for index in indices):
        chosen = [indices[place] for place in group]
        seen_from = uniforms.stacked([views[index] for index in chosen])
        each = []
        for strands, to_world in _linked(casts[chosen[0]][0]):
            records = _records(strands, seen_from, to_world, steps, is_steady)
            each.append((strands, records, _fewer(records, counted)))
        for place, index in enumerate(chosen):
            found[index] = [_in_view(*one, place) for one in each]
    return found


def _in_view(strands, records, counted, place):
    """Return (StrandsOnGPU, (N,) records, (N,) counted records) of a view; both are one object if all are counted."""
    own = records[place]
    return strands, own, own if counted is records else counted[place]


def _records(strands, views, to_world, steps, is_steady):
    """Return (V, N) `drawing.strand_records` of strands in (V,) views, thickened to compensate for the length that
    fewer points lose.

    Strands at rest, or that only follow their surface, are drawn with the fewest points that show them.
    """
    if steps.point_count is None and (not is_steady or not strands.has_points):
        steps = replace(steps, point_count=level_of_detail.points_within(strands, to_world, views, _GREATEST_BEND))
    records = drawing.strand_records(strands, views, to_world, steps)
    drawn_points = records["drawn_points"]
    for count in set(drawn_points.ravel().tolist()) - {strands.point_count}:
        records["thickness"][drawn_points == count] *= strands.lengthening(count)
    return records


def _fewer(records, count):
    """Return `_records` with at most `count` strands, thickened in proportion; None: all strands."""
    if count is None or (records["drawn_strands"] <= count).all():
        return records
    fewer = records.copy()
    fewer["drawn_strands"] = np.minimum(records["drawn_strands"], count)
    fewer["thickness"] *= records["drawn_strands"] / fewer["drawn_strands"]
    return fewer


def _objects_in(maps):
    """Return [(StrandsOnGPU, block of its views, `strand_batches.Objects` of all strands, and of counted strands)] of
    the hair in maps; maps: as for `ShadowMaps._walk`.
    """
    found = {}
    for place, (_view, placed) in enumerate(maps):
        turns = Counter()  # linked hair may be in several groups
        for strands, records, counted in placed:
            key = id(strands), turns[id(strands)]
            turns[id(strands)] += 1
            found.setdefault(key, (strands, []))[1].append((place, records, counted))
    return [(strands, *_together(parts)) for strands, parts in found.values()]


def _together(parts):
    """Return (block of views, `Objects` of all strands, `Objects` of counted strands) of [(map, (N,) records, (N,)
    counted records)].
    """
    places = np.repeat([place for place, _records, _counted in parts], [len(records) for _p, records, _c in parts])
    bounding = strand_batches.shared_objects(uniforms.joined([records for _p, records, _c in parts]), places)
    counting = bounding
    if any(counted is not records for _place, records, counted in parts):
        counting = strand_batches.shared_objects(uniforms.joined([counted for _p, _r, counted in parts]), places)
    return _block_of({place: records[0] for place, records, _counted in parts}), bounding, counting


def _block_of(views):
    """Return the block of {place among maps that are drawn together: `uniforms.VIEW` record}."""
    record = uniforms.SHADOW_VIEWS.record()
    record["view"]["light_index"] = -1
    for place, view in views.items():
        record["view"][place] = view
    return uniforms.uniform_buffer(record)


def _array(size, layer_count, texture_format):
    texture = gpu.types.GPUTexture((size, size), layers=layer_count, format=texture_format)
    texture.filter_mode(True)
    texture.extend_mode("EXTEND")
    return texture


def _aim(light, hair, loose, size):
    """Write the view of a light that contains the hair into the light and return it; None without an axis.

    loose: (center, radius) of a sphere around the hair; lights inside of it use a tight sphere. The view of a light in
    or next to both contains everything up to `_WIDEST` off its axis.
    """
    position = light["position"][:3].astype(np.float64)
    is_sun = light["kind"] == SUN
    is_near = not is_sun and _is_inside(position, *loose)
    centre, radius = drawing.tight_sphere(hair) if is_near else loose
    is_inside = is_near and _is_inside(position, centre, radius)
    axis = light["axis"][:3].astype(np.float64) if is_sun else centre - position
    distance = float(np.linalg.norm(axis))
    if is_inside and light["axis"][:3].any():  # the direction of a spot or area light
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
    """Write the view of a light that contains a sphere into the light and return it; a smaller sphere if the light is
    inside.

    None for a light at the sphere's center.
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
    # The standard deviation of a disk along an axis is half its radius.
    return float(min(max(0.5 * angle * _SHADE_DISTANCE * size, _LEAST_BLUR), _MOST_BLUR * size))


def _look_at(eye, forward):
    """Return (4, 4) world to view of a camera at `eye` that looks along a unit vector, -Z of the view."""
    helper = np.array([0.0, 0.0, 1.0]) if abs(forward[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    right = np.cross(forward, helper)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = right, np.cross(right, forward), -forward
    matrix[:3, 3] = -matrix[:3, :3] @ eye
    return matrix


def _orthographic(radius):
    """Return (4, 4) view to clip of a cube around a sphere two radii ahead, with depth range for casters in front of
    it.
    """
    return np.array([[1 / radius, 0, 0, 0], [0, 1 / radius, 0, 0], [0, 0, -0.1 / radius, -0.8], [0, 0, 0, 1.0]])


def _perspective(radius, distance):
    """Return (4, 4) view to clip of a cone around a sphere, at most `_WIDEST`, with depth range for casters in front
    of it.
    """
    sine = min(radius / max(distance, radius), np.sin(_WIDEST))
    cotangent = np.sqrt(1.0 - sine**2) / sine
    near, far = _NEAREST * 2.0 * radius, distance + 4.0 * radius
    depth_scale, depth_offset = (far + near) / (near - far), 2.0 * far * near / (near - far)
    return np.array([[cotangent, 0, 0, 0], [0, cotangent, 0, 0], [0, 0, depth_scale, depth_offset], [0, 0, -1.0, 0]])
