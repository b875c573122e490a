# SPDX-License-Identifier: GPL-3.0-or-later
"""A viewport's picture of hair: linear light, refined pass by pass while nothing moves."""

import functools

import gpu
import numpy as np

from ...gpu import drawing
from ...gpu.programs import scene_programs
from ...gpu.visibility_buffer import VisibilityBuffer
from .. import scene_drawing
from . import picture_detail
from .history import History

SAMPLE_COUNT = 32  # per pixel, in all passes of a picture

# With one sample per pixel, the first passes share each with the pixels around it, so that single samples are no
# specks: share of each neighbor along an axis. A carried history has little noise and would be blurred.
_SPREADS, _SPREADS_WITH_HISTORY = (0.25, 0.2, 0.15, 0.1), (0.15,)

# Share of the first picture in the picture after each pass: its coverage has less noise than that of single samples.
_FIRST_PARTS = (1.0, 0.55, 0.35, 0.2, 0.1)

# Radius of the first picture's mean of colors [pixels]: limits, and its part of the length over which colors change.
_RADII, _RADIUS_PART = (2.6, 5.0), 1.0 / 9.0


def samples_per_side():
    """Samples along each side of a pixel in each pass: fewer with software rendering, for responsiveness."""
    return 1 if gpu.platform.device_type_get() == "SOFTWARE" else 2


