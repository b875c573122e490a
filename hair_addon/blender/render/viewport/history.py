# SPDX-License-Identifier: GPL-3.0-or-later
"""The history of a viewport's pictures, which is blended into new pictures to reduce flicker from few samples.

When something moves, the last picture is reprojected and blended with the passes of the new picture. Its weight
decreases with each pass, to zero in the last: a picture at rest is the mean of its own passes. Where the two differ by
more than noise, the weight is lower from the start [Karis14] [Yang20].
"""

from dataclasses import dataclass

import gpu
import numpy as np

from ...gpu import drawing
from ...gpu.programs import picture_programs, uniforms
from ...gpu.visibility_buffer import NearestSamples
from .. import motion_vectors

# Maximum weight of the last picture in passes: of the same strands, and of others, whose noise would hide changes.
_MOST_PASSES, _MOST_OF_OTHERS = 24.0, 2.0
_MOST_OF_STILL = 96.0  # if only lights have moved: the picture is not blurred, and only light may lag
_REACH = 5  # pixels: the search radius of picture/history_places.comp, plus one


class _Targets:
    """Textures that a program fills. images: (name, format) of each, from `picture_programs`."""

    def __init__(self, size, images):
        self.size, self._names = size, [name for name, _format in images]
        self.textures = [gpu.types.GPUTexture(size, format=one) for _name, one in images]
        for texture in self.textures:
            texture.filter_mode(True)
            texture.extend_mode("EXTEND")
            texture.clear(format="FLOAT", value=(0.0, 0.0, 0.0, 0.0))

    def fill(self, program, samplers, blocks=None, **constants):
        """Run a compute program for every texel; blocks: {instance: record}; constants: numbers."""
        blocks = {name: uniforms.uniform_buffer(record) for name, record in (blocks or {}).items()}
        with drawing.bound(program, blocks, samplers):
            for name, texture in zip(self._names, self.textures, strict=True):
                program.image(name, texture)
            for name, value in constants.items():
                program.uniform_float(name, value)
            drawing.dispatch_over(program, self.size)


@dataclass(frozen=True)
class _Seen:
    """The content of a picture."""

    looks: tuple  # `Shading`s of all hair, which are the same for all pictures of a history
    places: motion_vectors.Places
    world_to_clip: np.ndarray

    def is_still(self, other):
        """Whether another `_Seen` differs only in lights."""
        return (
            np.array_equal(self.world_to_clip, other.world_to_clip)
            and _are_same(self.looks, other.looks)
            and self.places.has_still_hair(other.places)
            and self.places.has_still_surfaces(other.places)
        )


def _seen(drawn, camera):
    """`_Seen` of a `DrawnScene` from a camera (world to view, view to clip)."""
    return _Seen(drawn.looks, motion_vectors.places(drawn, *camera), camera[1] @ camera[0])


