# SPDX-License-Identifier: GPL-3.0-or-later
"""Looks of strands that vary by maps: absorption at root and tip, a factor of the roughness, and radial roughness."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from . import appearance
from .appearance import Appearance
from .fibre import principled, strand_variation
from .fibre.pigment import color_falloff, color_from_falloff, sigma_a_from_melanin, sigma_a_of_falloff

_BLACK = 64.0  # absorption beyond which no light is left


@dataclass(frozen=True, eq=False)
class StrandLooks:
    """Absorption per radius at root and tip (S, 3) float32 with all variation, and factors (S,) of the roughness.

    radial: (S,) radial roughness, None if it does not vary.
    """

    root: np.ndarray
    tip: np.ndarray
    roughness: np.ndarray
    radial: np.ndarray | None = None

    @cached_property
    def some(self) -> "StrandLooks":
        """At most a thousand of the looks, evenly chosen."""
        return self[:: -(-len(self) // 1000)]

    @cached_property
    def absorption_range(self) -> tuple[float, float]:
        """(least, greatest) absorption of any channel."""
        return float(min(self.root.min(), self.tip.min())), float(max(self.root.max(), self.tip.max()))

    @cached_property
    def radial_range(self) -> tuple[float, float] | None:
        """(least, greatest) radial roughness; None if it does not vary."""
        return None if self.radial is None else (float(self.radial.min()), float(self.radial.max()))

    def __len__(self) -> int:
        return len(self.root)

    def __getitem__(self, selection: slice | np.ndarray) -> "StrandLooks":
        """Return the looks of a slice, a mask or an index array."""
        radial = None if self.radial is None else self.radial[selection]
        return StrandLooks(self.root[selection], self.tip[selection], self.roughness[selection], radial)

    def replaced(self, strands: np.ndarray, looks: "StrandLooks") -> "StrandLooks":
        """Return these looks with `looks` (N,) in place of those of strands (N,), which are indices."""
        found = [values.copy() for values in self._arrays]
        for values, others in zip(found, looks._arrays, strict=True):
            values[strands] = others
        return StrandLooks(*found)

    def is_same(self, others: "StrandLooks | None") -> bool:
        """Return whether the looks are bit-identical to others."""
        if others is None or (self.radial is None) != (others.radial is None):
            return False
        return all(map(np.array_equal, self._arrays, others._arrays))

    @property
    def _arrays(self):
        return self.root, self.tip, self.roughness, *(() if self.radial is None else (self.radial,))

    def sigma_a(self, gradient: np.ndarray) -> np.ndarray:
        """Return sigma_a (S, ..., 3) at fractions (S, ...) or (...) of the tip's color."""
        gradient = np.asarray(gradient, float)[..., None]
        shape = (len(self.root), *(1,) * (max(gradient.ndim, 2) - 2), 3)
        root, tip = self.root.astype(float).reshape(shape), self.tip.astype(float).reshape(shape)
        return root + (tip - root) * gradient


def are_same(looks: StrandLooks | None, others: StrandLooks | None) -> bool:
    """Return whether looks, each possibly None, are bit-identical."""
    return looks is others if looks is None else looks.is_same(others)


def strand_looks(look: Appearance, varied: Mapping[str, np.ndarray], randoms: np.ndarray) -> StrandLooks:
    """Return the `StrandLooks` of strands with random numbers (S,).

    varied: {field of `Appearance`: (S,) or (S, 3)} in place of the look's value. The same equations as
    `appearance.strand_settings` and `strand_variation`, for each strand.
    """
    count = len(randoms)

    def given(name):
        return np.asarray(varied.get(name, getattr(look, name)), float)

    def value(name):
        found = given(name)
        return found if name in varied else np.broadcast_to(found, (count, *found.shape))

    radial = value("radial_roughness").astype(np.float32).astype(float) if "radial_roughness" in varied else None
    falloff = color_falloff(look.radial_roughness) if radial is None else color_falloff(radial)[:, None]
    randoms = np.asarray(randoms, float)
    deviation = 1.0 + 2.0 * (randoms - 0.5) * value("random_color")
    if look.parametrization == "MELANIN":
        melanin = value("melanin")
        # pigment × `pigment_factor` is the pigment of the deviating melanin.
        root = sigma_a_from_melanin(melanin * deviation, value("redness"))
        root = root + _dyes(given("tint"), falloff)
    elif look.parametrization == "COLOR":
        root = sigma_a_of_falloff(value("color"), falloff) * deviation[:, None]
    else:
        root = value("absorption") * deviation[:, None]
    tip = root * value("tip_absorption")[:, None] + _dyes(given("tip_tint"), falloff)
    factor = np.ones(count)
    if "roughness" in varied and look.roughness > 0.0:
        factor = value("roughness") / look.roughness
    return StrandLooks(
        np.clip(root, 0.0, _BLACK).astype(np.float32),
        np.clip(tip, 0.0, _BLACK).astype(np.float32),
        factor.astype(np.float32),
        None if radial is None else radial.astype(np.float32),
    )


def _dyes(tints, falloff):
    """Return sigma_a (S, 3) of dyes, or (3,) of one dye; zero for white."""
    return np.where(tints >= 1.0, 0.0, sigma_a_of_falloff(tints, falloff))


def gradient_of(look: Appearance, positions: np.ndarray) -> np.ndarray:
    """Return the fraction (...) of the tip's color at positions (...) from root 0 to tip 1."""
    settings = appearance.strand_settings(look)
    return strand_variation.tip_gradient(settings.gradient_start, settings.gradient_end, positions)


def roughness_of(look: Appearance, looks: StrandLooks, randoms: np.ndarray) -> np.ndarray:
    """Return the longitudinal roughness (S,) float64 of strands."""
    base = appearance.shaded(look).roughness * looks.roughness.astype(float)
    return principled.varied_roughness(base, look.random_roughness, randoms)


def colors_of(look: Appearance, looks: StrandLooks, sigma_a: np.ndarray) -> np.ndarray:
    """Return the colors (S, ..., 3) of grooms whose fibers have sigma_a (S, ..., 3) and the looks' radial roughness."""
    return color_from_falloff(sigma_a, _falloffs(look, looks, sigma_a.ndim))


def even_sigma_a(look: Appearance, looks: StrandLooks, sigma_a: np.ndarray) -> np.ndarray:
    """Return the sigma_a (S, ..., 3) that give the colors of `colors_of` with the radial roughness of the look."""
    if looks.radial is None:
        return sigma_a
    return sigma_a * np.square(_falloffs(look, looks, sigma_a.ndim) / color_falloff(look.radial_roughness))


def _falloffs(look, looks, dimension_count):
    """Return the `color_falloff` of strands, to multiply arrays (S, ..., 3) with."""
    if looks.radial is None:
        return color_falloff(look.radial_roughness)
    return color_falloff(looks.radial.astype(float)).reshape(-1, *(1,) * (dimension_count - 1))


def sample_sigma_a(look: Appearance, looks: StrandLooks, count: int = 8) -> np.ndarray:
    """Return sigma_a (N, count, 3) of some strands, at places evenly chosen along them."""
    return looks.some.sigma_a(gradient_of(look, (np.arange(count) + 0.5) / count)[None])


def mean_color(look: Appearance, looks: StrandLooks) -> np.ndarray:
    """Return the mean color RGB (3,) of a head of hair with these looks."""
    color = colors_of(look, looks.some, sample_sigma_a(look, looks))
    return appearance.dimmed(color.reshape(-1, 3).mean(axis=0), look)
