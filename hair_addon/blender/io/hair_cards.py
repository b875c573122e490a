# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair → cards: ribbons, textures drawn from the strands, and materials, for each level of detail."""

from dataclasses import dataclass

import numpy as np

from ...core.cards import best_placement, texels
from ...core.cards.card_error import CardError, Comparison
from ...core.cards.card_layout import CardStrands, Placement, laid_cards
from ...core.cards.polygon_mesh import PolygonMesh
from ...core.errors import HairError
from ...core.files import file_names
from ...core.files.atomic_file import require_writable_path
from ...core.long_work import Stage, part_of
from ...core.shading import appearance
from ..data import whole_changes
from ..data.made import card_images, made_meshes
from ..materials import card_material
from ..render import card_pictures
from . import hair_meshes


@dataclass(frozen=True)
class CardLevel:
    """A finished level of detail: its object, {map: image}, and numbers of cards, pictures and triangles.

    error: of the cards compared with the strands, None if it was not measured; notes: on omitted parts of the hair.
    """

    mesh_object: object
    images: dict
    card_count: int
    picture_count: int
    triangle_count: int
    error: CardError | None
    notes: list[HairError]


@dataclass(frozen=True)
class _Drawn:
    """A drawn level, not yet in the scene."""

    mesh: PolygonMesh
    maps: dict
    card_count: int
    picture_count: int
    error: CardError | None


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
    strands = CardStrands(read.points, read.radii, read.colors(), read.surface, read.roughness())
    levels = settings.levels(len(read.points))
    comparison = trials = None
    if settings.error_measure != "OFF":
        comparison = yield lambda progress: Comparison(strands, progress)
    if settings.error_measure == "MINIMIZED":
        most = levels[0].card_count
        trials = yield lambda progress: best_placement.Trials(strands, comparison, most, progress)
    areas = np.cumsum([0] + [level.texture_size**2 for level in levels])
    parts = (areas / areas[-1]).tolist()
    drawn = []
    for index, level in enumerate(levels):
        drawn.append((yield from _drawing(strands, comparison, trials, level, settings, parts[index : index + 2])))
    joints = yield lambda _progress: read.joints(settings)
    return _written(read, drawn, joints, folder, settings.texture_layout)


def _drawing(strands, comparison, trials, level, settings, parts):
    """Draw a level, as work in steps.

    comparison, trials: comparisons with the strands for the error and for trials, or None; parts: the first and last
    part of the total progress.
    """
    first, last = parts
    middle = first + 0.1 * (last - first)
    choice = settings, Placement()
    if trials is not None:
        choice = yield lambda progress: best_placement.best_placement(
            trials, level, settings, part_of(progress, first, middle)
        )
    laid = yield lambda progress: laid_cards(strands, level, *choice, part_of(progress, first, middle))
    placed = laid.strands
    yield Stage("Drawing cards", middle)
    picture = card_pictures.CardPicture(placed, level.texture_size)
    sums = texels.TexelSums(level.texture_size, placed.roughness is not None)
    for turn in range(card_pictures.PASSES):
        for rows in picture.strips():
            here = turn + rows.start / level.texture_size
            yield Stage("Drawing cards", first + (last - first) * (0.1 + 0.8 * here / card_pictures.PASSES))
            segments, shift = picture.segments(rows, turn)
            yield _adding(sums, segments, placed, shift, rows)
    maps = yield lambda _progress: sums.maps()
    error = None
    if comparison is not None:
        error = yield lambda _progress: comparison.error_of(laid.mesh, maps)
    return _Drawn(laid.mesh, maps, level.card_count, laid.picture_count, error)


def _adding(sums, segments, placed, shift, rows):
    return lambda _progress: sums.add(segments, placed, card_pictures.PER_SIDE, shift, rows)


def _stem(name, taken):
    """Unused prefix for names of texture files."""

    def begun(stem):
        return f"{stem}_Cards_LOD"

    return begun(
        file_names.free_stem(name, lambda stem: any(file.startswith(begun(stem).casefold()) for file in taken))
    )


def _written(read, drawn, joints, folder, layout):
    name = f"{read.name} Cards"
    stem = "" if folder is None else _stem(read.name, card_images.files_of_others(f"{name} LOD", folder))
    roughness = appearance.shaded(read.look).roughness
    images = [
        card_images.new_images(f"{name} LOD{index}", level.maps, layout, roughness) for index, level in enumerate(drawn)
    ]
    pieces, made = hair_meshes.Pieces(read, name, joints), []
    for index, (level, its) in enumerate(zip(drawn, images, strict=True)):
        title = f"{name} LOD{index}"
        material = card_material.new_material(title, read.look, its)
        mesh_object = pieces.new_object(title, level.mesh, material, level.card_count, 2)
        if index:
            made_meshes.hide(mesh_object)
        if level.error is not None:
            mesh_object["coverage_error"], mesh_object["flip_error"] = level.error.coverage, level.error.flip
        counts = level.card_count, level.picture_count, level.mesh.triangle_count
        made.append(CardLevel(mesh_object, its, *counts, level.error, read.notes))
    card_images.keep(images, folder, stem)  # last: replaced files cannot be restored
    return made
