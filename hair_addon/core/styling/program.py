# SPDX-License-Identifier: GPL-3.0-or-later
"""A stack of styles → the program that the kernel of steps.py runs, and the clump trees that it needs."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from . import base, bend, braid, clump, curl, frizz, program_rows, smooth, trim, wet
from .base import EVERYWHERE, Profile, StyleSettings, has_effect, profile_of
from .program_rows import Program

_WET_RATIO = 0.32  # of the small wet locks to the large ones
_WET_THICKNESS = 0.10
_WET_SMOOTHING = 2.0  # lengths of locks that water smooths over
_WET_CLUMP = 0.92
_WET_START = 0.01  # below, small locks join evenly: by the square root they would begin at once
_TWO_PI = 2.0 * math.pi
NO_LIMIT = 1e30  # [m], of a length


@dataclass(frozen=True)
class TreeSettings:
    """What the clump sites of a style follow from.

    sizes: distance between the sites of each level [m], the largest first; crossover: part of the strands that belongs
    to the second nearest site.
    """

    sizes: tuple[float, ...]
    seed: int
    crossover: float


@dataclass(frozen=True)
class Cutter:
    """A plane that trims strands: they keep what lies on the side that the unit normal (3,) points away from.

    point: (3,) [m] of the plane, in the coordinates of strands.
    """

    point: np.ndarray
    normal: np.ndarray


def tree_settings(settings: StyleSettings) -> TreeSettings | None:
    """The `TreeSettings` of a style that gathers strands; None for others."""
    if isinstance(settings, clump.Settings):
        return TreeSettings(tuple(clump.sizes(settings)), settings.seed, settings.crossover)
    if isinstance(settings, braid.Settings):
        return TreeSettings((settings.size,), settings.seed, 0.0)
    if isinstance(settings, wet.Settings):
        return TreeSettings((settings.lock, settings.lock * _WET_RATIO), settings.seed, 0.0)
    return None


def tree_levels(styles: Sequence[StyleSettings]) -> list[tuple[TreeSettings, int]]:
    """[(tree, level)] of all styles that gather strands, in the order in which their centres are made."""
    trees = [tree_settings(settings) for settings in styles if has_effect(settings)]
    return [(tree, level) for tree in trees if tree is not None for level in range(len(tree.sizes))]


def mask_key(settings: StyleSettings) -> tuple[str, str, bool] | None:
    """What a style's mask is known by, (name, image, whether it is inverted); None for a style without one."""
    if not settings.mask and not settings.mask_image:
        return None
    return settings.mask, settings.mask_image, settings.invert_mask


def mask_keys(styles: Sequence[StyleSettings]) -> list[tuple[str, str, bool]]:
    """The masks of the styles that have an effect, each once."""
    found = (mask_key(settings) for settings in styles if has_effect(settings))
    return list(dict.fromkeys(key for key in found if key is not None))


@dataclass(frozen=True)
class Step:
    """A row of a program; level: of `tree_levels`, the guides' own for None."""

    kind: int
    settings: StyleSettings
    amount: float
    profile: Profile
    own: tuple[float, ...]
    level: int | None = None
    keep_length: float = 1.0


def strand_steps(styles: Sequence[StyleSettings], cutters: Mapping[str, Cutter]) -> list[Step]:
    """The steps that act on strands, in order; cutters: planes by the names that Trim styles know them by."""
    made: list[Step] = []
    level, coherent = 0, None
    for settings in filter(has_effect, styles):
        tree = tree_settings(settings)
        made += [
            replace(step, level=coherent if step.level is None else level + step.level)
            for step in _steps_of(settings, cutters)
        ]
        if tree is not None:
            shared = settings.tip_level if isinstance(settings, clump.Settings) else 0
            coherent = level + min(shared, len(tree.sizes) - 1)
            level += len(tree.sizes)
    return made


def compiled(
    steps_made: Sequence[Step], masks: Sequence[tuple[str, str, bool]], first_centres: Sequence[int]
) -> Program:
    """The `Program` of steps.

    masks: those of `mask_keys`; first_centres: where the centres of each level begin, the guides' own last.
    """
    choices = np.zeros((len(steps_made), program_rows.CHOICES), np.int32)
    numbers = np.zeros((len(steps_made), program_rows.NUMBERS), np.float32)
    guides_level = len(first_centres) - 1
    for row, step in enumerate(steps_made):
        key = mask_key(step.settings)
        level = guides_level if step.level is None else step.level
        mask = -1 if key is None else masks.index(key)
        choices[row] = step.kind, step.settings.seed, mask, level, first_centres[level]
        shared = (step.amount, step.settings.vary, *_numbers_of(step.profile), step.keep_length)
        row_numbers = (*shared, *step.own)
        numbers[row, : len(row_numbers)] = row_numbers
    return Program(choices, numbers)


