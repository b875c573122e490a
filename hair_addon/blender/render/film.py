# SPDX-License-Identifier: GPL-3.0-or-later
"""Accumulated samples of a tile, for each pass."""

import gpu
import numpy as np

from ...core.imaging import pixel_sampling
from ..gpu import drawing
from ..gpu.programs import picture_programs, surface_programs
from ..gpu.visibility_buffer import VisibilityBuffer
from . import data_passes, light_groups, mattes, motion_vectors, scene_drawing

_MOST_SAMPLES = 4096  # along a tile's side: textures take 340 MB, 870 MB with all passes

BORDER = surface_programs.SIDE - 1  # around tiles [samples]: samples that share light are in the same tile

FAR = 1e10  # distance of the background, as in Cycles

# (names of channels, type) of passes in Blender's terms; all others are RGB.
_CHANNELS = {
    "Combined": ("RGBA", "COLOR"),
    "Depth": ("Z", "VALUE"),
    "Hair Mask": ("X", "VALUE"),
    "Vector": ("XYZW", "VECTOR"),
    "Mist": ("Z", "VALUE"),
    "Position": ("XYZ", "VECTOR"),
    "Normal": ("XYZ", "VECTOR"),
    "UV": ("UVA", "VECTOR"),
    "Noisy Image": ("RGBA", "COLOR"),
    "Denoising Normal": ("XYZ", "VECTOR"),
}

# Passes of hair's light: factors of (R, TT, TRT, all other light from lamps), and of the world's light.
LOBES = {
    "Hair R": ((1.0, 0.0, 0.0, 0.0), 0.0),
    "Hair TT": ((0.0, 1.0, 0.0, 0.0), 0.0),
    "Hair TRT": ((0.0, 0.0, 1.0, 0.0), 0.0),
    "Hair Scattered": ((0.0, 0.0, 0.0, 1.0), 0.0),
    "Hair World": ((0.0, 0.0, 0.0, 0.0), 1.0),
}


def channels_of(name):
    """Return (names of channels, type) of a pass in Blender's terms."""
    if mattes.is_matte(name):
        return ("RGBA", "COLOR") if name.startswith("Crypto") else ("X", "VALUE")
    return _CHANNELS.get(name, ("RGB", "COLOR"))


_OWN_PROGRAMS = {"Depth", "Hair Mask", "Position", "Noisy Image"}  # passes that are no sums of pictures


def _count_of(name):
    """Number of channels in a film."""
    return 4 if name == "Position" else len(channels_of(name)[0])


