# SPDX-License-Identifier: GPL-3.0-or-later
"""Styles of a hair: add, replace, and fit to the size of its surface.

Locks are placed, in steps, before styles are written, so that the following update finds them in the cache.
"""

import math
from collections.abc import Collection, Sequence
from dataclasses import replace

from bpy.types import Curves, Object

from ....core.errors import HairError
from ....core.files import style_presets
from ....core.files.settings_file import PartialSettings
from ....core.geometry import strands
from ....core.grooming import groom_defaults
from ....core.grooming.groom import GuideSettings, HairSettings
from ....core.long_work import Work
from ....core.params import declared
from ....core.styling import curl, fitting, program, varied_numbers
from ....core.styling.base import StyleSettings, has_effect
from ...data import scene
from ...data.strands import curves, style_inputs
from ...host.datablocks import Remembered
from ...settings import setting_properties, style_items
from .. import bindings, pipeline
from ..transfer import groom_settings

_HEAD_LENGTH = next(length for name, length, _details in declared(GuideSettings) if name == "length")  # [m]


def adding(
    hair: Curves, settings: StyleSettings, name: str = "", is_fitted: bool = False, kept: Collection[str] = ()
) -> Work[StyleSettings]:
    """Add a style to a hair Curves datablock, after its other styles, as work in steps; returns its settings.

    is_fitted: whether lengths are for a human head, and fitted to the surface; kept: names of settings that are not
    fitted. Unless `kept` contains the seed, it becomes one that no other style of the hair has. Raises `HairError`
    before any change.
    """
    curves.require_editable(hair)
    style_items.require_room(len(hair.vellus.styles) + 1)
    wanted = settings
    if is_fitted:
        factor, spacing = surface_fit(hair)
        wanted = fitting.fitted(settings, factor, kept=kept)
        settings = fitting.fitted(settings, factor, spacing, kept)
    if "seed" not in kept:
        settings = replace(settings, seed=style_items.new_seed(hair.vellus))
    place = Remembered(hair)
    yield _placing_locks(hair, [settings])
    hair = _found(place)
    style_items.add(hair.vellus, settings, name)
    _note_locks(hair, hair.vellus.styles[-1:], [wanted])
    return style_items.settings_of(style_items.active_of(hair.vellus))


def assigning(hair: Curves, styles: Sequence[StyleSettings], names: Sequence[str] = ()) -> Work[None]:
    """Replace the styles of a hair Curves datablock, as work in steps; styles that remain keep their keyframes.

    Raises `HairError` before any change.
    """
    curves.require_editable(hair)
    place = Remembered(hair)
    yield _placing_locks(hair, styles)
    style_items.assign(_found(place).vellus, styles, names)


def duplicating(hair: Curves) -> Work[None]:
    """Add a copy of a hair's active style after it, with another seed, as work in steps. Raises `HairError`."""
    curves.require_editable(hair)
    state, place = hair.vellus, Remembered(hair)
    style_items.require_room(len(state.styles) + 1)
    copied = replace(style_items.settings_of(style_items.active_of(state)), seed=style_items.new_seed(state))
    yield _placing_locks(hair, [copied])
    state = _found(place).vellus
    style_items.duplicate(state, state.active_style)


def applying_preset(
    hair: Curves, preset: PartialSettings, is_fitted: bool = True, keeps_styles: bool = False
) -> Work[None]:
    """Apply a style preset to a hair Curves datablock, as work in steps; settings not in the preset do not change.

    is_fitted: as in `adding`; keeps_styles: add the preset's styles after the present ones. Raises `HairError` before
    any change.
    """
    unenlarged = preset
    if is_fitted:
        factor, spacing = surface_fit(hair)
        unenlarged, preset = (style_presets.fit(preset, factor, distance) for distance in (0.0, spacing))
    present = groom_settings.settings_of(hair)
    wanted = preset.changed(present)
    if keeps_styles and preset.styles is not None:
        added = _with_new_seeds(preset.styles, present.styles)
        names = [*present.style_names, *(preset.style_names or [""] * len(added))]
        wanted = replace(wanted, styles=(*present.styles, *added), style_names=tuple(names))
    place = Remembered(hair)
    yield _placing_locks(hair, wanted.styles)
    hair = _found(place)
    groom_settings.apply_settings(hair, wanted)
    if preset.styles:
        _note_locks(hair, hair.vellus.styles[-len(preset.styles) :], unenlarged.styles or ())


