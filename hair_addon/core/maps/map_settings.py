# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of a map: the setting that the map varies, the source of its values, and their combination."""

from dataclasses import dataclass

from ..params import Settings, param
from . import ramp_text
from .combination import Combination

KINDS = (
    ("IMAGE", "Image", "Image through a UV map of the surface; each strand has the mean of its share of the surface"),
    ("GROUP", "Vertex Group", "Weights of a vertex group of the surface"),
    ("ATTRIBUTE", "Attribute", "Attribute of the surface: numbers or colors"),
    ("CURVES", "Hair Attribute", "Attribute of the hair's own curves"),
    ("STRAND", "Per Strand", "A random number for each strand"),
    ("CLUMP", "Per Clump", "A random number for each clump of the hair's styles"),
)
NAMED = ("GROUP", "ATTRIBUTE", "CURVES")  # kinds with a named source, besides images


@dataclass(frozen=True)
class MapSettings(Settings):
    """A map of one setting."""

    setting: str = param("", "Setting that the map varies, such as look.color")
    kind: str = param("IMAGE", "Source of the map's values", choices=KINDS)
    source: str = param("", "Name of the image, vertex group or attribute")
    uv: str = param("", "UV map for the image. Leave empty to use the active UV map", label="UV map")
    low: float = param(0.0, "Factor of the setting where the map is black", label="From", high=1e6, low=-1e6)
    high: float = param(1.0, "Factor of the setting where the map is white", label="To", high=1e6, low=-1e6)
    is_inverted: bool = param(False, "Exchange black and white", label="Invert")
    amount: float = param(
        1.0, "How much of the map's color replaces the color of the setting", low=0.0, high=1.0, subtype="FACTOR"
    )
    seed: int = param(0, "Random seed; each value gives another random distribution", low=0, high=2**31 - 1)
    ramp: str = param("", "Curve of the map's values, or color ramp of a color, such as 0:1 0.5:0.3 1:0.2")
    course: str = param("", "Curve from root to tip that multiplies a setting of a style, such as 0:1 1:0.2")

    def __post_init__(self) -> None:
        super().__post_init__()
        ramp_text.parsed(self.ramp)
        ramp_text.require_curve(self.course)

    @property
    def has_source(self) -> bool:
        """Whether the map has a source. Without a source it has no values, and only its course has an effect."""
        return self.kind in ("STRAND", "CLUMP") or self.source != ""

    @property
    def without_source(self) -> "MapSettings":
        """The curve of the setting from root to tip alone."""
        return MapSettings(setting=self.setting, course=self.course)

    @property
    def combination(self) -> Combination:
        """The `Combination` of the map with its setting."""
        return Combination(self.low, self.high, self.is_inverted, self.amount)