def _numbers_of(profile):
    return profile.root, profile.tip, profile.exponent, float(profile.is_flipped), profile.start


def _steps_of(settings, cutters):
    """The steps of one style; a level counts from the first of its own."""

    def step(kind, own, amount=settings.amount, profile=None, level=None, keep_length=1.0):
        profile = profile_of(settings) if profile is None else profile
        return Step(kind, settings, amount, profile, own, level, keep_length)

    if isinstance(settings, trim.Settings):
        return [step(program_rows.TRIM, _of_trim(settings, cutters.get(settings.cutter)))]
    if isinstance(settings, clump.Settings):
        own = settings.thickness, settings.twist / settings.levels, settings.stray
        return [step(program_rows.CLUMP, own, amount, level=k) for k, amount in enumerate(clump.amounts(settings))]
    if isinstance(settings, curl.Settings):
        return [step(program_rows.CURL, _of_curl(settings), keep_length=settings.keep_length)]
    if isinstance(settings, frizz.Settings):
        return [step(program_rows.FRIZZ, _of_frizz(settings), keep_length=settings.keep_length)]
    if isinstance(settings, bend.Settings):
        return [step(program_rows.BEND, (settings.angle / _TWO_PI, settings.turn / _TWO_PI, settings.random_turn))]
    if isinstance(settings, smooth.Settings):
        return [step(program_rows.SMOOTH, (settings.length,))]
    if isinstance(settings, braid.Settings):
        tress_count = 3 if settings.pattern == "BRAID" else 2
        size = settings.radius, settings.pitch, 1.0 - settings.flatness
        return [step(program_rows.WEAVE, (*size, float(tress_count), settings.thickness), level=0)]
    if isinstance(settings, wet.Settings):
        return _of_wet(settings, step)
    return []  # a style of guides


def _of_trim(settings, cutter):
    plane = (0.0,) * 5
    if cutter is not None:
        plane = (1.0, *map(float, cutter.normal), float(np.dot(cutter.normal, cutter.point)))
    to_length = settings.to_length or NO_LIMIT
    lengths = settings.factor, settings.random, to_length, settings.undercoat, settings.undercoat_length
    return (*lengths, float(settings.method == "CUT"), *plane)


def _of_curl(settings):
    shape = settings.radius, settings.pitch, 1.0 - settings.flatness, settings.coherence
    return (*shape, settings.stretch, settings.left_handed, settings.switchback)


def _of_frizz(settings):
    gains = settings.gain ** np.arange(settings.octaves)
    # Each coordinate of ρ has the amplitude as its root mean square: the square of a wave is one half.
    per_size = (0.5 * frizz.WAVES_AN_OCTAVE * np.sum(gains**2)) ** -0.5
    wave = np.arange(frizz.WAVES_AN_OCTAVE)
    frequencies = 2.0 ** ((wave + 0.5) / frizz.WAVES_AN_OCTAVE - 0.5)
    size = settings.amplitude * per_size, settings.wavelength, float(settings.octaves), settings.gain
    return (*size, settings.coherence, 1.0 / settings.spread, settings.stray, settings.stray_gain, *frequencies)


def _of_wet(settings, step):
    wetness = settings.amount
    along = Profile(0.0, 1.0, base.profile_of(clump.Settings()).exponent)
    smoothing = step(program_rows.SMOOTH, (settings.lock * _WET_SMOOTHING,), settings.relax * wetness, EVERYWHERE)
    own = _WET_THICKNESS, 0.0, 0.0
    large = step(program_rows.CLUMP, own, _WET_CLUMP * wetness**1.5, along, 0)
    small = step(program_rows.CLUMP, own, _WET_CLUMP * wetness / max(wetness, _WET_START) ** 0.5, along, 1)
    return [smoothing, large, small]


def radius_factor(styles: Sequence[StyleSettings]) -> float:
    """By how much styles thicken strands: soaked ones swell."""
    swellings = [s.swelling * s.amount for s in styles if isinstance(s, wet.Settings) and has_effect(s)]
    return math.prod(1.0 + swelling for swelling in swellings)


def wetness(styles: Sequence[StyleSettings]) -> float:
    """The wetness that styles give the shading: the largest of all."""
    return max((s.amount for s in styles if isinstance(s, wet.Settings) and has_effect(s)), default=0.0)