class History:
    """The history of a picture of size (width, height) [pixels]."""

    def __init__(self, size):
        self.size = size
        self._shown = self._before = None  # _Targets: the picture, and its weight in passes
        self._carried = self._blocks = None
        self._places = self._moved = None  # textures: the sample that represents each pixel, and its motion vector
        self._seen = None
        self._surface_motion = None  # texture of motion vectors of surfaces from `draw_surfaces`
        self._is_carried = False
        self._relit = None  # _Targets: blocks of samples with the former lights, and with the current lights
        self._is_relit = False

    @property
    def picture(self):
        """The texture to show in place of the passes, or None."""
        return self._shown.textures[0] if self._is_carried else None

    def read(self):
        """Return (height, width, 4) float32 of `picture`, bottom row first."""
        return np.array(self.picture.read(), np.float32).reshape(self.size[1], self.size[0], 4)

    def forget(self):
        """Start without a history."""
        self._seen, self._is_carried = None, False

    def turn(self, light, part_done):
        """Keep the shown picture, as something has moved; light: as for `add`; part_done: fraction of passes done."""
        if self._seen is None or not part_done:
            return
        if self._shown is None:
            self._allocate()
        if not self._is_carried:
            self._mix(light, part_done * _MOST_OF_STILL, 0.0)
        self._shown, self._before = self._before, self._shown

    def _allocate(self):
        images = picture_programs.CARRIED_IMAGES
        self._shown, self._before, self._carried = (_Targets(self.size, images) for _ in range(3))
        self._places = gpu.types.GPUTexture(self.size, format="R32UI")
        self._moved = gpu.types.GPUTexture(self.size, format=picture_programs.CARRIED_MOTION_FORMAT)
        blocks = tuple(-(-length // picture_programs.BLOCK_SIDE) for length in self.size)
        self._blocks = [_Targets(blocks, picture_programs.BLOCK_IMAGES) for _ in range(2)]

    def follow_light(self, drawn, camera, buffer, relight):
        """Measure the change of light in the last pass if only lights have moved in a `DrawnScene`.

        camera: (world to view, view to clip); buffer: `VisibilityBuffer` of that pass; relight: a function that returns
        a texture of its samples with the lights of the scene.
        """
        self._is_relit = self._seen is not None and self._seen.is_still(_seen(drawn, camera))
        if not self._is_relit:
            return
        size = tuple(-(-length // picture_programs.BLOCK_SIDE) for length in buffer.size)
        if self._relit is None or self._relit[0].size != size:
            self._relit = [_Targets(size, picture_programs.BLOCK_IMAGES) for _ in range(2)]
        program = picture_programs.blocks_program()
        self._relit[0].fill(program, {"picture": buffer.color}, weight=1.0)
        self._relit[1].fill(program, {"picture": relight()}, weight=1.0)

    def draw_surfaces(self, drawn, camera, view, buffer):
        """Draw the motion vectors of surfaces that `add` needs for a first pass, whose surfaces were just drawn.

        The GPU draws them while the hair of the pass is prepared. Parameters: as for `add`; buffer: `VisibilityBuffer`.
        """
        before, now, self._surface_motion = self._seen, _seen(drawn, camera), None
        if before is not None and _are_same(before.looks, now.looks):
            if not now.places.has_still_surfaces(before.places):
                motion = motion_vectors.Motion(before.places, now.places, now.places, self.size)
                self._surface_motion = motion_vectors.draw_surfaces(drawn, motion, view, buffer)

    def add(self, drawn, camera, view, samples, light, pass_count, part_left, has_lit_surfaces=False):
        """Add a pass, the pass_count-th of a picture.

        drawn: the `DrawnScene`; camera: (world to view, view to clip); view: record of the pass; samples: its
        `VisibilityBuffer` and `picture_detail.Detail`; light: (texture, weight), the sum of passes so far and its
        divisor; part_left: fraction of passes to come; has_lit_surfaces: whether the picture includes surfaces, or
        shadows on them.
        """
        if pass_count == 1:
            self._turn_to(drawn, camera, view, samples, light, has_lit_surfaces)
        if self._is_carried:
            self._is_carried = part_left > 0.0
        if self._is_carried:
            self._mix(light, pass_count, part_left)

    def _turn_to(self, drawn, camera, view, samples, light, has_lit_surfaces):
        before, self._seen = self._seen, _seen(drawn, camera)
        self._is_carried = before is not None and _are_same(before.looks, self._seen.looks)
        if self._is_carried:
            self._carry(before, drawn, view, samples, light, has_lit_surfaces)

    def _carry(self, before, drawn, view, samples, light, has_lit_surfaces):
        now, (buffer, detail) = self._seen, samples
        record = uniforms.HISTORY.record()
        record["now_to_before"] = (before.world_to_clip @ np.linalg.inv(now.world_to_clip)).T
        record["size"][:2], record["samples_per_side"] = self.size, detail.per_side
        record["first_column"], record["first_row"] = detail.corner
        record["has_surface_motion"] = has_surfaces = not now.places.has_still_surfaces(before.places)
        record["has_hair_motion"] = has_hair = not now.places.has_still_hair(before.places)
        has_same_strands = now.places.has_same_strands(before.places)
        record["most_passes"] = _MOST_PASSES if has_same_strands else _MOST_OF_OTHERS
        record["is_still"], record["has_lit_surfaces"] = self._is_relit, has_lit_surfaces
        if record["is_still"]:
            record["most_passes"] = _MOST_OF_STILL
        program = picture_programs.blocks_program()
        for blocks, of in zip(self._blocks, ((self._before.textures[0], 1.0), light), strict=True):
            blocks.fill(program, {"picture": of[0]}, weight=of[1])
        (before_blocks, now_blocks), (picture, passes) = self._blocks, self._before.textures
        if not record["is_still"]:
            self._find_places(record, buffer, now_blocks.textures[1])
        hair_motion = surface_motion = light[0]
        motion = motion_vectors.Motion(before.places, now.places, now.places, self.size)
        if has_hair:
            hair_motion = self._moved
            nearest = NearestSamples(self._places, detail.per_side, detail.corner, _REACH)
            motion_vectors.draw_nearest(drawn, motion, buffer, hair_motion, nearest)
        if has_surfaces:
            surface_motion = self._surface_motion or motion_vectors.draw_surfaces(drawn, motion, view, buffer)
        self._surface_motion = None
        samplers = {
            "before": picture,
            "before_passes": passes,
            "before_mean": before_blocks.textures[0],
            "before_deviation": before_blocks.textures[1],
            "now_mean": now_blocks.textures[0],
            "now_deviation": now_blocks.textures[1],
            "hair_motion": hair_motion,
            "surface_motion": surface_motion,
            "light_before": (self._relit or self._blocks)[0].textures[0],
            "light_now": (self._relit or self._blocks)[1].textures[0],
            "depths": buffer.nearest_depths(),
            "segments": buffer.segments,
            "places": self._places,
        }
        self._carried.fill(picture_programs.carry_program(), samplers, {"history": record})

    def _find_places(self, record, buffer, deviation):
        """Find the sample that represents each pixel; deviation: texture of the blocks of the current picture."""
        program, blocks = picture_programs.places_program(), {"history": uniforms.uniform_buffer(record)}
        with drawing.bound(program, blocks, {"depths": buffer.nearest_depths(), "now_deviation": deviation}):
            program.image("places", self._places)
            drawing.dispatch_over(program, self.size)

    def _mix(self, light, pass_count, part_left):
        sums, weight = light
        carried, passes = self._carried.textures
        samplers = {"sums": sums, "carried": carried, "carried_passes": passes}
        program = picture_programs.mix_program()
        self._shown.fill(program, samplers, weight=weight, pass_count=float(pass_count), part_left=part_left)


def _are_same(looks, others):
    if looks is others:
        return True
    return len(looks) == len(others) and all(look is other for look, other in zip(looks, others, strict=True))
