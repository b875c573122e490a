# SPDX-License-Identifier: GPL-3.0-or-later
"""Common settings of all styles: amount, variation, mask, and profile from root to tip.

The amount of a style at point i of strand s, with x_i the fraction of the strand's length from its root:

    A_si = amount · mask_s · (1 - vary · h_s) · profile(x_i) · course(x_i)
    profile(x) = root + (tip - root) · g(clamp((x - start) / (1 - start), 0, 1))

h_s is a random number of the strand (random_numbers.py) and g the curve of Blender's hair nodes with their Shape σ:
x^e up to σ = ½, 1 - (1 - x)^e above, with e = -log2(1 - min(σ, 1 - σ)). Within half a segment after the start, a
straight line replaces x^e: x^e starts vertically, so points would jump when the start passes them.
The course is 1, or a curve from root to tip (courses.py).
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar

import numpy as np

from ..params import Settings, param, param_of


@dataclass(frozen=True)
class StyleSettings(Settings):
    """Settings of every style: amount, variation, seed and mask."""

    is_on: bool = param(True, "Apply this style", label="Enabled")
    amount: float = param(1.0, "Strength of the style; at 0 the hair is unchanged", low=0.0, high=1.0, subtype="FACTOR")
    vary: float = param(
        0.0,
        "Random variation of the amount between strands; higher values leave some strands with less of the style",
        label="Variation",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
        may_vary=True,
    )
    seed: int = param(0, "Random seed; each value gives another random distribution", low=0, high=2**31 - 1)
    mask: str = param(
        "", "Vertex group, or attribute of the surface or of the guides, that multiplies the amount at the roots"
    )
    mask_image: str = param("", "Image that multiplies the amount through the UV map", label="Mask image")
    invert_mask: bool = param(False, "Apply the style where the mask is zero", label="Invert mask")


@dataclass(frozen=True)
class ProfiledSettings(StyleSettings):
    """A style whose amount changes from root to tip."""

    amount: float = param_of(StyleSettings, "amount", has_course=True)
    root: float = param(
        0.0,
        "Part of the amount at the roots",
        label="At root",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
        may_vary=True,
    )
    tip: float = param(
        1.0, "Part of the amount at the tips", label="At tip", low=0.0, high=1.0, subtype="FACTOR", may_vary=True
    )
    shape: float = param(
        0.5,
        "Course from root to tip; higher values move the change toward the tip",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
        may_vary=True,
    )
    start: float = param(
        0.0,
        "Part of the length that keeps the amount of the root",
        low=0.0,
        high=0.99,
        subtype="FACTOR",
        may_vary=True,
    )


CENTERS = (
    ("AUTOMATIC", "Automatic", "Space the centers evenly on the surface"),
    ("GUIDES", "Guides", "Place the centers at chosen guides"),
)


@dataclass(frozen=True)
class LockSettings(ProfiledSettings):
    """A style that gathers strands into locks, whose centers may be chosen guides."""

    centers: str = param(
        "AUTOMATIC", "Positions of the centers of the largest locks", choices=CENTERS, is_structural=True
    )
    center_guides: str = param(
        "", "Saved selection of the guides at the centers; if empty, all guides", label="Selection", is_structural=True
    )


def guide_set(settings: StyleSettings) -> str | None:
    """Return the name of the selection of guides at the centers of a style, "" for all guides; None without."""
    if not isinstance(settings, LockSettings) or settings.centers != "GUIDES":
        return None
    return settings.center_guides


@dataclass(frozen=True)
class Profile:
    """The numbers of a profile, as read by kernels; arrays (S,) if they differ between strands."""

    root: Any = 1.0
    tip: Any = 1.0
    exponent: Any = 1.0
    is_flipped: Any = False  # whether the Shape is above one half
    start: Any = 0.0


EVERYWHERE = Profile()


@dataclass(frozen=True)
class TreeSettings:
    """Inputs for the clump sites of a style.

    sizes: distance between the sites of each level [m], the largest first; crossover: fraction of the strands that
    belong to the second nearest site; variants: the trees that strands choose among if their sizes differ; guides:
    indices of the guides that are the sites of the first level, None for sites that are placed.
    """

    sizes: tuple[float, ...]
    seed: int
    crossover: float
    variants: "tuple[TreeSettings, ...]" = ()
    guides: tuple[int, ...] | None = None

    @property
    def placed_sizes(self) -> tuple[float, ...]:
        """Distances between the sites [m] of the levels whose sites are placed."""
        return self.sizes if self.guides is None else self.sizes[1:]


@dataclass(frozen=True)
class Cutter:
    """A plane that trims strands: parts on the side of its unit normal (3,) are cut off.

    point: (3,) [m] on the plane, in the coordinates of strands.
    """

    point: np.ndarray
    normal: np.ndarray


@dataclass(frozen=True)
class Step:
    """A row of a program: one run of a .strand file.

    kind: a key of `kinds.STEPS`; numbers: values of the file's own parameters, by the names in `NUMBERS` of its module;
    amount, keep_length, profile, numbers: floats that differ between strands are arrays (S,);
    level: level of the clump centers that the step needs, counted from its style's first; None for a style above;
    place, part: indices of its style in the stack, and of the step among the steps of this style.
    """

    kind: str
    settings: StyleSettings
    amount: Any
    profile: Profile
    numbers: Mapping[str, Any]  # floats, or tuples of floats for a name with a size
    level: int | None = None
    keep_length: Any = 1.0
    place: int = 0
    part: int = 0


def evaluated(profile: Profile, x: np.ndarray) -> np.ndarray:
    """Return the profile at x (S, P), fractions from 0 to 1 of the length of strands of P points.

    The numbers of the profile are floats, or arrays (S,).
    """
    # Exponents are arrays, so that a strand has the same bits with a number and with an array of equal numbers.
    numbers = profile.root, profile.tip, profile.exponent, profile.is_flipped, profile.start
    root, tip, exponent, is_flipped, start = (np.reshape(number, (-1, 1)) for number in numbers)
    y = np.clip((x - start) / (1.0 - start), 0.0, 1.0)
    raised = _power(np.where(is_flipped, 1.0 - y, y), exponent)
    least = 0.5 / (x.shape[-1] - 1)
    y = np.where(is_flipped, 1.0 - raised, np.where(y < least, y * least ** (exponent - 1.0), raised))
    return root + (tip - root) * y


def _power(x, exponent):
    return np.where(x > 0.0, np.maximum(x, 1e-30) ** exponent, 0.0)


def profile_of(settings: StyleSettings) -> Profile:
    """Return the `Profile` of a style's settings; without profile settings, a constant one."""
    if not isinstance(settings, ProfiledSettings):
        return EVERYWHERE
    exponent = of_each(lambda shape: -math.log2(1.0 - min(shape, 1.0 - shape)), settings.shape)
    return Profile(settings.root, settings.tip, exponent, settings.shape > 0.5, settings.start)


