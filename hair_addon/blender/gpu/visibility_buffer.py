# SPDX-License-Identifier: GPL-3.0-or-later
"""Visibility buffer of a picture: the nearest strand segment of each sample, its depth and its light.

The depth complexity of hair is high, so only visible samples are shaded, once each, by a compute program [Burns13].
If the graphics driver supports it, a compute program also finds the nearest segments.
"""

from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby

import gpu
import numpy as np

from ...core.errors import HairError
from . import drawing, light_grid, strand_batches, windows
from .programs import scene_programs, uniforms, visibility_programs
from .strand_textures import seen_points
from .surface_shading import white

NO_SEGMENT = 0x7FFFFFFF  # beyond any possible index

# With fewer, or with shorter segments [samples], occlusion culling takes longer than drawing hidden segments.
_FEW_SEGMENTS, _SHORT_SEGMENTS = 1 << 20, 2.0 * visibility_programs.TILE

# Number of strands whose coverage is counted per strand that has depths and light: its limits, and the length of
# strands [samples] that adds one.
_LEAST_FINER, _MOST_FINER, _FINER_LENGTH = 4.0, 6.0, 10.0


@dataclass(frozen=True, eq=False)
class _Placed:
    """The visible objects of a `strand_batches.Batch` in a picture."""

    batch: strand_batches.Batch
    indices: np.ndarray  # (N,) as of the batch
    records: np.ndarray  # (N,) uniforms.VIEW
    lights: gpu.types.GPUUniformBuf
    windows: np.ndarray  # (N, 4) of `windows`
    layers: np.ndarray | None  # (N,) as of the batch
    is_round: bool  # whether any strand is so wide that its bends and ends are visible
    first_run: int  # number of runs of segments before these objects
    tints: np.ndarray | None  # (N, 3) as of the batch

    @cached_property
    def view(self):
        """The first object's record on the GPU."""
        return uniforms.uniform_buffer(self.records[0])

    @cached_property
    def objects(self):
        """`strand_batches.Objects`; None for a single object with textures of its own."""
        if self.layers is None:
            return None
        return strand_batches.Objects(self.records, self.layers, self.first_run, self.tints)

    @property
    def finer(self):
        """These objects with more, thinner strands of the same area."""
        records, steps = self.records.copy(), self.batch.steps
        most = self.batch.strands.strand_count if steps.most_strands is None else steps.most_strands
        drawn = self.records["drawn_strands"]
        finer = drawn * np.clip(self._strand_lengths / _FINER_LENGTH, _LEAST_FINER, _MOST_FINER)
        records["drawn_strands"] = np.maximum(np.minimum(finer, most), drawn)
        records["thickness"] *= drawn / records["drawn_strands"]
        return replace(self, records=records)

    @property
    def window(self):
        """The window around all objects."""
        low = self.windows[:, :2].min(axis=0)
        high = (self.windows[:, :2] + self.windows[:, 2:]).max(axis=0)
        return (*low.tolist(), *(high - low).tolist())

    @property
    def segment_count(self):
        """Number of drawn segments."""
        pieces = self.records["drawn_points"].astype(np.int64) - 1
        return int((self.records["drawn_strands"] * pieces).sum())

    @property
    def total_length(self):
        """Length of all drawn segments seen from the side [samples]; infinite for hair around the viewer."""
        return float((self.records["drawn_strands"] * self._strand_lengths).sum())

    @property
    def smooth_length(self):
        """Length [samples] over which the mean color of hair changes: that of strands, if each represents many."""
        parts_left = 1.0 - self.records["drawn_strands"] / self.batch.strands.strand_count
        lengths = np.zeros(len(parts_left))
        np.multiply(parts_left, self._strand_lengths, out=lengths, where=parts_left > 0.0)
        return float(lengths.min())

    @property
    def _strand_lengths(self):
        """(N,) mean lengths of strands seen from the side [samples]; infinite for hair around the viewer."""
        records, bounds = self.records, self.batch.strands.box.likely
        middle = np.append(0.5 * bounds.sum(axis=0, dtype=np.float64), 1.0)
        depths = records["object_to_clip"].transpose(0, 2, 1)[:, 3] @ middle
        per_unit = records["pixels_per_unit"] * records["object_scale"] * self.batch.strands.mean_length
        return np.divide(per_unit, depths, out=np.full(len(records), np.inf), where=depths > 0.0)

    @property
    def run_count(self):
        runs_of_strand = -(-(self.records["drawn_points"].astype(np.int64) - 1) // scene_programs.RUN_LENGTH)
        return int((self.records["drawn_strands"] * runs_of_strand).sum())

    def each(self):
        """Yield (index of the object's hair, its record on the GPU, its window) for each object."""
        for index, record, window in zip(self.indices.tolist(), self.records, self.windows.tolist(), strict=True):
            yield index, uniforms.uniform_buffer(record), window


@dataclass(frozen=True)
class NearestSamples:
    """The sample that represents each pixel of a picture.

    texture: the sample's index in the textures of a `VisibilityBuffer`, row by row; per_side: samples along each side
    of a pixel; corner: origin of the buffer in the picture [samples]; reach: maximum distance of the sample from its
    pixel [pixels].
    """

    texture: gpu.types.GPUTexture
    per_side: int
    corner: tuple
    reach: int

    def window(self, window):
        """Return the pixels (left, bottom, width, height) whose samples may be in a window of the buffer."""
        size = self.texture.width, self.texture.height
        found = []
        for first, length, corner, most in zip(window[:2], window[2:], self.corner, size, strict=True):
            low = max((first + corner) // self.per_side - self.reach, 0)
            high = min(-(-(first + length + corner) // self.per_side) + self.reach, most)
            found.append((low, max(high - low, 0)))
        (left, width), (bottom, height) = found
        return left, bottom, width, height


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
        self._covered_texture = None
        # Parts of samples that the last hair covers, as bits of visibility/covered_parts.glsl; None if not counted.
        self.covered = None
        self._seen_runs = None  # a texel for each run of segments
        self.surface_depth = gpu.types.GPUTexture(self.size, format="DEPTH_COMPONENT32F")
        self._hair = []  # _Placed
        self._firsts = self._counts = np.zeros(0, np.int64)  # of the segments of each hair
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
            for placed in self._hair:
                with windows.drawn_in(placed.window):
                    drawing.cover(program)

    def add_hair(self, hair, lights, view, in_compute=None, clip_planes=None, is_counted=False):
        """Find the hair in front of surfaces and shade it; arguments as for `find_hair`."""
        self.find_hair(hair, lights, view, in_compute, clip_planes, is_counted)
        self.shade_hair()

    def shade_hair(self):
        """Shade the hair that `find_hair` found."""
        for placed in self._hair:
            self._shade(placed, self.color)

    def find_hair(self, hair, lights, view, in_compute=None, clip_planes=None, is_counted=False):
        """Fill `segments` and `depths` with the nearest hair in front of surfaces. Raises `HairError`.

        hair: [`strand_batches.Batch`], or [(StrandsOnGPU, Shading, object to world, {sampler: texture} of the scene,
        Steps)] of single objects; lights, view: records of `uniforms`, lights one for all hair or (H,) for each;
        in_compute: find the nearest strands by a compute program, None: if supported; clip_planes: (6, 4) of
        `uniforms.CLIPPING`, None for none; is_counted: also fill `covered`, if a compute program draws all strands.
        """
        self._clip_planes, self.covered = clip_planes, None
        self._hair = self._placed(hair, lights, view)
        is_refused = int(self._counts.sum()) > NO_SEGMENT
        if not is_refused and (scene_programs.has_image_atomics() if in_compute is None else in_compute):
            self._find(is_counted)
            return
        self._clear()
        if is_refused:
            self._hair, self._firsts, self._counts = [], self._firsts[:0], self._counts[:0]
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
        batches = [
            one if isinstance(one, strand_batches.Batch) else strand_batches.single(one, index)
            for index, one in enumerate(hair)
        ]
        all_records = [drawing.strand_records(one.strands, view, one.to_world, one.steps) for one in batches]
        self._counts = np.zeros(sum(len(one.indices) for one in batches), np.int64)
        for batch, records in zip(batches, all_records, strict=True):
            pieces = records["drawn_points"].astype(np.int64) - 1
            self._counts[batch.indices] = batch.strands.strand_count * pieces
        self._firsts = np.cumsum(self._counts) - self._counts
        found, run_count, light_block = [], 0, None if lights.shape else uniforms.uniform_buffer(lights)
        for batch, records in zip(batches, all_records, strict=True):
            shading = batch.shading
            records["first_segment"] = self._firsts[batch.indices]
            records["seen_points"] = seen_points(batch.strands.point_count)
            records["seen_opacity"] = shading.opacity
            records["hair_forward"][:, :3], records["hair_reflectance"][:, :3] = shading.forward, shading.reflectance
            places = windows.of_strands(batch.strands, records, self.size)
            are_round = windows.may_be_wide(batch.strands, records, self.size, visibility_programs.LEAST_BEND)
            are_seen = (places[:, 2:] > 0).all(axis=1)
            if not are_seen.any():
                continue
            block = light_block or uniforms.uniform_buffer(lights[batch.indices[0]])
            layers = None if batch.layers is None else batch.layers[are_seen]
            seen = batch.indices[are_seen], records[are_seen], block, places[are_seen], layers
            tints = None if batch.tints is None else batch.tints[are_seen]
            found.append(_Placed(batch, *seen, bool(are_round[are_seen].any()), run_count, tints))
            run_count += found[-1].run_count
        return found

    def relight(self, hair, lights, view, picture):
        """Fill a picture with the samples of hair from `find_hair`, shaded with other lights.

        hair, lights, view: as for `find_hair`, with the same strands and view. `color` is not changed.
        """
        for placed in self._placed(hair, lights, view):
            self._shade(placed, picture)

    @property
    def smooth_length(self):
        """The least length [samples] over which the mean color of a hair changes."""
        return min((placed.smooth_length for placed in self._hair), default=0.0)

    @property
    def segment_ranges(self):
        """[(first, count)] of the segments of each hair in the last `find_hair`."""
        return list(zip(self._firsts.tolist(), self._counts.tolist(), strict=True))

    def surfaces_of_part(self, texture_format=scene_programs.PICTURE_FORMAT, background=_NOTHING):
        """Clear and return the framebuffer of surfaces for `part_of_light`, `part_by` and `part`."""
        return drawing.cleared(self._part(texture_format, background)[0], background)

    @contextmanager
    def seen_surfaces_of_part(self, texture_format):
        """A context with the cleared framebuffer of `part` and the depth of surfaces that were drawn last."""
        framebuffer = self._part(texture_format, _NOTHING)[2]
        with framebuffer.bind():
            framebuffer.clear(color=_NOTHING)
            yield

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

    def part_by(self, program, texture_format=scene_programs.PICTURE_FORMAT, inputs=None, joined=None):
        """Return the texture of `surfaces_of_part`, filled by a program where the last added hair is nearest.

        inputs: for each hair ({instance: record}, {sampler: texture}) of the program besides the scene's; joined: a
        function that returns (program, *inputs) for all linked hair with these indices, or None.
        """
        texture = self._parts[texture_format, _NOTHING][1]
        self._fill_by(program, texture, inputs, joined)
        return texture

    def fill_nearest(self, texture, nearest, program, inputs, joined):
        """Fill the pixels of a texture whose nearest sample shows hair by a program, as `part_by` fills samples.

        nearest: the `NearestSamples` of the pixels.
        """
        self._fill_by(program, texture, inputs, joined, nearest)

    def _fill_by(self, program, texture, inputs, joined, nearest=None):
        for placed in self._hair:
            together = None if placed.objects is None or joined is None else joined(placed.indices)
            if together is not None:
                program_of_all, records, textures = together
                program_of_all.bind()
                blocks = {name: uniforms.uniform_buffer(record) for name, record in records.items()}
                textures = textures | self._declare_objects(placed, program_of_all)
                blocks["shared_view"] = placed.view
                self._fill(placed, program_of_all, texture, blocks, textures, placed.window, nearest)
                continue
            own = {} if placed.layers is None else dict.fromkeys(scene_programs.VISIBILITY_SAMPLERS, white())
            for index, view, window in placed.each():
                records, textures = ({}, {}) if inputs is None else inputs[index]
                blocks = {name: uniforms.uniform_buffer(record) for name, record in records.items()}
                self._fill(placed, program, texture, {"view": view, **blocks}, own | textures, window, nearest)

    def part_of_light(self, lobes, world):
        """Return a texture of a part of the light of the last added hair, premultiplied.

        lobes: (4,) factors of R, TT, TRT and all other light from lamps; world: factor of the world's light.
        """
        with self.surfaces_of_part():
            pass
        texture = self._parts[scene_programs.PICTURE_FORMAT, _NOTHING][1]
        for placed in self._hair:
            self._shade(placed, texture, {"part_lobes": lobes, "part_world": world})
        return texture

    def hair_at(self, x, y):
        """Index of the last added hair that is nearest in a sample, or None."""
        with self._strips.bind():  # a framebuffer has no size before it is bound
            segment = int(self._strips.read_color(x, y, 1, 1, 1, 0, "UINT")[0][0][0])
        within = (self._firsts <= segment) & (segment < self._firsts + self._counts)
        return int(np.argmax(within)) if within.any() else None

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
        ends = self._firsts + self._counts
        found = np.searchsorted(ends, segments, side="right")
        found[segments >= (ends[-1] if len(ends) else 0)] = -1
        away[(found < 0) | (away > reach)] = np.inf
        nearest = np.unravel_index(np.argmin(away), away.shape)
        return int(found[nearest]) if np.isfinite(away[nearest]) else None

    def _find(self, is_counted):
        """Find the nearest segments by compute programs: first depths, then indices."""
        self._copy_depths(is_start=True)
        self._provide_runs(sum(placed.run_count for placed in self._hair))
        self._is_color_stale = self._has_strips = False
        clipping = uniforms.clipping_blocks(self._clip_planes)
        names = ["view" if placed.layers is None else "shared_view" for placed in self._hair]
        all_blocks = [
            {name: placed.view, "lights": placed.lights} | clipping
            for name, placed in zip(names, self._hair, strict=True)
        ]
        count = sum(placed.segment_count for placed in self._hair)
        length = sum(placed.total_length for placed in self._hair)
        if count < _FEW_SEGMENTS or length < _SHORT_SEGMENTS * count:
            self._walk(all_blocks, drawing.WALK_ALL, is_depth=True)
            self._walk(all_blocks, drawing.WALK_ALL, is_depth=False)
            if is_counted:
                self._clear_covered()
                self._find_parts(clipping)
            return
        # A few strands occlude most of the others.
        self._walk(all_blocks, drawing.WALK_FIRST, is_depth=True)
        self._find_farthest()
        self._walk(all_blocks, drawing.WALK_OTHERS, is_depth=True, are_tiles_known=True)
        self._find_farthest()
        self._walk(all_blocks, drawing.WALK_ALL, is_depth=False, are_tiles_known=True)

    def _clear_covered(self):
        if self._covered_texture is None:
            self._covered_texture = gpu.types.GPUTexture(self.size, format="R32UI")
        self.covered = self._covered_texture
        self.covered.clear(format="UINT", value=(0,))

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
        shared = {"farthest_depths": self._farthest}, images, {"are_tiles_known": int(are_tiles_known)}, part
        drawn, is_clipped = zip(self._hair, all_blocks, strict=True), self._clip_planes is not None
        for kind, some in groupby(drawn, key=lambda one: (one[0].is_round, one[0].objects is not None)):
            is_round, is_batch = kind
            program = scene_programs.segments_program(is_depth, is_round, is_clipped, is_batch)
            with drawing.rasterizing(program, {}, *shared):
                for placed, blocks in some:
                    strands, first_run = placed.batch.strands, {"first_run": placed.first_run}
                    if is_batch:
                        placed.objects.rasterize(strands, program, blocks, {}, part)
                    else:
                        drawing.rasterize_strands(strands, program, placed.records[0], blocks, first_run, part)

    def _find_parts(self, clipping):
        """Fill `covered` after `depths`; clipping: of `uniforms.clipping_blocks`."""
        images, samplers = {"depths": self.depths, "covered": self.covered}, {"surface_depth": self.surface_depth}
        for placed in self._hair:
            finer, is_batch = placed.finer, placed.layers is not None
            program = scene_programs.parts_program(finer.is_round, self._clip_planes is not None, is_batch)
            blocks = {"shared_view" if is_batch else "view": finer.view, "lights": finer.lights} | clipping
            with drawing.rasterizing(program, {}, samplers, images, {}):
                if is_batch:
                    finer.objects.rasterize(placed.batch.strands, program, blocks, {})
                else:
                    drawing.rasterize_strands(placed.batch.strands, program, finer.records[0], blocks, {})

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
            for placed in self._hair:
                for record in placed.records:
                    arguments = placed.batch.strands, program, record, placed.lights
                    drawing.draw_strip(*arguments, clip_planes=self._clip_planes)
        self._has_strips = True

    def _shade(self, placed, picture, parts=None):
        """Fill the samples in which a hair is nearest with its light, or with parts of its light.

        parts: constants of fibre/part_of_lobes.glsl.
        """
        strands, objects = placed.batch.strands, placed.objects
        for shading, mix in placed.batch.shading.layers:
            options = {"in_parts": parts is not None, "is_mixed": mix is not None, "is_batch": objects is not None}
            program = shading.variant(**options) if any(options.values()) else shading.program
            program.bind()
            for name, value in (parts or {}).items():
                program.uniform_float(name, value)
            textures, view = dict(shading.samplers), placed.view
            if shading.is_mapped:
                textures["strand_looks"] = strands.looks
                if shading.is_radial:
                    textures["strand_radial"] = strands.radial
            elif shading.is_varied:
                textures["strand_randoms"] = strands.randoms
            if mix is not None:
                program.uniform_float("wetness_range", mix.wetness_range)
                program.uniform_int("is_wet", int(mix.is_wet))
                textures["strand_wetness"] = strands.wetness
                record = placed.records[0].copy()
                record["hair_forward"][:3], record["hair_reflectance"][:3] = shading.forward, shading.reflectance
                view = uniforms.uniform_buffer(record)
            if objects is not None:
                textures |= self._declare_objects(placed, program)
            blocks = {"view" if objects is None else "shared_view": view, **shading.blocks}
            self._fill(placed, program, picture, blocks, textures, placed.window)

    @staticmethod
    def _declare_objects(placed, program):
        """Give a bound program the linked objects of a `_Placed`; returns {sampler: texture}."""
        program.uniform_int("object_count", placed.objects.count)
        program.uniform_int("last_segment", placed.objects.last_segment)
        return {"objects": placed.objects.texture}

    def _fill(self, placed, program, picture, blocks, textures, window, nearest=None):
        """Run a program on the samples of a window in which a hair is nearest, or on the pixels of `NearestSamples`."""
        if nearest is not None:
            window, textures = nearest.window(window), textures | {"places": nearest.texture}
        left, bottom, *size = window
        blocks = {"lights": placed.lights, **blocks}
        grid = light_grid.none()
        textures = {"light_grid": grid, **placed.batch.samplers, **textures}
        textures |= {"segments": self.segments, **drawing.strand_samplers(placed.batch.strands)}
        with drawing.bound(program, blocks, textures):
            program.image("picture", picture)
            program.uniform_int("window_left", left)
            program.uniform_int("window_bottom", bottom)
            drawing.dispatch_over(program, (size[0], -(-size[1] // scene_programs.SAMPLES_OF_THREAD)))
