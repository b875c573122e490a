# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair → cards: ribbons, textures drawn from the strands, and materials, for each level of detail."""

from dataclasses import dataclass

import numpy as np

from ...core.cards import atlas, outlines, ribbons, texels
from ...core.cards.polygon_mesh import PolygonMesh
from ...core.errors import HairError
from ...core.files import file_names
from ...core.files.atomic_file import require_writable_path
from ...core.geometry.search import clusters
from ...core.long_work import Stage, part_of
from ..data import whole_changes
from ..data.made import card_images, made_meshes
from ..materials import card_material
from ..render import card_pictures
from . import hair_meshes


@dataclass(frozen=True)
class CardLevel:
    """A finished level of detail: its object, {map: image}, and numbers of cards, pictures and triangles.

    notes: on omitted parts of the hair.
    """

    mesh_object: object
    images: dict
    card_count: int
    picture_count: int
    triangle_count: int
    notes: list[HairError]


@dataclass(frozen=True)
class _Drawn:
    """A drawn level, not yet in the scene."""

    mesh: PolygonMesh
    maps: dict
    card_count: int
    picture_count: int


@whole_changes.whole
def making_cards(hair, settings, folder=None):
    """Make cards of hair Curves, as work in steps; returns [`CardLevel`], the finest first. Raises `HairError`.

    settings: `CardSettings`; folder: for the texture files, None packs them into the .blend. Nothing is added to the
    scene until all levels are drawn.
    """
    settings.require_size(hair_meshes.strand_count(hair))
    if folder is not None:
        folder = folder.absolute()  # Blender resolves relative image paths from the .blend file
        require_writable_path(folder / "texture.png")
    yield Stage("Reading strands", 0.0)
    read = hair_meshes.read_hair(hair)
    levels = settings.levels(len(read.points))
    areas = np.cumsum([0] + [level.texture_size**2 for level in levels])
    parts = (areas / areas[-1]).tolist()
    drawn = []
    for index, level in enumerate(levels):
        drawn.append((yield from _drawing(read, level, settings.picture_count, parts[index : index + 2])))
    joints = yield lambda _progress: read.joints(settings)
    return _written(read, drawn, joints, folder)


def _drawing(read, level, picture_count, parts):
    """Draw a level, as work in steps; parts: (first, last) of the total progress."""
    first, last = parts
    interval = first, first + 0.1 * (last - first)
    flat = yield lambda progress: _flat_cards(read, level, picture_count, part_of(progress, *interval))
    mesh, placed, drawn_count = flat
    yield Stage("Drawing cards", interval[1])
    picture = card_pictures.CardPicture(placed, level.texture_size)
    sums = texels.TexelSums(level.texture_size)
    for turn in range(card_pictures.PASSES):
        for rows in picture.strips():
            here = turn + rows.start / level.texture_size
            yield Stage("Drawing cards", first + (last - first) * (0.1 + 0.8 * here / card_pictures.PASSES))
            segments, shift = picture.segments(rows, turn)
            yield _adding(sums, segments, placed, shift, rows)
    maps = yield lambda _progress: sums.maps()
    return _Drawn(mesh, maps, level.card_count, drawn_count)


def _adding(sums, segments, placed, shift, rows):
    return lambda _progress: sums.add(segments, placed, card_pictures.PER_SIDE, shift, rows)


def _flat_cards(read, level, picture_count, progress):
    """Compute the cards; returns (mesh beside the surface, `PlacedStrands`, number of pictures)."""
    count = level.card_count
    labels = clusters.clusters(clusters.strand_features(read.points), count, progress)
    progress("Making cards", 1.0)
    axes = ribbons.axes_of(read.points, labels, count, level.segment_count, read.surface)
    flat = ribbons.flattened(read.points, labels, axes)
    found = outlines.outlines(flat, read.radii, labels, axes)
    lifted = outlines.heights(flat, labels, found)
    flat = outlines.levelled(flat, labels, found, lifted)
    places = atlas.atlas(found, np.bincount(labels, minlength=count), picture_count, level.texture_size)
    strands, points, radii = places.placed(flat, read.radii, labels, found.boxes)
    heights = float(points[..., 2].min()), float(points[..., 2].max())
    ids = np.random.default_rng(0).permutation(len(strands)) / max(len(strands) - 1, 1)
    placed = texels.PlacedStrands(points, radii, read.colors()[strands], ids.astype(np.float32), heights)
    mesh = outlines.ribbon_mesh(axes, found, places.uvs(found), lifted)
    return mesh, placed, len(places.shown)


def _stem(name, taken):
    """Unused prefix for names of texture files."""

    def begun(stem):
        return f"{stem}_Cards_LOD"

    return begun(
        file_names.free_stem(name, lambda stem: any(file.startswith(begun(stem).casefold()) for file in taken))
    )


def _written(read, drawn, joints, folder):
    name = f"{read.name} Cards"
    stem = "" if folder is None else _stem(read.name, card_images.files_of_others(f"{name} LOD", folder))
    images = [card_images.new_images(f"{name} LOD{index}", level.maps) for index, level in enumerate(drawn)]
    pieces, made = hair_meshes.Pieces(read, name, joints), []
    for index, (level, its) in enumerate(zip(drawn, images, strict=True)):
        title = f"{name} LOD{index}"
        material = card_material.new_material(title, read.look, its)
        mesh_object = pieces.new_object(title, level.mesh, material, level.card_count, 2)
        if index:
            made_meshes.hide(mesh_object)
        counts = level.card_count, level.picture_count, level.mesh.triangle_count
        made.append(CardLevel(mesh_object, its, *counts, read.notes))
    card_images.keep(images, folder, stem)  # last: replaced files cannot be restored
    return made