def of_each(function: Callable[[float], float], values: Any) -> Any:
    """Return the value of a function for a float, or for each number of an array (S,), with the same bits."""
    if not isinstance(values, np.ndarray):
        return function(values)
    distinct, places = np.unique(values, return_inverse=True)
    return np.array([function(each) for each in distinct.tolist()])[places]


def step_of(settings: StyleSettings, kind: str, numbers: Mapping[str, Any], **changes: Any) -> Step:
    """Return the `Step` of a kind with the amount and the profile of its style; changes: other fields."""
    return replace(Step(kind, settings, settings.amount, profile_of(settings), numbers), **changes)


def has_effect(settings: StyleSettings) -> bool:
    """Return whether a style can change strands: it is enabled, with amount and profile not zero everywhere."""
    is_profile_zero = isinstance(settings, ProfiledSettings) and settings.root == settings.tip == 0.0
    return settings.is_on and settings.amount > 0.0 and not is_profile_zero


S = TypeVar("S", bound=StyleSettings)


def scaled(settings: S, factor: float) -> S:
    """Return style settings with all lengths multiplied by a factor, within their ranges."""
    changes = {}
    for field in fields(settings):
        details = field.metadata["param"]
        if details.unit == "LENGTH":
            changes[field.name] = min(max(getattr(settings, field.name) * factor, details.low), details.high)
    return replace(settings, **changes)
