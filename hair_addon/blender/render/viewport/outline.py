# SPDX-License-Identifier: GPL-3.0-or-later
"""The outline of selected hair in a viewport: its silhouette in the theme's colors, also where it is occluded.

During the first passes of a viewport's picture the hair is also found without occluders. Redraws then draw a line over
the viewport, at a distance from the nearest pixel that the hair covers.
"""

from dataclasses import dataclass

import gpu
import numpy as np

from ...gpu import drawing
from ...gpu.programs import shaders
from .. import scene_drawing

# Passes after which the line no longer changes: each pass finds only some samples of thin strands.
_PASS_COUNT = 4

# Distance from hair to the line in unscaled pixels: strands less than twice as far apart have no line between them.
_GAP = 2.5

# Blender's opacity of the outline of occluded objects.
_HIDDEN_OPACITY = 0.35


@dataclass(frozen=True)
class OutlineStyle:
    """Style of outlines.

    active_color, selected_color: (3,) display colors; width: of the line [pixels]; scale: display pixels per interface
    pixel; is_see_through: whether lines of occluded hair are as opaque as others.
    """

    active_color: tuple
    selected_color: tuple
    width: float
    scale: float
    is_see_through: bool = False

    @property
    def gap(self):
        """Distance from hair to the line [pixels]."""
        return _GAP * self.scale

    @property
    def reach(self):
        """The distance from hair beyond which there is no line [pixels]."""
        return int(np.ceil(self.gap + self.width + 0.5))


class HairOutline:
    """The outline of some hair of a `DrawnScene`, for a picture of size (width, height) [pixels]."""

    def __init__(self, size):
        self.size = size
        self._style, self._channels = None, {}
        self._pass_count = 0
        self._is_changed = True
        # Sums of passes. Red and green: fraction of a pixel that the hair covers; blue and alpha: the visible fraction.
        self._mask, self._mask_target = _picture(size, "RGBA16F")
        self._rows, self._rows_target = _picture(size, "RG16F")
        self._distances, self._distances_target = _picture(size, "RGBA16F")

    def restart(self, channels, style):
        """Start another outline.

        channels: {index of the hair: 0 for the active hair, 1 for other selected hair}; style: an `OutlineStyle`.
        """
        self._channels, self._style = channels, style
        self._pass_count = 0
        with self._mask_target.bind():
            self._mask_target.clear(color=(0.0, 0.0, 0.0, 0.0))

    @property
    def is_fine(self):
        """Whether all passes are drawn."""
        return self._pass_count >= _PASS_COUNT

    def add_pass(self, drawn, view, buffer, detail, clip_planes=None):
        """Add the hair without occluders, by means of a `VisibilityBuffer`.

        view: a `uniforms.VIEW` record; detail: `picture_detail.Detail` of the buffer; clip_planes: (6, 4) of
        `uniforms.CLIPPING`, None for none.
        """
        with buffer.hiding():
            pass
        scene_drawing.find_hair(drawn, view, buffer, self._channels, clip_planes)
        self._add(buffer, detail, zip(self._channels.values(), buffer.segment_ranges, strict=True))
        self._pass_count += 1

    def add_seen(self, buffer, detail):
        """Add the visible hair of a `VisibilityBuffer`, in which all hair in front of the surfaces was found."""
        ranges = buffer.segment_ranges
        self._add(buffer, detail, ((channel + 2, ranges[index]) for index, channel in self._channels.items()))

    def _add(self, buffer, detail, found):
        program = _mask_program()
        with self._mask_target.bind(), drawing.gpu_state("NONE", depth_writes=False, blend="ADDITIVE_PREMULT"):
            for channel, (first, count) in found:
                program.bind()
                program.uniform_float("channel", np.eye(4)[channel])
                program.uniform_int("samples_per_side", detail.per_side)
                program.uniform_int("first_place", detail.corner)
                program.uniform_int("first_segment", first)
                program.uniform_int("segment_count", count)
                program.uniform_sampler("segments", buffer.segments)
                drawing.cover(program)
        self._is_changed = True

    def show(self):
        """Draw the outline over the bound viewport."""
        if self._is_changed:
            self._measure()
            self._is_changed = False
        x, y, _width, _height = gpu.state.viewport_get()
        program = _outline_program()
        program.bind()
        program.uniform_float("origin", (x, y))
        program.uniform_float("gap", self._style.gap)
        program.uniform_float("half_width", 0.5 * self._style.width)
        program.uniform_float("hidden_opacity", 1.0 if self._style.is_see_through else _HIDDEN_OPACITY)
        # Blender interprets colors drawn over a viewport as display colors to the power of 2.2.
        program.uniform_float("active_color", np.power(self._style.active_color, 2.2))
        program.uniform_float("selected_color", np.power(self._style.selected_color, 2.2))
        program.uniform_sampler("distances", self._distances)
        with drawing.gpu_state("NONE", depth_writes=False, blend="ALPHA_PREMULT"):
            drawing.cover(program)

    def _measure(self):
        """Fill the distances from the mask: first along rows, then along columns."""
        program = _rows_program()
        with self._rows_target.bind(), drawing.gpu_state("NONE", depth_writes=False):
            program.bind()
            program.uniform_int("reach", self._style.reach)
            program.uniform_int("pass_count", self._pass_count)
            program.uniform_sampler("mask", self._mask)
            drawing.cover(program)
        program = _distance_program()
        with self._distances_target.bind(), drawing.gpu_state("NONE", depth_writes=False):
            program.bind()
            program.uniform_int("reach", self._style.reach)
            program.uniform_sampler("mask", self._mask)
            program.uniform_sampler("rows", self._rows)
            drawing.cover(program)


def _picture(size, texture_format):
    """Return (texture, framebuffer) of this size; a framebuffer does not own its texture."""
    texture = gpu.types.GPUTexture(size, format=texture_format)
    return texture, gpu.types.GPUFrameBuffer(color_slots=texture)


def _program(fragment, constants, samplers):
    """Return a program that runs a fragment shader on every pixel; constants, samplers: {name: type} in order."""
    info = gpu.types.GPUShaderCreateInfo()
    for name, kind in constants.items():
        info.push_constant(kind, name)
    for slot, (name, kind) in enumerate(samplers.items()):
        info.sampler(slot, kind, name)
    return shaders.compile_drawing(info, "picture/cover.vert", fragment)


@shaders.cached
def _mask_program():
    constants = {"channel": "VEC4", "first_place": "IVEC2"}
    constants |= dict.fromkeys(("samples_per_side", "first_segment", "segment_count"), "INT")
    return _program("picture/outline_mask.frag", constants, {"segments": "UINT_2D"})


@shaders.cached
def _rows_program():
    return _program("picture/outline_rows.frag", {"reach": "INT", "pass_count": "INT"}, {"mask": "FLOAT_2D"})


@shaders.cached
def _distance_program():
    return _program("picture/outline_distance.frag", {"reach": "INT"}, {"mask": "FLOAT_2D", "rows": "FLOAT_2D"})


@shaders.cached
def _outline_program():
    constants = {"active_color": "VEC3", "selected_color": "VEC3", "origin": "VEC2"}
    constants |= dict.fromkeys(("gap", "half_width", "hidden_opacity"), "FLOAT")
    return _program("picture/outline.frag", constants, {"distances": "FLOAT_2D"})
