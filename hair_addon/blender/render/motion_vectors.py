# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion vectors of everything drawn, from the previous frame and to the next frame."""

import functools
from collections import Counter
from dataclasses import dataclass

import numpy as np

from ...core.texture_sides import avoid_powers_of_two
from ..gpu import drawing, driver_textures
from ..gpu.programs import picture_programs, uniforms


@dataclass(frozen=True)
class Places:
    """Transforms and points of everything drawn at one time.

    world_to_clip: (4, 4); hair: {owner: (texture of points, (strands, points), object to world, `Moved` or None)};
    surfaces: {owner: (texture of vertices, (vertices, corners), `PlacedShape`, object to world)}. Owners are keys of
    `_unique`.
    """

    world_to_clip: np.ndarray
    hair: dict
    surfaces: dict

    def has_still_hair(self, others):
        """Whether all hair is unmoved relative to other `Places`, regardless of the camera."""
        return self.hair is others.hair or (
            self.hair.keys() == others.hair.keys()
            and all(_is_unmoved(place, others.hair[owner]) for owner, place in self.hair.items())
        )

    def has_same_strands(self, others):
        """Whether all hair has the same numbers of strands and points as in other `Places`."""
        return self.hair is others.hair or (
            self.hair.keys() == others.hair.keys()
            and all(place[1] == others.hair[owner][1] for owner, place in self.hair.items())
        )

    def has_still_surfaces(self, others):
        """Whether all surfaces are unmoved relative to other `Places`."""
        return self.surfaces is others.surfaces or (
            self.surfaces.keys() == others.surfaces.keys()
            and all(place[2] == others.surfaces[owner][2] for owner, place in self.surfaces.items())
        )


def _is_unmoved(hair, other):
    return hair[0] is other[0] and hair[3] is other[3] and np.array_equal(hair[2], other[2])


def _combed(before, now):
    """Return the `strand_textures.Moved` from one place of hair to the other; None unless it is the only change."""
    moved = now[3]
    is_next = moved is not None and moved.turn == 1 + (before[3].turn if before[3] else 0)
    return moved if is_next and before[0] is now[0] else None


@dataclass(frozen=True)
class Motion:
    """The previous and next frames for motion vectors, and the size (width, height) [pixels] of the picture."""

    before: Places
    now: Places
    after: Places
    size: tuple

    def hair(self, owner):
        """Return (record, samplers) of a hair; hair without a counterpart of the same shape has no motion."""
        now = self.now.hair[owner]
        before, after = (other.hair.get(owner, now) for other in (self.before, self.after))
        before, after = (place if place[1] == now[1] else now for place in (before, after))
        matrices = [
            moment.world_to_clip @ place[2]
            for moment, place in zip((self.before, self.now, self.after), (before, now, after), strict=True)
        ]
        record, samplers = self._record(matrices), {"strands_before": before[0], "strands_after": after[0]}
        combed = _combed(before, now)
        if combed is not None:
            record["moved_row_strands"] = combed.row_strands
        rows, points = (now[0], now[0]) if combed is None else (combed.rows, combed.points)
        return record, {**samplers, "moved_rows": rows, "moved_points": points}

    def surface(self, owner):
        """Return (record, samplers) of a surface."""
        now = self.now.surfaces[owner]
        before, after = (other.surfaces.get(owner, now) for other in (self.before, self.after))
        before, after = (place if place[1] == now[1] else now for place in (before, after))
        matrices = [
            moment.world_to_clip @ place[3]
            for moment, place in zip((self.before, self.now, self.after), (before, now, after), strict=True)
        ]
        return self._record(matrices), {"places": now[0], "places_before": before[0], "places_after": after[0]}

    def _record(self, matrices):
        record = uniforms.MOTION.record()
        record["before_to_clip"], record["now_to_clip"], record["after_to_clip"] = (m.T for m in matrices)
        record["size"][:2] = self.size
        return record


def draw(drawn, motion, view, buffer, has_surfaces=True):
    """Return a texture of motion vectors [pixels] for the `VisibilityBuffer` that a `DrawnScene` was drawn into.

    has_surfaces: whether to include motion vectors of surfaces.
    """
    with buffer.surfaces_of_part(picture_programs.MOTION_FORMAT):
        if has_surfaces:
            with drawing.gpu_state("LESS_EQUAL", depth_writes=True):
                _draw_surfaces(drawn, motion, view, has_after=True)
    program, inputs = picture_programs.strand_motion_program(), _of_hair(drawn, motion)
    joined = functools.partial(_joined, inputs, is_nearest=False)
    return buffer.part_by(program, picture_programs.MOTION_FORMAT, inputs, joined)


