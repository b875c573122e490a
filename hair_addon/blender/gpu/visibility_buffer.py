# SPDX-License-Identifier: GPL-3.0-or-later
"""Visibility buffer of a picture: the nearest strand segment of each sample, its depth and its light.

The depth complexity of hair is high, so only visible samples are shaded, once each, by a compute program [Burns13].
If the graphics driver supports it, a compute program also finds the nearest segments.
"""

from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property

import gpu
import numpy as np

from ...core.errors import HairError
from . import drawing, light_grid, windows
from .hair_shading import MixedShading, Shading
from .programs import scene_programs, uniforms, visibility_programs
from .strand_textures import StrandsOnGPU, seen_points

NO_SEGMENT = 0x7FFFFFFF  # beyond any possible index

# With fewer segments, occlusion culling takes longer than drawing hidden segments.
_FEW_SEGMENTS = 1 << 20


@dataclass(frozen=True)
class _Placed:
    """One hair object in a picture, and its range of segments."""

    strands: StrandsOnGPU
    shading: Shading | MixedShading
    record: np.ndarray  # uniforms.VIEW
    samplers: dict
    first: int
    lights: gpu.types.GPUUniformBuf
    window: tuple  # of `windows`
    is_round: bool  # whether any strand is so wide that its bends and ends are visible

    @cached_property
    def view(self):
        """The record on the GPU."""
        return uniforms.uniform_buffer(self.record)

    @property
    def is_seen(self):
        """Whether any part of the picture may show the hair."""
        return all(self.window[2:])

    @property
    def segment_count(self):
        return self.strands.strand_count * (int(self.record["drawn_points"]) - 1)

    @property
    def run_count(self):
        return int(self.record["drawn_strands"]) * drawing.runs_of_strand(self.record)


_NOTHING = (0.0, 0.0, 0.0, 0.0)


def _are_clears_slow():
    """Whether clearing a texture may take much longer than filling it with a program, as with some OpenGL drivers."""
    return gpu.platform.backend_type_get() == "OPENGL"


