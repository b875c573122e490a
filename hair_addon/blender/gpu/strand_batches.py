# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawing of linked hair objects, which share strands and look: the number of calls does not grow with the objects.

A texture has a row with the transform, the level of detail and the color of each object: see
shaders/strands/batch_object.glsl.
"""

from dataclasses import dataclass, field, replace

import gpu
import numpy as np

from ...core.texture_sides import avoid_powers_of_two
from ..host.caches import Cache
from . import drawing
from .hair_shading import MixedShading, Shading
from .programs import scene_programs
from .strand_textures import StrandsOnGPU, run_for_each

# Maximum number of objects with a common array texture: every driver supports this number of layers.
MOST_LAYERS = 256

_TEXELS = 13  # per object


@dataclass(frozen=True, eq=False)
class Batch:
    """Hair objects with the same strands, look, light and textures; their tints may differ.

    to_world: (N, 4, 4); indices: (N,) among all hair of a picture; layers: (N,) layer of each object in the textures of
    the world's visibility, None for a single object with textures of its own; samplers: {name: texture} of the scene;
    steps: `drawing.Steps`, whose numbers may be arrays (N,); tints: (N, 3) of the objects' shadings, None for a single
    object.
    """

    strands: StrandsOnGPU
    shading: Shading | MixedShading
    to_world: np.ndarray
    indices: np.ndarray
    layers: np.ndarray | None
    samplers: dict
    steps: drawing.Steps = field(default_factory=drawing.Steps)
    tints: np.ndarray | None = None

    def part(self, chosen):
        """Return the batch of the objects in `chosen`, a list of indices of hair; new indices are places in it."""
        places, within = np.nonzero(np.asarray(chosen)[:, None] == self.indices)
        numbers = self.layers, self.steps.point_count, self.steps.strand_count, self.tints
        layers, points, strands, tints = (one[within] if isinstance(one, np.ndarray) else one for one in numbers)
        steps = replace(self.steps, point_count=points, strand_count=strands)
        return replace(self, to_world=self.to_world[within], indices=places, layers=layers, steps=steps, tints=tints)


def single(hair, index):
    """Return the `Batch` of one object from (StrandsOnGPU, shading, (4, 4) object to world, samplers, steps)."""
    strands, shading, to_world, samplers, steps = hair
    return Batch(strands, shading, np.asarray(to_world)[None], np.array([index]), None, samplers, steps)


def groups_of(keys):
    """Return groups [indices] of equal keys, with at most `MOST_LAYERS` indices each, in the order of first indices."""
    groups, current = [], {}
    for index, key in enumerate(keys):
        group = current.get(key)
        if group is None or len(group) == MOST_LAYERS:
            group = current[key] = []
            groups.append(group)
        group.append(index)
    return groups


class Objects:
    """The texture of objects, of a `Batch` that a picture shows or of hair in shadow maps, and their work groups.

    records: (N,) of `drawing.strand_records`; layers: (N,), in shadow maps the map of each object; first_run: number of
    runs of segments before these objects; tints: (N, 3), None for white.
    """

    def __init__(self, records, layers, first_run, tints=None):
        runs_of_strand = -(-(records["drawn_points"].astype(np.int64) - 1) // scene_programs.RUN_LENGTH)
        strands = records["drawn_strands"].astype(np.int64)
        first_share = -(-strands // drawing.FIRST_SHARE)
        walked = np.stack([strands, first_share, strands - first_share])  # rows: WALK_ALL, WALK_FIRST, WALK_OTHERS
        groups = -(-walked * runs_of_strand // scene_programs.RUN_GROUP_SIZE)
        self._group_counts = groups.sum(axis=1)
        runs = strands * runs_of_strand
        texels = np.zeros((int(avoid_powers_of_two(len(records))), _TEXELS, 4), np.float32)
        rows = texels[: len(records)]
        rows[:, 0:4], rows[:, 4:8] = records["object_to_world"], records["object_to_clip"]
        for channel, name in enumerate(("drawn_points", "drawn_strands", "object_scale", "thickness")):
            rows[:, 8, channel] = records[name]
        rows[:, 9, :2], rows[:, 9, 2] = _halves(records["first_segment"]), layers
        rows[:, 10, :2] = _halves(first_run + np.cumsum(runs) - runs)
        firsts = _halves((np.cumsum(groups, axis=1) - groups).T)  # (N, 3, 2)
        rows[:, 10, 2:], rows[:, 11, 3], rows[:, 11, :3] = firsts[:, :2, 0], firsts[:, 2, 0], firsts[..., 1]
        rows[:, 12, :3] = 1.0 if tints is None else tints
        data = gpu.types.Buffer("FLOAT", texels.size, texels.ravel())
        self.texture = gpu.types.GPUTexture((_TEXELS, len(texels)), format="RGBA32F", data=data)
        self.texture.filter_mode(False)
        first, strand_count, points = (
            int(records[name][-1]) for name in ("first_segment", "strand_count", "drawn_points")
        )
        self.count, self.last_segment = len(records), first + strand_count * (points - 1) - 1

    def rasterize(self, strands, program, blocks, constants, part=drawing.WALK_ALL):
        """Rasterize all objects with the program that `drawing.rasterizing` has bound; see `rasterize_strands`."""
        if not self._group_counts[part]:
            return
        drawing.provide(program, blocks, {**drawing.strand_samplers(strands), "objects": self.texture})
        drawing.set_integers(program, constants | {"object_count": self.count})
        run_for_each(program, int(self._group_counts[part]), 1)


# (Bytes of records, of layers) → `Objects` of shadow maps, most of which equal those of the last frame.
objects_cache = Cache(capacity=64)

# `Objects` of a hair in a frame: all and counted strands for each eight of 16 lights, and the visibility of the world.
_OBJECTS_OF_HAIR = 5


def make_room(count: int) -> None:
    """Keep the `Objects` of `count` hair systems, which are read in turn."""
    objects_cache.make_room(_OBJECTS_OF_HAIR * count)


def shared_objects(records: np.ndarray, layers: np.ndarray) -> Objects:
    """Return the shared `Objects` without tints of records and layers, with no runs before them."""
    key = records.tobytes(), layers.tobytes()
    return objects_cache.get(key, lambda: Objects(records, layers, 0))


def _halves(numbers):
    """Return (..., 2) upper and lower 16 bits of (...) integers: single precision has 24."""
    return np.stack([numbers >> 16, numbers & 0xFFFF], axis=-1)
