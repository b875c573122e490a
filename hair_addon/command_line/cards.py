# SPDX-License-Identifier: GPL-3.0-or-later
"""cards: hair of a .blend → cards with textures, for games."""

from ..core import lazy
from ..core.cards.card_settings import CardSettings
from ..core.long_work import run_now
from ..core.params import declared
from . import mesh_output, options

blender = lazy.Package("..blender", __package__)


def add(verbs):
    """Add the command's options."""
    parser = verbs.add_parser(
        "cards",
        help="make hair cards for games",
        description="Make ribbons that replace clumps of strands, with textures of the strands.",
    )
    mesh_output.add(parser)
    parser.add_argument(
        "--textures", metavar="FOLDER", help="folder of the textures [inside .blend and .glb, beside other files]"
    )
    options.add_settings(parser, declared(CardSettings))
    options.add_common(parser)
    parser.set_defaults(run=run)


def run(given, console):
    """Open the file, make the cards and write them."""
    settings = options.changed(CardSettings(), given, declared(CardSettings))
    mesh_output.make(given, console, lambda hair: _cards(given, console, hair, settings))


def _cards(given, console, hair, settings):
    """Make the cards; returns ([object], {name: count} of the finest level, notes)."""
    folder = given.textures
    # Exporters embed only the textures that the material uses.
    is_packed = settings.texture_layout != "SEPARATE"
    if folder is None and (is_packed or not blender.io.mesh_export.has_textures(given.out)):
        folder = given.out.parent
    levels = run_now(blender.io.hair_cards.making_cards(hair, settings, folder), console.progress)
    counts = {"cards": levels[0].card_count, "pictures": levels[0].picture_count, "levels": len(levels)}
    counts["triangles"] = [level.triangle_count for level in levels]
    if levels[0].error is not None:
        counts["errors"] = [
            {"coverage": round(level.error.coverage, 4), "flip": round(level.error.flip, 4)} for level in levels
        ]
    return [level.mesh_object for level in levels], counts, levels[0].notes