def _note_locks(hair, items, wanted):
    """Note on items which locks of wanted styles were enlarged for the number of strands."""
    for item, style in zip(items, wanted, strict=True):
        enlarged = fitting.lock_size(style_items.settings_of(item))
        style_items.note_enlarged(item, fitting.lock_size(style), enlarged, hair.vellus.hair.strand_count)


def _found(place: Remembered) -> Curves:
    """Return the remembered hair. Raises `HairError` if it was deleted."""
    found: Curves = place.find()
    return found


def _placing_locks(hair, styles):
    """Return the computation that places the locks of styles on a hair's surface, if the hair is bound and live.

    Without Auto Update the next update places them.
    """
    stored = [setting_properties.as_stored(style) for style in styles]
    bound = bindings.of(hair) if program.tree_levels(stored) and hair.vellus.is_live else None
    trees = [] if bound is None else _trees_of(hair, bound, stored)

    def compute(progress):
        if bound is not None:
            bound.styles.trees.search(trees, progress)

    return compute


def _trees_of(hair, bound, styles):
    """Return the clump trees of styles, none if the hair cannot have them: its status gives the reason."""
    try:
        guide_sets = style_inputs.guide_sets(hair.vellus.guide_curves, styles)
        at_guides = varied_numbers.trees_at_guides(styles, guide_sets, len(bound.guides))
    except HairError:
        return []
    return [tree for tree, _level in program.tree_levels(styles, at_guides)]


def surface_fit(hair: Curves) -> tuple[float, float]:
    """Return (factor of lengths, mean distance of strands [m]) for a hair's surface; the factor is 1 on a human scalp.

    Raises `HairError`.
    """
    guides, settings = pipeline.inputs_of(hair)
    return fit_of(guides.surface, setting_properties.to_settings(guides.vellus.guides, GuideSettings), settings)


def fit_of(surface_object: Object, guide_settings: GuideSettings, hair_settings: HairSettings) -> tuple[float, float]:
    """Return `surface_fit` for hair with these settings on a mesh object."""
    open_guides, open_hair = replace(guide_settings, length=None), replace(hair_settings, influence_distance=None)
    known_guides, known_hair = pipeline.complete(surface_object, open_guides, open_hair, scene.present_depsgraph())
    # `complete` leaves no value unset.
    length, influence = known_guides.length or _HEAD_LENGTH, known_hair.influence_distance or 0.0
    spacing = influence / groom_defaults.INFLUENCE * math.sqrt(guide_settings.guide_count / hair_settings.strand_count)
    return length / _HEAD_LENGTH, spacing


def points_wanted(hair: Curves, length: float | None = None) -> int:
    """Return the points per strand that the curls of a hair need, within the setting's range; 0 without curls.

    length [m]: of strands, None for the guides' setting; required for hand-made guides. Raises `HairError`.
    """
    guides = hair.vellus.guide_curves
    if guides is None or (length is None and curves.is_hand_made(guides)):
        return 0
    length = guides.vellus.guides.length if length is None else length
    styles = style_items.styles_of(hair.vellus)
    curls = [style for style in styles if isinstance(style, curl.Settings) and has_effect(style)]
    most = hair.vellus.hair.bl_rna.properties["point_count"].hard_max
    return min(max((curl.points_wanted(style, length) for style in curls), default=0), most)


def use_points(hair: Curves) -> int:
    """Increase the points per strand to the number that curls need; returns the number. Raises `HairError`."""
    curves.require_editable(hair)
    guides, _settings = pipeline.inputs_of(hair)
    wanted = points_wanted(hair, _mean_length(guides) if curves.is_hand_made(guides) else None)
    if not wanted:
        raise HairError("No style needs more points: add Curl or Wave.")
    hair.vellus.hair.point_count = max(wanted, hair.vellus.hair.point_count)
    return hair.vellus.hair.point_count


def _mean_length(guides):
    """Return the mean length of guides in the world [m]; 0 without guides."""
    if not len(guides.curves):
        return 0.0
    scale = 1.0 if guides.surface is None else guides.surface.matrix_world.median_scale
    return float(strands.ragged_lengths(curves.read_points(guides), curves.curve_offsets(guides)).mean()) * scale


def _with_new_seeds(added, present):
    """Return styles with seeds that no style before them has."""
    taken = {style.seed for style in present}
    renewed = []
    for style in added:
        seed = style.seed if style.seed not in taken else next(n for n in range(len(taken) + 1) if n not in taken)
        taken.add(seed)
        renewed.append(replace(style, seed=seed))
    return tuple(renewed)