class VisibilityBuffer:
    """Textures of width × height samples: surfaces are drawn first, then hair, which surfaces occlude.

    color: linear light, premultiplied; segments: the nearest segment of strands, or beyond `NO_SEGMENT` the nearest
    triangle of surfaces that were drawn into `numbered`; surface_depth: depth of surfaces from 0 to 1; depths: bits of
    floats from 0 to 1, of the nearest hair, else of surfaces, else 1.
    """

    def __init__(self, width, height, is_coarse=False):
        """is_coarse: whether two by two samples of a surface may be shaded together."""
        self.size, self.is_coarse = (width, height), is_coarse
        self.color = gpu.types.GPUTexture(self.size, format=scene_programs.PICTURE_FORMAT)
        self.depths = gpu.types.GPUTexture(self.size, format="R32UI")
        self.segments = gpu.types.GPUTexture(self.size, format="R32UI")
        tiles = tuple(-(-length // visibility_programs.TILE) for length in self.size)
        self._farthest = gpu.types.GPUTexture(tiles, format="R32UI")  # farthest depth in each tile
        self._seen_runs = None  # a texel for each run of segments
        self.surface_depth = gpu.types.GPUTexture(self.size, format="DEPTH_COMPONENT32F")
        self._hair = []  # _Placed
        self._clip_planes = None  # of `find_hair`
        self._has_strips = False  # whether `depths` only contains strips
        # (format, background) → (framebuffer, texture, framebuffer of `behind_hair`, depth) of additional passes
        self._parts = {}
        self._surfaces = gpu.types.GPUFrameBuffer(color_slots=self.color, depth_slot=self.surface_depth)
        self._hiding = gpu.types.GPUFrameBuffer(depth_slot=self.surface_depth)
        self._numbered = gpu.types.GPUFrameBuffer(color_slots=self.segments, depth_slot=self.surface_depth)
        self._is_color_stale = self._is_numbered = False  # whether to clear `color`, and to keep `segments`
        self._strips = gpu.types.GPUFrameBuffer(color_slots=(self.segments, self.depths), depth_slot=self.surface_depth)

    def surfaces(self, background=_NOTHING):
        """Return a context with the framebuffer of surfaces bound and cleared."""
        self._is_color_stale = self._is_numbered = False
        return drawing.cleared(self._surfaces, background)

    def hiding(self):
        """Return a context with the framebuffer of surfaces that only occlude hair: only depths, `color` stays
        transparent.
        """
        self._is_color_stale, self._is_numbered = True, False
        return drawing.cleared(self._hiding, _NOTHING)

    @contextmanager
    def numbered(self):
        """A context with the framebuffer of triangle numbers, for surfaces that are shaded after `find_hair`."""
        self._is_color_stale, self._is_numbered = False, True  # `color` is filled later
        if not _are_clears_slow():
            self.segments.clear(format="UINT", value=(NO_SEGMENT,))
        with self._numbered.bind():
            if _are_clears_slow():
                with drawing.gpu_state("NONE", depth_writes=False):
                    drawing.draw_cover(visibility_programs.no_triangle_program(), {}, {})
            self._numbered.clear(depth=1.0)
            yield

    def fill(self, picture, color):
        """Fill a picture, `color` or `part`, before programs shade it."""
        if not _are_clears_slow():
            picture.clear(format="FLOAT", value=color)
            return
        program = visibility_programs.fill_program()
        with drawing.bound(program, {}, {}):
            program.image("picture", picture)
            program.uniform_float("fill_color", color)
            drawing.dispatch_over(program, self.size)

    @contextmanager
    def behind_hair(self, picture, color):
        """A context with the framebuffer of a picture, `color` or `part`, filled with a color, and `surface_depth`.

        Something must be drawn into it; otherwise use `fill`.
        """
        is_part = picture is not self.color
        framebuffer = self._part(scene_programs.PICTURE_FORMAT, _NOTHING)[2] if is_part else self._surfaces
        with framebuffer.bind():
            framebuffer.clear(color=color)
            yield

    def exclude_behind_hair(self):
        """Set `surface_depth` to zero where hair is nearest, to draw nothing there, and blank samples of surfaces."""
        self.nearest_depths()  # reads `surface_depth`
        with drawing.gpu_state("NONE", depth_writes=False):
            drawing.draw_cover(visibility_programs.surface_blank_program(), {}, {"segments": self.segments})
        program = visibility_programs.hair_first_program()
        with (
            drawing.gpu_state("ALWAYS", depth_writes=True),
            drawing.bound(program, {}, {"segments": self.segments}),
        ):
            for window in (placed.window for placed in self._hair if placed.is_seen):
                with windows.drawn_in(window):
                    drawing.cover(program)

    def add_hair(self, hair, lights, view, in_compute=None, clip_planes=None):
        """Find the hair in front of surfaces and shade it; arguments as for `find_hair`."""
        self.find_hair(hair, lights, view, in_compute, clip_planes)
        self.shade_hair()

    def shade_hair(self):
        """Shade the hair that `find_hair` found."""
        for placed in self._hair:
            self._shade(placed, self.color)

    def find_hair(self, hair, lights, view, in_compute=None, clip_planes=None):
        """Fill `segments` and `depths` with the nearest hair in front of surfaces. Raises `HairError`.

        hair: [(StrandsOnGPU, Shading, object to world, {sampler: texture} of the scene, Steps), ...]; lights, view:
        records of `uniforms`, lights one for all hair or (H,) for each; in_compute: find the nearest strands by a
        compute program, None: if supported; clip_planes: (6, 4) of `uniforms.CLIPPING`, None for none.
        """
        self._clip_planes = clip_planes
        self._hair = self._placed(hair, lights, view)
        is_refused = bool(self._hair) and self._hair[-1].first + self._hair[-1].segment_count > NO_SEGMENT
        if not is_refused and (scene_programs.has_image_atomics() if in_compute is None else in_compute):
            self._find()
            return
        self._clear()
        if is_refused:
            self._hair = []
            raise HairError("Too many strands for one picture: hide some hair or some of its instances.")
        self._draw_strips()

    def _clear(self):
        if not self._is_numbered:
            self.segments.clear(format="UINT", value=(NO_SEGMENT,))
        if self._is_color_stale:
            self.color.clear(format="FLOAT", value=_NOTHING)
            self._is_color_stale = False

    def _placed(self, hair, lights, view):
        """Return [_Placed] from the arguments of `find_hair`."""
        found, first = [], 0
        light_blocks = [uniforms.uniform_buffer(record) for record in np.atleast_1d(lights)]
        placed = [
            (strands, drawing.strand_record(strands, view, to_world, steps))
            for strands, _shading, to_world, _samplers, steps in hair
        ]
        all_windows = windows.of_strands(placed, self.size)
        are_round = windows.may_be_wide(placed, self.size, visibility_programs.LEAST_BEND)
        for index, ((strands, record), (_, shading, _, samplers, _)) in enumerate(zip(placed, hair, strict=True)):
            record["first_segment"] = first
            record["seen_points"] = seen_points(strands.point_count)
            record["seen_opacity"] = shading.opacity
            record["hair_forward"][:3], record["hair_reflectance"][:3] = shading.forward, shading.reflectance
            light_block, place = light_blocks[index if lights.shape else 0], (all_windows[index], are_round[index])
            found.append(_Placed(strands, shading, record, samplers, first, light_block, *place))
            first += found[-1].segment_count
        return found

    def relight(self, hair, lights, view, picture):
        """Fill a picture with the samples of hair from `find_hair`, shaded with other lights.

        hair, lights, view: as for `find_hair`, with the same strands and view. `color` is not changed.
        """
        for placed in self._placed(hair, lights, view):
            self._shade(placed, picture)

    @property
    def segment_ranges(self):
        """[(first, count)] of the segments of each hair in the last `find_hair`."""
        return [(placed.first, placed.segment_count) for placed in self._hair]

    def surfaces_of_part(self, texture_format=scene_programs.PICTURE_FORMAT, background=_NOTHING):
        """Clear and return the framebuffer of surfaces for `part_of_light`, `part_by` and `part`."""
        return drawing.cleared(self._part(texture_format, background)[0], background)

    def _part(self, texture_format, background):
        # Each background has its own texture: a software driver sometimes loses the clearing of a texture that compute
        # programs have filled, if nothing is drawn into it.
        if (texture_format, background) not in self._parts:
            # A framebuffer does not own its textures.
            texture = gpu.types.GPUTexture(self.size, format=texture_format)
            depth = gpu.types.GPUTexture(self.size, format="DEPTH_COMPONENT32F")
            framebuffer = gpu.types.GPUFrameBuffer(color_slots=texture, depth_slot=depth)
            behind = gpu.types.GPUFrameBuffer(color_slots=texture, depth_slot=self.surface_depth)
            self._parts[texture_format, background] = framebuffer, texture, behind, depth
        return self._parts[texture_format, background]

    def part(self, texture_format=scene_programs.PICTURE_FORMAT, background=_NOTHING):
        """Return the texture of `surfaces_of_part`."""
        return self._part(texture_format, background)[1]

    def part_by(self, program, texture_format=scene_programs.PICTURE_FORMAT, inputs=None):
        """Return the texture of `surfaces_of_part`, filled by a program where the last added hair is nearest.

        inputs: for each hair ({instance: record}, {sampler: texture}) of the program besides the scene's.
        """
        texture = self._parts[texture_format, _NOTHING][1]
        for placed, (records, textures) in zip(self._hair, inputs or [({}, {})] * len(self._hair), strict=True):
            blocks = {name: uniforms.uniform_buffer(record) for name, record in records.items()}
            self._fill(placed, program, texture, blocks, textures)
        return texture

    def part_of_light(self, lobes, world):
        """Return a texture of a part of the light of the last added hair, premultiplied.

        lobes: (4,) factors of R, TT, TRT and all other light from lamps; world: factor of the world's light.
        """
        with self.surfaces_of_part():
            pass
        texture = self._parts[scene_programs.PICTURE_FORMAT, _NOTHING][1]
        for placed in self._hair:
            self._shade(placed, texture, {"drawn_lobes": lobes, "drawn_world": world})
        return texture

    def hair_at(self, x, y):
        """Index of the last added hair that is nearest in a sample, or None."""
        with self._strips.bind():  # a framebuffer has no size before it is bound
            segment = int(self._strips.read_color(x, y, 1, 1, 1, 0, "UINT")[0][0][0])
        within = [placed.first <= segment < placed.first + placed.segment_count for placed in self._hair]
        return within.index(True) if any(within) else None

    def hair_near(self, x, y, reach):
        """Index of the hair visible nearest to a sample, at most `reach` samples away, or None."""
        left, bottom = max(x - reach, 0), max(y - reach, 0)
        width, height = min(x + reach + 1, self.size[0]) - left, min(y + reach + 1, self.size[1]) - bottom
        if width <= 0 or height <= 0:
            return None
        with self._strips.bind():
            read = self._strips.read_color(left, bottom, width, height, 1, 0, "UINT")
        segments = np.array(read, np.int64).reshape(height, width)
        rows, columns = np.indices(segments.shape)
        away = np.hypot(rows + bottom - y, columns + left - x)
        found = np.full(segments.shape, -1)
        for index, placed in enumerate(self._hair):
            found[(placed.first <= segments) & (segments < placed.first + placed.segment_count)] = index
        away[(found < 0) | (away > reach)] = np.inf
        nearest = np.unravel_index(np.argmin(away), away.shape)
        return int(found[nearest]) if np.isfinite(away[nearest]) else None

    def _find(self):
        """Find the nearest segments by compute programs: first depths, then indices."""
        self._copy_depths(is_start=True)
        self._provide_runs(sum(placed.run_count for placed in self._hair if placed.is_seen))
        self._is_color_stale = self._has_strips = False
        clipping = uniforms.clipping_blocks(self._clip_planes)
        all_blocks = [{"view": placed.view, "lights": placed.lights} | clipping for placed in self._hair]
        if sum(placed.segment_count for placed in self._hair if placed.is_seen) < _FEW_SEGMENTS:
            self._walk(all_blocks, drawing.WALK_ALL, is_depth=True)
            self._walk(all_blocks, drawing.WALK_ALL, is_depth=False)
            return
        # A few strands occlude most of the others.
        self._walk(all_blocks, drawing.WALK_FIRST, is_depth=True)
        self._find_farthest()
        self._walk(all_blocks, drawing.WALK_OTHERS, is_depth=True, are_tiles_known=True)
        self._find_farthest()
        self._walk(all_blocks, drawing.WALK_ALL, is_depth=False, are_tiles_known=True)

    def _provide_runs(self, count):
        """Provide a texture of at least `count` runs."""
        rows = -(-count // visibility_programs.RUNS_IN_ROW)
        if self._seen_runs is None or self._seen_runs.height < rows:
            self._seen_runs = gpu.types.GPUTexture((visibility_programs.RUNS_IN_ROW, max(rows, 1)), format="R32UI")

    def _find_farthest(self):
        """Fill each tile with its farthest depth."""
        program = visibility_programs.farthest_depths_program()
        with drawing.bound(program, {}, {"depths": self.depths}):
            program.image("farthest_depths", self._farthest)
            drawing.dispatch_over(program, (self._farthest.width, self._farthest.height))

    def _walk(self, all_blocks, part, is_depth, are_tiles_known=False):
        images = {"depths": self.depths, "segments": self.segments, "seen_runs": self._seen_runs}
        samplers, first_run = {"farthest_depths": self._farthest}, 0
        for placed, blocks in zip(self._hair, all_blocks, strict=True):
            if not placed.is_seen:
                continue
            constants = {"first_run": first_run, "are_tiles_known": int(are_tiles_known)}
            program = scene_programs.segments_program(is_depth, placed.is_round, self._clip_planes is not None)
            first_run += placed.run_count
            drawing.rasterize_strands(placed.strands, program, placed.record, blocks, samplers, images, constants, part)

    def nearest_depths(self):
        """`depths` of hair, and of surfaces elsewhere."""
        if self._has_strips:
            self._copy_depths()  # strips are drawn into `surface_depth` too
            self._has_strips = False
        return self.depths

    def _copy_depths(self, is_start=False):
        """Fill `depths` with depths of surfaces; is_start: also clear the other textures that must be cleared.

        With some drivers clearing textures takes longer than this program.
        """
        program = visibility_programs.surface_depths_program()
        with drawing.bound(program, {}, {"surface_depth": self.surface_depth}):
            for name, image in (("depths", self.depths), ("segments", self.segments), ("picture", self.color)):
                program.image(name, image)
            program.uniform_int("is_start", int(is_start and not self._is_numbered))
            program.uniform_int("is_blank", int(is_start and self._is_color_stale))
            drawing.dispatch_over(program, self.size)

    def _draw_strips(self):
        """Find the nearest segments by drawing triangle strips."""
        program = scene_programs.strip_segments_program(self._clip_planes is not None)
        with self._strips.bind(), drawing.gpu_state("LESS_EQUAL", depth_writes=True):
            for placed in filter(lambda placed: placed.is_seen, self._hair):
                drawing.draw_strip(placed.strands, program, placed.record, placed.lights, clip_planes=self._clip_planes)
        self._has_strips = True

    def _shade(self, placed, picture, parts=None):
        """Fill the samples in which a hair is nearest with its light, or with parts of its light.

        parts: constants of fibre/drawn_lobes.glsl.
        """
        for shading, mix in placed.shading.layers:
            has_options = parts is not None or mix is not None
            program = shading.program
            if has_options:
                program = shading.variant(in_parts=parts is not None, is_mixed=mix is not None)
            program.bind()
            for name, value in (parts or {}).items():
                program.uniform_float(name, value)
            textures, record = dict(shading.samplers), None
            if shading.is_mapped:
                textures["strand_looks"] = placed.strands.looks
            elif shading.is_varied:
                textures["strand_randoms"] = placed.strands.randoms
            if mix is not None:
                program.uniform_float("wetness_range", mix.wetness_range)
                program.uniform_int("is_wet", int(mix.is_wet))
                textures["strand_wetness"] = placed.strands.wetness
                record = placed.record.copy()
                record["hair_forward"][:3], record["hair_reflectance"][:3] = shading.forward, shading.reflectance
            self._fill(placed, program, picture, shading.blocks, textures, record)

    def _fill(self, placed, program, picture, blocks, textures, record=None):
        """Run a program on the samples in which a hair is nearest; record: replaces the hair's record."""
        left, bottom, *size = placed.window
        if not placed.is_seen:
            return
        view = placed.view if record is None else uniforms.uniform_buffer(record)
        blocks = {"view": view, "lights": placed.lights, **blocks}
        grid = light_grid.none()
        textures = {"light_grid": grid, **placed.samplers, **textures}
        textures |= {"segments": self.segments, **drawing.strand_samplers(placed.strands)}
        with drawing.bound(program, blocks, textures):
            program.image("picture", picture)
            program.uniform_int("window_left", left)
            program.uniform_int("window_bottom", bottom)
            drawing.dispatch_over(program, (size[0], -(-size[1] // scene_programs.SAMPLES_OF_THREAD)))
