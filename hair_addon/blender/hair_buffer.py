# SPDX-License-Identifier: GPL-3.0-or-later
"""The samples of a picture: which segment of which strand is nearest in each, how deep it is, and its light.

Strands overlap many times over, and only what is seen is shaded: once a sample, however much hair lies behind it, by a
compute program [Burns13]. Where the graphics driver can, one finds the nearest strands too.
"""

import gpu

from ..core.shading import dual_scattering
from . import drawing, shaders, uniforms
from .strand_textures import seen_points

_NO_SEGMENT = 0x7FFFFFFF  # beyond all that there can be


class HairBuffer:
    """Textures of width × height samples: surfaces are drawn first, then hair, which they hide.

    color: linear light, premultiplied; depths: of hair where color has any, the bits of floats from 0 to 1.
    """

    def __init__(self, width, height):
        self.size = (width, height)
        self.color = gpu.types.GPUTexture(self.size, format=shaders.PICTURE_FORMAT)
        self.depths = gpu.types.GPUTexture(self.size, format="R32UI")
        self._segments = gpu.types.GPUTexture(self.size, format="R32UI")
        self._surface_depth = gpu.types.GPUTexture(self.size, format="DEPTH_COMPONENT32F")
        self._ranges = []  # (first, count) of each hair's segments
        self._surfaces = gpu.types.GPUFrameBuffer(color_slots=self.color, depth_slot=self._surface_depth)
        self._strips = gpu.types.GPUFrameBuffer(
            color_slots=(self._segments, self.depths), depth_slot=self._surface_depth
        )

    def surfaces(self, background=(0.0, 0.0, 0.0, 0.0)):
        """The framebuffer that surfaces are drawn into, bound and cleared: a context manager."""
        return drawing.cleared(self._surfaces, background)

    def add_hair(self, hair, lights, view, in_compute=None):
        """Draw hair in front of the surfaces.

        hair: [(StrandsOnGPU, Shading, object to world, surface colour, {sampler: texture} of the scene, Steps), ...];
        lights, view: records of `uniforms`; in_compute: whether a compute program finds the nearest strands, None:
        where it can.
        """
        self._segments.clear(format="UINT", value=(_NO_SEGMENT,))
        draw = self._find if (shaders.has_image_atomics() if in_compute is None else in_compute) else self._draw_strips
        placed, first = [], 0
        self._ranges = []
        for strands, shading, to_world, surface_color, samplers, steps in hair:
            record = drawing.strand_record(strands, view, to_world, steps)
            record["seen_points"] = seen_points(strands.point_count)
            record["seen_opacity"] = shading.opacity
            record["hair_forward"][:3] = shading.forward
            record["surface_color"][:3] = surface_color
            record["back_gain"] = dual_scattering.BACK_GAIN
            placed.append((strands, shading, record, samplers, first))
            self._ranges.append((first, _segment_count(strands, record)))
            first += _segment_count(strands, record)
        light_block = uniforms.uniform_buffer(lights)
        draw([(strands, record, first) for strands, _shading, record, _samplers, first in placed], light_block)
        for strands, shading, record, samplers, first in placed:
            self._shade(strands, shading, record, light_block, samplers, first)

    def hair_at(self, x, y):
        """Which of the hair that was added last is nearest in a sample, counted from 0; None where there is none."""
        with self._strips.bind():  # a framebuffer that was never bound has no size
            segment = int(self._strips.read_color(x, y, 1, 1, 1, 0, "UINT")[0][0][0])
        found = [index for index, (first, count) in enumerate(self._ranges) if first <= segment < first + count]
        return found[0] if found else None

    def _find(self, placed, lights):
        """The nearest segments, by a compute program: all depths first, then whose they are."""
        program = shaders.surface_depths_program()
        with drawing.bound(program, {}, {"surface_depth": self._surface_depth}):
            program.image("depths", self.depths)
            self._dispatch(program)
        program = shaders.segments_program()
        images = {"depths": self.depths, "segments": self._segments}
        for is_depth in (1, 0):
            for strands, record, first in placed:
                constants = {"first_segment": first, "is_depth": is_depth}
                drawing.walk_strands(strands, program, record, lights, {}, images, constants)

    def _draw_strips(self, placed, lights):
        """The nearest segments, as strips of triangles that the graphics driver draws."""
        program = shaders.strip_segments_program()
        with self._strips.bind(), drawing.gpu_state("LESS_EQUAL", depth_writes=True):
            for strands, record, first in placed:
                program.bind()
                program.uniform_int("first_segment", first)
                drawing.draw_strip(strands, program, record, lights)

    def _shade(self, strands, shading, record, lights, samplers, first):
        """Fill the samples in which a strand of this hair is nearest with its light."""
        program = shading.program
        textures = {"segments": self._segments, "strands": strands.texture, **shading.samplers, **samplers}
        if shading.is_varied:
            textures["strand_randoms"] = strands.randoms
        blocks = {"view": uniforms.uniform_buffer(record), "lights": lights, **shading.blocks}
        with drawing.bound(program, blocks, textures):
            program.image("picture", self.color)
            program.uniform_int("first_segment", first)
            program.uniform_int("segment_count", _segment_count(strands, record))
            self._dispatch(program)

    def _dispatch(self, program):
        width, height = (-(-length // shaders.PICTURE_GROUP_SIZE) for length in self.size)
        gpu.compute.dispatch(program, width, height, 1)


def _segment_count(strands, record):
    return strands.strand_count * (int(record["drawn_points"]) - 1)
