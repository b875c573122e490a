# SPDX-License-Identifier: GPL-3.0-or-later
"""Mattes of objects, materials and assets: labels of the nearest objects in each sample, and their names in Blender."""

from dataclasses import dataclass

import bpy
import gpu
import numpy as np

from ...core.imaging import cryptomatte
from ..gpu import drawing
from ..gpu.programs import picture_programs
from ..gpu.visibility_buffer import NO_SEGMENT

NAME = "Mattes"  # of the film's pass

_COLUMNS = 1024  # of the texture of ranges
_NO_MATERIAL = "default_surface"  # as in Cycles

# Settings of a view layer → (beginning of pass names, kind of name).
KINDS = {
    "use_pass_cryptomatte_object": ("CryptoObject", "object"),
    "use_pass_cryptomatte_material": ("CryptoMaterial", "material"),
    "use_pass_cryptomatte_asset": ("CryptoAsset", "asset"),
}
INDICES = {"use_pass_object_index": "Object Index", "use_pass_material_index": "Material Index"}


@dataclass(frozen=True)
class Thing:
    """The object and material of a label; indices are Blender's pass indices."""

    object: str
    material: str
    asset: str
    object_index: int
    material_index: int


def pass_names(view_layer):
    """Names of the Cryptomatte passes and index passes that a view layer has enabled."""
    count = -(-view_layer.pass_cryptomatte_depth // 2)
    names = [f"{kind}{i:02d}" for one, (kind, _) in KINDS.items() if getattr(view_layer, one) for i in range(count)]
    return names + [name for setting, name in INDICES.items() if getattr(view_layer, setting)]


def is_matte(name):
    """Whether a pass is made from mattes."""
    return name.startswith("Crypto") or name in INDICES.values()


class Labels:
    """Labels of the objects of a render, the same in all of its motion steps and views.

    depth: number of ranks of the view layer's mattes.
    """

    def __init__(self, depth):
        self.depth = depth
        self.slot_count = 2 * -(-depth // 2) + 2  # labels of a pixel while samples are added, more than ranks
        self._numbers, self.things = {}, {}

    def texture(self, drawn, hair_ranges):
        """Return (texture, number) of the ranges of a `DrawnScene`'s segments; hair_ranges: [(first, count)]."""
        starts, labels = [0], [0]
        for (first, count), owner in zip(hair_ranges, drawn.owners, strict=True):
            starts += [first, first + count]
            labels += [self._number(owner[0], None), 0]
        starts.append(NO_SEGMENT)
        labels.append(0)
        place = NO_SEGMENT + 1
        for (surface, parts), owner in zip(drawn.surfaces, drawn.surface_owners, strict=True):
            for first, _count, material in parts or ():
                starts.append(place + first // 3)
                labels.append(self._number(owner[0], material))
            place += surface.triangle_count
            if parts is None:
                starts.append(place - surface.triangle_count)
                labels.append(0)
        starts.append(place)
        labels.append(0)
        count = len(starts)
        texels = np.zeros((-(-count // _COLUMNS) * _COLUMNS, 4), np.float32)
        texels[:count, 0], texels[:count, 1] = np.divmod(np.array(starts, np.int64), 65536)
        texels[:count, 2] = labels
        data = gpu.types.Buffer("FLOAT", texels.size, texels.ravel())
        return gpu.types.GPUTexture((_COLUMNS, len(texels) // _COLUMNS), format="RGBA32F", data=data), count

    def _number(self, uid, material):
        key = uid, None if material is None else material.name
        if key not in self._numbers:
            self._numbers[key] = len(self._numbers) + 1
            self.things[self._numbers[key]] = _thing(uid, material)
        return self._numbers[key]

    def passes(self, mattes, view_layer):
        """Return {pass: array} of the enabled passes; mattes: (labels, coverages), each (H, W, slots)."""
        arrays = {}
        for setting, (kind, name) in KINDS.items():
            if getattr(view_layer, setting):
                names = {label: getattr(thing, name) for label, thing in self.things.items()}
                arrays |= cryptomatte.passes(*mattes, names, self.depth, kind)
        for setting, name in INDICES.items():
            if getattr(view_layer, setting):
                arrays[name] = self._indices(mattes, "object_index" if name == "Object Index" else "material_index")
        return arrays

    def _indices(self, mattes, kind):
        """Return (H, W, 1) pass indices of the objects or materials that cover most of each pixel."""
        indices = np.zeros(max(self.things, default=0) + 1, np.float32)
        for label, thing in self.things.items():
            indices[label] = getattr(thing, kind)
        best = np.argmax(mattes[1], axis=-1)[..., None]
        return indices[np.take_along_axis(mattes[0], best, axis=-1)]

    def metadata(self, view_layer):
        """Return {name: text} of the metadata of a file with the enabled Cryptomatte passes."""
        found = {}
        for setting, (kind, name) in KINDS.items():
            if getattr(view_layer, setting):
                names = sorted({getattr(thing, name) for thing in self.things.values()})
                found |= cryptomatte.metadata(f"{view_layer.name}.{kind}", names)
        return found


def _thing(uid, material):
    """Return the `Thing` of an object's session UID; material: a `SurfaceMaterial`, None for hair."""
    owner = next((one for one in bpy.data.objects if one.session_uid == uid), None)
    if owner is None:
        return Thing("", _NO_MATERIAL, "", 0, 0)
    if material is None:
        used = next((slot.material for slot in owner.material_slots if slot.material is not None), None)
        name, index = (_NO_MATERIAL, 0) if used is None else (used.name, used.pass_index)
    else:
        name, index = material.name or _NO_MATERIAL, material.index
    top = owner
    while top.parent is not None:
        top = top.parent
    return Thing(owner.name, name, top.name, owner.pass_index, index)


class MatteFilm:
    """Slots of labels and weights of a tile of `size` (width, height) [pixels] on the GPU."""

    def __init__(self, size, labels):
        self._size, self.labels = size, labels
        layers = labels.slot_count // 2
        self._columns = int(np.ceil(np.sqrt(layers)))
        self._shape = self._columns, -(-layers // self._columns)
        whole = tuple(length * count for length, count in zip(size, self._shape, strict=True))
        self._texture = gpu.types.GPUTexture(whole, format=picture_programs.FILM_FORMAT)

    def clear(self):
        """Remove all coverage."""
        self._texture.clear(format="FLOAT", value=(0.0, 0.0, 0.0, 0.0))

    def add(self, drawn, samples, weighting, per_side, margin, border):
        """Add the samples of a `VisibilityBuffer` that shows a `DrawnScene`; weighting: texture of filter weights."""
        ranges, range_count = self.labels.texture(drawn, samples.segment_ranges)
        program = picture_programs.film_mattes_program()
        constants = {
            "samples_per_side": per_side,
            "margin": margin,
            "border": border,
            "range_count": range_count,
            "range_columns": _COLUMNS,
            "slot_count": self.labels.slot_count,
            "layer_columns": self._columns,
            "tile_width": self._size[0],
            "tile_height": self._size[1],
        }
        textures = {"filter_weights": weighting, "segments": samples.segments, "matte_ranges": ranges}
        with drawing.bound(program, {}, textures):
            for name, value in constants.items():
                program.uniform_int(name, value)
            program.image("sums", self._texture)
            drawing.dispatch_over(program, self._size)

    def read(self, weight_sum):
        """Return mattes of the tile: labels (H, W, slots) int32, coverages float32."""
        (width, height), (columns, rows) = self._size, self._shape
        texels = np.array(self._texture.read(), np.float32).reshape(rows, height, columns, width, 4)
        slots = texels.transpose(1, 3, 0, 2, 4).reshape(height, width, -1, 2)[:, :, : self.labels.slot_count]
        return slots[..., 0].astype(np.int32), slots[..., 1] / np.float32(weight_sum)
