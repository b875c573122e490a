# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of groom export."""

from dataclasses import dataclass

from ..params import Settings, param

OF_STRANDS = (".hair", ".data", ".ply", ".npz")  # formats with one frame, without the look
ENDINGS = (".abc", ".usd", ".usdc", ".usda", *OF_STRANDS)


@dataclass(frozen=True)
class ExportSettings(Settings):
    """Contents of a groom file for other programs."""

    has_hair: bool = param(True, "Write the strands; a file of guides alone can be a groom cache", label="Hair")
    has_guides: bool = param(True, "Write the guides, which engines simulate and move strands by", label="Guides")
    has_color: bool = param(True, "Write the color and roughness of each point of the strands", label="Color")
    animation: str = param(
        "NONE",
        "What moves in the file, with a sample for each frame of the scene",
        choices=(
            ("NONE", "Nothing", "Write the current frame"),
            ("GUIDES", "Guides", "Write guides in every frame and hair in the first"),
            ("ALL", "Guides and Hair", "Write guides and hair in every frame; files become large"),
        ),
    )
    level_count: int = param(
        1,
        "Levels of detail in USD files, as variants; each has half the strands of the previous one, twice as thick",
        label="Levels of detail",
        low=1,
        high=6,
    )
    looks: str = param(
        "",
        "Further looks in USD files, as variants: names of built-in or saved looks, separated by commas",
    )

    def moves(self, is_guide: bool) -> bool:
        """Return whether the file animates the guides, or the strands if not `is_guide`."""
        return self.animation == "ALL" or (self.animation == "GUIDES" and is_guide)