def draw_nearest(drawn, motion, buffer, texture, nearest):
    """Fill a texture of pixels with the motion vectors of hair [pixels] to the previous frame.

    nearest: `visibility_buffer.NearestSamples` of the pixels; pixels that show no hair are not filled.
    """
    program, inputs = picture_programs.strand_motion_program(is_nearest=True), _of_hair(drawn, motion)
    buffer.fill_nearest(texture, nearest, program, inputs, functools.partial(_joined, inputs, is_nearest=True))


def draw_surfaces(drawn, motion, view, buffer):
    """Return a texture of motion vectors [pixels] of surfaces to the previous frame, for the samples of a
    `VisibilityBuffer` that the surfaces were drawn into. Samples of hair or of the background may have any motion.

    GPUs made for computing have few units for drawing: only fragments that are seen are drawn.
    """
    state = drawing.gpu_state("LESS_EQUAL", depth_writes=False)
    with buffer.seen_surfaces_of_part(picture_programs.CARRIED_MOTION_FORMAT), state:
        _draw_surfaces(drawn, motion, view, has_after=False)
    return buffer.part(picture_programs.CARRIED_MOTION_FORMAT)


def _draw_surfaces(drawn, motion, view, has_after):
    """Draw motion vectors of surfaces into the bound framebuffer; has_after: as of `surface_motion_program`."""
    program = picture_programs.surface_motion_program(has_after)
    for (surface, _parts), owner in zip(drawn.surfaces, _unique(drawn.surface_owners), strict=True):
        record, samplers = motion.surface(owner)
        if not has_after:
            del samplers["places_after"]
        blocks = {"view": uniforms.uniform_buffer(surface.placed(view)), "motion": uniforms.uniform_buffer(record)}
        with drawing.bound(program, blocks, samplers):
            surface.corners.triangles.draw(program)


def _of_hair(drawn, motion):
    """Return [({"motion": record}, {sampler: texture})] of all hair."""
    return [({"motion": record}, samplers) for record, samplers in map(motion.hair, _unique(drawn.owners))]


def _joined(inputs, indices, is_nearest):
    """Return (program, {instance: record}, {sampler: texture}) for all linked hair objects; None if their textures
    differ.

    inputs: from `_of_hair`; indices: (N,) of the objects; is_nearest: as in `strand_motion_program`.
    """
    records, textures = zip(*[inputs[index] for index in indices.tolist()], strict=True)
    records = np.array([record["motion"] for record in records])
    kinds = {
        (*map(id, own.values()), int(row)) for own, row in zip(textures, records["moved_row_strands"], strict=True)
    }
    if len(kinds) > 1:
        return None
    texels = np.zeros((int(avoid_powers_of_two(len(records))), 12, 4), np.float32)
    for place, name in enumerate(("before_to_clip", "now_to_clip", "after_to_clip")):
        texels[: len(records), 4 * place : 4 * place + 4] = records[name]
    moved = driver_textures.new_texture((12, len(texels)), "RGBA32F", texels)
    program = picture_programs.strand_motion_program(True, is_nearest)
    return program, {"motion": records[0]}, {**textures[0], "object_motions": moved}


def places(drawn, world_to_view, view_to_clip):
    """Return the `Places` of a `DrawnScene`, which may be read without lighting."""
    return Places(view_to_clip @ world_to_view, *drawn.places)


def places_of(drawn):
    """Return (hair, surfaces) of `Places` of a `DrawnScene`."""
    hair = {
        owner: (strands.texture, (strands.strand_count, strands.point_count), to_world, strands.moved)
        for (strands, _shading, to_world, *_), owner in zip(drawn.hair, _unique(drawn.owners), strict=True)
    }
    surfaces = {
        owner: (surface.places, surface.shape, surface.placed_shape, surface.to_world)
        for (surface, _parts), owner in zip(drawn.surfaces, _unique(drawn.surface_owners), strict=True)
    }
    return hair, surfaces


def _unique(owners):
    """Return [(owner, index among items with the same owner)]: unique keys, as an object may own several instances."""
    counts = Counter()
    keys = []
    for owner in owners:
        keys.append((owner, counts[owner]))
        counts[owner] += 1
    return keys