class Film:
    """Passes over a tile of `size` (width, height) [pixels], each with per_side² samples of every pixel.

    border: extra samples around the tile; passes: names out of "Combined", "Depth", "Hair Mask", "Hair Shadow",
    "Shadow", "Vector", `LOBES`, `data_passes` and `light_groups`; is_transparent: leave the background empty;
    filter_width: of `pixel_sampling.filter_weights` [pixels]; labels: `mattes.Labels` if mattes are wanted. The
    attribute `motion` is the `Motion` for the pass "Vector", `groups` is from `light_groups.lit`.
    """

    def __init__(self, size, per_side, passes, is_transparent, filter_width=0.0, border=BORDER, labels=None):
        self.size, self._per_side, self.is_transparent = size, per_side, is_transparent
        self._filter_width, self._margin = filter_width, pixel_sampling.filter_margin(per_side, filter_width)
        self._border = border
        sides = (length * per_side + 2 * (self._margin + border) for length in size)
        self.samples = VisibilityBuffer(*sides, is_coarse=per_side > 1)
        has_groups = any(map(light_groups.is_of_group, passes))
        names = [*passes, light_groups.REST] if has_groups else passes
        self._sums = {name: self._texture() for name in names if name not in _OWN_PROGRAMS}
        self._positions = self._texture() if "Position" in passes else None
        self._depth = self._texture() if {"Depth", "Hair Mask", "Vector"} & set(passes) else None
        self._mattes = None if labels is None else mattes.MatteFilm(size, labels)
        self._passes, self.motion, self.groups = passes, None, {}
        self.clear()

    def _texture(self):
        return gpu.types.GPUTexture(self.size, format=picture_programs.FILM_FORMAT)

    def clear(self):
        """Clear the sums, for another tile or motion sample."""
        self.pass_count, self._weight_sum = 0, 0.0
        for texture in self._sums.values():
            texture.clear(format="FLOAT", value=(0.0, 0.0, 0.0, 0.0))
        if self._depth is not None:
            self._depth.clear(format="FLOAT", value=(0.0, FAR, 0.0, 0.0))
        if self._positions is not None:
            self._positions.clear(format="FLOAT", value=(0.0, 0.0, 0.0, FAR))
        if self._mattes is not None:
            self._mattes.clear()

    def add_pass(self, drawn, world_to_view, view_to_clip, size, turn, place=(0, 0), lens=None):
        """Draw a `DrawnScene` once; returns the `uniforms.VIEW` record of the pass.

        world_to_view, view_to_clip: (4, 4); size: (width, height) of the whole picture [pixels]; turn: index among all
        passes over it; place: (left, bottom) of the tile in it [pixels]; lens: a `Lens`, of which each pass samples
        another point, None: all in focus.
        """
        central = world_to_view
        if lens is not None:
            world_to_view = lens.world_to_view(world_to_view, turn)
        whole = tuple(length * self._per_side for length in size)
        corner = (length * self._per_side - self._margin - self._border for length in place)
        view = drawing.pass_record(world_to_view, view_to_clip, whole, turn, (*corner, *self.samples.size))
        scene_drawing.draw(drawn, view, self.samples, self.is_transparent)
        weights = [
            pixel_sampling.filter_weights(self._per_side, self._filter_width, shift)
            for shift in drawing.pass_shift(turn)
        ]
        weighting = _weights_texture(weights)
        for name, texture in self._sums.items():
            if light_groups.is_of_group(name) and name not in self.groups:
                continue  # no light
            samplers = {"picture": self._picture(name, drawn, view, central), "filter_weights": weighting}
            self._add(picture_programs.film_program(), samplers, texture)
        if self._depth is not None:
            samplers = {"segments": self.samples.segments, "filter_weights": weighting}
            self._add_depths(picture_programs.film_depth_program(), samplers, self._depth, view_to_clip)
        if self._positions is not None:
            samplers = {"picture": self._picture("Position", drawn, view, central), "filter_weights": weighting}
            self._add_depths(picture_programs.film_position_program(), samplers, self._positions, view_to_clip)
        if self._mattes is not None:
            self._mattes.add(drawn, self.samples, weighting, self._per_side, self._margin, self._border)
        self.pass_count += 1
        self._weight_sum += float(weights[0].sum() * weights[1].sum())
        return view

    @property
    def sample_count(self):
        """Number of samples per pixel so far."""
        return self.pass_count * self._per_side**2

    def _picture(self, name, drawn, view, world_to_view):
        """Return the samples of a pass, as a texture; world_to_view: of the camera without its lens."""
        if name == "Combined":
            return self.samples.color
        if name in self.groups:
            return scene_drawing.relight(self.groups[name], view, self.samples, self.is_transparent)
        if name in data_passes.KINDS:
            return data_passes.draw(drawn, name, world_to_view, view, self.samples)
        if name == "Vector":
            return motion_vectors.draw(drawn, self.motion, view, self.samples)
        if name == "Shadow":
            return scene_drawing.draw_arrival(drawn, view, self.samples)
        if name == "Hair Shadow":
            return scene_drawing.draw_hair_shadow(drawn, view, self.samples)
        return self.samples.part_of_light(*LOBES[name])

    def _add_depths(self, program, samplers, sums, view_to_clip):
        program.bind()
        program.uniform_float("view_to_clip", view_to_clip[2:, 2:].ravel())
        self._add(program, {"depths": self.samples.nearest_depths(), **samplers}, sums)

    def _add(self, program, samplers, sums):
        with drawing.bound(program, {}, samplers):
            program.uniform_int("samples_per_side", self._per_side)
            program.uniform_int("margin", self._margin)
            program.uniform_int("border", self._border)
            program.image("sums", sums)
            drawing.dispatch_over(program, self.size)

    @property
    def light(self):
        """(texture, weight): the weighted sum of all passes' samples of "Combined", and the sum of weights."""
        return self._sums["Combined"], self._weight_sum

    def show(self, picture=None, border=None):
        """Draw the mean of the samples, or another picture of this size, over the bound viewport.

        border: (left, bottom, right, top) [pixels], outside of which nothing is drawn.
        """
        program = picture_programs.film_view_program()
        x, y, _width, _height = gpu.state.viewport_get()
        with (
            drawing.bound(program, {}, {"sums": picture or self._sums["Combined"]}),
            drawing.gpu_state("NONE", False, "ALPHA_PREMULT"),
        ):
            program.uniform_float("border", (0.0, 0.0, *self.size) if border is None else border)
            program.uniform_float("origin", (x, y))
            program.uniform_float("weight_sum", 1.0 if picture else self._weight_sum)
            drawing.cover(program)

    def read(self):
        """Return {pass: (height, width, channels) float32}, bottom row first: means over the samples, least depths.

        "Position" is that of the nearest sample, and as a fourth channel its distance, `FAR` without one.
        """
        found = {name: self._read(texture) for name, texture in self._sums.items()}
        for values in found.values():
            values /= self._weight_sum  # in place: another picture of this size takes as long to allocate
        if self._depth is not None:
            mask, depth, covered, _none = np.split(self._read(self._depth), 4, axis=-1)
            found |= {"Hair Mask": mask / self._weight_sum, "Depth": depth}
            if "Vector" in found:  # of objects, not of the background
                found["Vector"] *= self._weight_sum / np.maximum(covered, 1e-6)
        if light_groups.REST in found:
            groups = {name: found.pop(name)[..., :3] for name in list(found) if light_groups.is_of_group(name)}
            found |= light_groups.fitted(groups, found["Combined"][..., :3])
        if self._positions is not None:
            found["Position"] = self._read(self._positions)
        if "Mist" in found:
            found["Mist"] = 1.0 - found["Mist"]
        if "Noisy Image" in self._passes:
            found["Noisy Image"] = found["Combined"]
        return {name: found[name][..., : _count_of(name)] for name in self._passes}

    def read_mattes(self):
        """Return (labels, coverages), each (height, width, slots), bottom row first; None without labels."""
        return None if self._mattes is None else self._mattes.read(self._weight_sum)

    def _read(self, texture):
        return np.array(texture.read(), np.float32).reshape(self.size[1], self.size[0], 4)


def _weights_texture(weights):
    """Return a texture with two rows of weights, for x and for y."""
    texels = np.array(weights, np.float32)
    data = gpu.types.Buffer("FLOAT", texels.size, texels.ravel())
    return gpu.types.GPUTexture(texels.shape[::-1], format="R32F", data=data)


def largest_tile(per_side, filter_width):
    """Longest side [pixels] of a tile that the graphics driver supports; per_side: samples along a pixel's side."""
    most = min(gpu.capabilities.max_texture_size_get(), _MOST_SAMPLES)
    return max((most - 2 * (pixel_sampling.filter_margin(per_side, filter_width) + BORDER)) // per_side, 1)
