# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of cards and tubes, and the resulting numbers of polygons."""

from dataclasses import dataclass

from ..errors import HairError
from ..params import Settings, param, param_of

MOST_TRIANGLES = 5_000_000  # of a mesh: with more triangles, Blender's own tools stall


@dataclass(frozen=True)
class Level:
    """A level of detail: number of cards, segments of each card, side of the textures [pixels]."""

    card_count: int
    segment_count: int
    texture_size: int

    @property
    def triangle_count(self) -> int:
        """Number of triangles of the level."""
        return 2 * self.card_count * self.segment_count

    @property
    def vertex_count(self) -> int:
        """Number of vertices of the level."""
        return 2 * self.card_count * (self.segment_count + 1)


@dataclass(frozen=True)
class CardSettings(Settings):
    """Settings of cards: ribbons that represent clumps of strands, with textures of the strands."""

    card_count: int = param(
        600, "Number of cards; more cards follow the hair more closely", label="Cards", low=1, high=50_000
    )
    segment_count: int = param(
        8, "Segments along each card; more of them follow bends more closely", label="Segments", low=1, high=64
    )
    level_count: int = param(
        1,
        "Levels of detail; each has half the cards, segments and texture size of the previous one",
        label="Levels",
        low=1,
        high=8,
    )
    picture_count: int = param(
        0,
        "Number of pictures in the textures; similar cards share one. Zero gives each card its own",
        label="Pictures",
        low=0,
        high=50_000,
    )
    crossed: float = param(
        0.0,
        "Part of the clumps that have a second card at a right angle to the first, thickest clumps first",
        label="Crossed Cards",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
    )
    flyaways: float = param(
        0.0,
        "Part of the cards that show one strand each, one of those that are farthest from the strands near them",
        label="Flyaways",
        low=0.0,
        high=0.9,
        subtype="FACTOR",
    )
    caps: float = param(
        0.0,
        "Part of the cards that lie on the surface and show the roots, so that less skin is visible",
        label="Caps",
        low=0.0,
        high=0.9,
        subtype="FACTOR",
    )
    error_measure: str = param(
        "OFF",
        "Comparison of the cards with the strands, from six sides and at three distances",
        label="Error Measure",
        choices=(
            ("OFF", "Not Measured", "The cards are not compared with the strands"),
            ("MEASURED", "Measured", "Report how much the pictures of cards and of strands differ"),
            ("MINIMIZED", "Minimized", "Try several placements of the same number of cards, and use the best"),
        ),
    )
    texture_size: int = param(
        2048, "Width and height of the textures in pixels; a power of two suits most engines", low=128, high=8192
    )
    texture_layout: str = param(
        "SEPARATE",
        "Textures for game engines, beside those of the material",
        label="Texture Layout",
        choices=(
            ("SEPARATE", "Separate", "One texture for each value"),
            ("UNREAL", "Unreal, Default", "Add five textures in Unreal's layout Card Default"),
            ("UNREAL_COMPACT", "Unreal, Compact", "Add three textures in Unreal's layout Card Compact"),
        ),
    )
    chain_count: int = param(
        0,
        "Chains of bones that swing the hair in game engines. Zero adds no bones: pieces follow the surface's armature",
        label="Bone Chains",
        low=0,
        high=1_000,
        soft_high=60,
    )
    bone_count: int = param(4, "Bones of each chain, from root to tip", label="Bones per Chain", low=1, high=16)

    def levels(self, strand_count: int) -> list[Level]:
        """Return the levels for a number of strands, finest first. Each card has at least one strand."""
        found = []
        for index in range(self.level_count):
            cards = max(min(self.card_count, strand_count) >> index, 1)
            size = max(self.texture_size >> index, 128)
            found.append(Level(cards, max(self.segment_count >> index, 1), size))
        return found

    def parts_of(self, card_count: int) -> tuple[int, int, int]:
        """Return the numbers of crossed cards, flyaways and caps among cards; at least one other card is left."""
        flyaways = min(int(self.flyaways * card_count), card_count - 1)
        caps = min(int(self.caps * card_count), card_count - 1 - flyaways)
        crossed = int((card_count - flyaways - caps) * self.crossed / (1.0 + self.crossed))
        return crossed, flyaways, caps

    def require_size(self, strand_count: int) -> None:
        """Raise `HairError` if a mesh would have too many triangles."""
        _require(self.levels(strand_count)[0].triangle_count)


@dataclass(frozen=True)
class TubeSettings(Settings):
    """Settings of tubes around strands."""

    tube_count: int = param(
        2000, "Number of strands to convert, evenly chosen; zero converts all", label="Tubes", low=0, soft_high=20_000
    )
    side_count: int = param(4, "Sides of each tube", label="Sides", low=3, high=32)
    point_count: int = param(12, "Points along each tube", label="Points", low=2, high=512)
    thickness: float = param(
        1.0, "Thickness of tubes as a multiple of the strands' thickness", above=0.0, soft_high=20.0
    )
    taper: float = param(
        0.0,
        "How much tubes become thinner toward the tip; 0 keeps the shape of the strands",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
    )
    chain_count: int = param_of(CardSettings, "chain_count")
    bone_count: int = param_of(CardSettings, "bone_count")

    def count_of(self, strand_count: int) -> int:
        """Return the number of tubes for a number of strands."""
        return min(self.tube_count or strand_count, strand_count)

    def vertex_count(self, strand_count: int) -> int:
        """Return the number of vertices of all tubes."""
        return self.count_of(strand_count) * self.side_count * self.point_count

    def triangle_count(self, strand_count: int) -> int:
        """Return the number of triangles of all tubes, ends included."""
        of_one = 2 * self.side_count * (self.point_count - 1) + 2 * (self.side_count - 2)
        return self.count_of(strand_count) * of_one

    def require_size(self, strand_count: int) -> None:
        """Raise `HairError` if the mesh would have too many triangles."""
        _require(self.triangle_count(strand_count))


def _require(triangle_count):
    if triangle_count > MOST_TRIANGLES:
        raise HairError(
            "{count} triangles exceed {most}: use fewer cards or tubes, or fewer points of each.",
            count=triangle_count,
            most=MOST_TRIANGLES,
        )