class HairPicture:
    """The mean of passes with different samples of pixels and of thin strands.

    Light is premultiplied by the fraction of a pixel that hair covers. per_side: samples along each side of a pixel in
    a pass, by default `samples_per_side`; small hair has more.
    """

    def __init__(self, size, per_side=None):
        self.size = size  # [pixels]
        self.per_side = per_side or samples_per_side()
        self.pass_count = self._first_turn = 0
        self._spreads = _SPREADS
        self._detail = picture_detail.whole(size, self.per_side)
        self._history = History(self.size)
        self._view = None  # record of the last pass
        self._pass = VisibilityBuffer(*self._detail.buffer_size)
        self._color = gpu.types.GPUTexture(self.size, format="RGBA16F")
        self._depth = gpu.types.GPUTexture(self.size, format="R32F")
        self._first_picture = None  # texture of `_draw_first_picture`, None if it was not drawn
        self._first_texture = None
        self._sum = gpu.types.GPUFrameBuffer(color_slots=self._color)

    @property
    def is_fine(self):
        """Whether all passes are drawn."""
        return self.pass_count >= self._pass_total

    @property
    def _pass_total(self):
        return -(-SAMPLE_COUNT // self._detail.per_side**2)

    def restart(self, is_moved=False):
        """Start another picture; is_moved: only the view or objects have moved."""
        if is_moved:
            self._history.turn((self._color, self.pass_count), self.pass_count / self._pass_total)
            self._spreads = _SPREADS_WITH_HISTORY
            self._first_turn += self.pass_count
        else:
            self._history.forget()
            self._spreads = _SPREADS
            self._first_turn = 0
        self.pass_count, self._first_picture = 0, None

    def add_pass(
        self,
        drawn,
        world_to_view,
        view_to_clip,
        is_see_through=False,
        outline=None,
        is_shadowed=False,
        clip_planes=None,
    ):
        """Draw a `DrawnScene` once more.

        world_to_view, view_to_clip: (4, 4); is_see_through: surfaces do not occlude hair; outline: a `HairOutline` to
        which the pass is added until it is complete; is_shadowed: draw the shadow of hair on surfaces; clip_planes:
        (6, 4) of `uniforms.CLIPPING` for hair and occluding surfaces, None for none.
        """
        camera, turn = (world_to_view, view_to_clip), self._first_turn + self.pass_count
        if self.pass_count == 0:
            view, is_lit = self._view, is_shadowed and not is_see_through
            relight = functools.partial(scene_drawing.relight_viewport, drawn, view, self._pass, is_lit)
            self._history.follow_light(drawn, camera, self._pass, relight)
            self._choose_detail(drawn, camera, is_lit)
        self._view = view = self._detail.pass_record(camera, self.size, turn)
        is_outlined = outline is not None and not outline.is_fine
        if is_outlined:
            outline.add_pass(drawn, view, self._pass, self._detail, clip_planes)
        has_shadow = is_shadowed and not is_see_through
        with self._pass.surfaces() if has_shadow else self._pass.hiding():
            if has_shadow:
                scene_drawing.draw_viewport_shadow(drawn, view)
            elif not is_see_through:
                scene_drawing.draw_hiding(drawn, view, clip_planes)
        if self.pass_count == 0:
            self._history.draw_surfaces(drawn, camera, view, self._pass)
        is_counted = self.pass_count == 0 and self._detail.per_side == 1 and self._spreads is _SPREADS
        scene_drawing.draw_hair(drawn, view, self._pass, True, clip_planes, is_counted)
        if is_outlined:
            outline.add_seen(self._pass, self._detail)
        self._accumulate()
        if is_counted and self._pass.covered is not None:
            self._draw_first_picture()
        self.pass_count += 1
        part_left = 1.0 - self.pass_count / self._pass_total
        light = self._color, self.pass_count
        samples = self._pass, self._detail
        self._history.add(drawn, camera, view, samples, light, self.pass_count, part_left, is_shadowed)

    def _choose_detail(self, drawn, camera, is_shadowed):
        """Sample small hair finely, unless the picture includes shadows on all surfaces, which may be anywhere."""
        detail = picture_detail.whole(self.size, self.per_side)
        if not is_shadowed or drawn.is_shadowed:
            detail = picture_detail.of_hair(drawn, camera, self.size, self.per_side, is_shadowed)
        self._detail = detail
        if self._pass.size != detail.buffer_size:
            self._pass = VisibilityBuffer(*detail.buffer_size)

    def _accumulate(self):
        is_shared = self._detail.per_side == 1 and self.pass_count < len(self._spreads)
        samplers = {"picture": self._pass.color, "depths": self._pass.depths, "surface_depth": self._pass.surface_depth}
        program = scene_programs.accumulate_program()
        with drawing.bound(program, {}, samplers):
            program.image("sums", self._color)
            program.image("nearest_depths", self._depth)
            program.uniform_int("samples_per_side", self._detail.per_side)
            program.uniform_int("first_place", self._detail.corner)
            program.uniform_int("is_first", int(self.pass_count == 0))
            program.uniform_float("spread", self._spreads[self.pass_count] if is_shared else 0.0)
            drawing.dispatch_over(program, self.size)

    def _draw_first_picture(self):
        """Draw the first pass with the coverage of many lines through each pixel."""
        if self._first_texture is None:
            self._first_texture = gpu.types.GPUTexture(self.size, format=scene_programs.PICTURE_FORMAT)
        self._first_picture = self._first_texture
        program = scene_programs.first_picture_program()
        samplers = {"picture": self._pass.color, "covered": self._pass.covered}
        with drawing.bound(program, {}, samplers):
            program.image("first_picture", self._first_picture)
            program.uniform_int("first_place", self._detail.corner)
            program.uniform_float("color_radius", np.clip(_RADIUS_PART * self._pass.smooth_length, *_RADII))
            drawing.dispatch_over(program, self.size)

    @property
    def _first_part(self):
        """The share of the first picture in the picture that `show` draws."""
        if self._first_picture is None or self.pass_count > len(_FIRST_PARTS):
            return 0.0
        return _FIRST_PARTS[self.pass_count - 1]

    def show(self, display_table, exposure, opacity=1.0, depth_test="LESS_EQUAL", border=None):
        """Draw the picture over the bound viewport.

        display_table: texture of a `DisplayTransform`'s table; exposure: factor of light; depth_test: against the
        viewport's depth; border: (left, bottom, right, top) [pixels], outside of which nothing is drawn.
        """
        program = scene_programs.display_program()
        x, y, _width, _height = gpu.state.viewport_get()
        program.bind()
        program.uniform_float("border", (0.0, 0.0, *self.size) if border is None else border)
        program.uniform_float("origin", (x, y))
        program.uniform_float("exposure", exposure)
        program.uniform_float("opacity", opacity)
        carried = self._history.picture
        program.uniform_int("pass_count", self.pass_count if carried is None else 1)
        program.uniform_float("first_part", self._first_part if carried is None else 0.0)
        program.uniform_sampler("passes", self._color if carried is None else carried)
        program.uniform_sampler("first_picture", self._color if self._first_picture is None else self._first_picture)
        program.uniform_sampler("depths", self._depth)
        program.uniform_sampler("display_table", display_table)
        # Depth is not written: surfaces occlude guides, but the hair around them does not.
        with drawing.gpu_state(depth_test, depth_writes=False, blend="ALPHA_PREMULT"):
            drawing.cover(program)

    def hair_at(self, x, y):
        """Index of the hair visible in a pixel, or None."""
        left, bottom, width, height = self._detail.tile
        if not (left <= x < left + width and bottom <= y < bottom + height):
            return None
        side = self._detail.per_side
        places = [(side * (x - left) + i, side * (y - bottom) + j) for j in range(side) for i in range(side)]
        return next((found for place in places if (found := self._pass.hair_at(*place)) is not None), None)

    def hair_near(self, x, y, reach):
        """Index of the hair visible nearest to a pixel's center, at most `reach` pixels away, or None."""
        (left, bottom, _width, _height), side = self._detail.tile, self._detail.per_side
        return self._pass.hair_near(side * (x - left) + side // 2, side * (y - bottom) + side // 2, side * reach)

    def read(self):
        """Return (height, width, 4) float32: the mean of the passes, premultiplied linear light, bottom row first."""
        with self._sum.bind():  # a framebuffer has no size before it is bound
            pixels = self._sum.read_color(0, 0, *self.size, 4, 0, "FLOAT")
        return np.array(pixels, np.float32).reshape(self.size[1], self.size[0], 4) / self.pass_count

    def read_shown(self):
        """`read` of the picture that `show` draws, which may include former pictures or the first picture."""
        if self._history.picture is not None:
            return self._history.read()
        light, part = self.read(), self._first_part
        if not part:
            return light
        first = np.array(self._first_picture.read(), np.float32).reshape(light.shape)
        return (1.0 - part) * light + part * first


def table_texture(table):
    """Return a texture with linear interpolation of a table (N, N, N, 3) float32, whose third axis runs along x."""
    size = len(table)
    texels = np.ones((size, size, size, 4), np.float32)
    texels[..., :3] = table
    data = gpu.types.Buffer("FLOAT", texels.size, texels.ravel())
    texture = gpu.types.GPUTexture((size, size, size), format="RGBA16F", data=data)
    texture.filter_mode(True)
    texture.extend_mode("EXTEND")
    return texture
