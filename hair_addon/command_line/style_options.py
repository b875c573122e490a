# SPDX-License-Identifier: GPL-3.0-or-later
"""Options of styles: --style curl:radius=0.004,pitch=0.01, again for more, and --style-preset CURLY."""

import argparse
from dataclasses import replace

from ..core.errors import HairError
from ..core.files import style_presets
from ..core.styling.fitting import fitted
from ..core.styling.kinds import KINDS, MOST_STYLES, OFFERS
from . import setting_pairs


def add_styles(parser, has_surface):
    """Add the options; has_surface: whether the command has a surface to fit presets to."""
    offers, presets = ", ".join(map(str.lower, OFFERS)), ", ".join(style_presets.PRESETS)
    fitting = "; lengths that are not given are fitted to the surface" if has_surface else ""
    parser.add_argument(
        "--style",
        dest="styles",
        metavar="STYLE",
        type=style,
        action="append",
        default=[],
        help=f"a style with settings, as in curl:radius=0.004,pitch=0.01; again for more, in order: {offers}{fitting}",
    )
    lengths = ", fitted to the surface" if has_surface else ", with lengths for a head"
    parser.add_argument(
        "--style-preset", choices=style_presets.PRESETS, metavar="NAME", help=f"a style preset{lengths}: {presets}"
    )
    if has_surface:
        parser.add_argument("--no-style-fit", action="store_true", help="use the lengths for a head unchanged")


def style(text):
    """Parse KIND:name=value,name=value as (label, `StyleSettings`, names of the settings that are given)."""
    kind, _, rest = text.partition(":")
    identifier = kind.strip().upper().replace("-", "_")
    if identifier not in OFFERS:
        known = ", ".join(map(str.lower, OFFERS))
        raise argparse.ArgumentTypeError(f"{kind!r} is not a style: choose from {known}")
    offer = OFFERS[identifier]
    changes = setting_pairs.parsed(rest, KINDS[offer.kind], kind)
    try:
        return offer.label, replace(offer.settings, **changes), tuple(changes)
    except HairError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def styled(options, settings, fit=None):
    """Return `GroomSettings` with the preset of the options applied, then their styles. Raises `HairError`.

    fit(): returns (factor of lengths, mean distance of strands [m]); None keeps the lengths for a head.
    """
    size = fit() if fit is not None and (options.style_preset or options.styles) else None
    if options.style_preset:
        preset = style_presets.read(options.style_preset)
        if size is not None:
            preset = style_presets.fit(preset, *size)
        settings = preset.changed(settings)
    if len(settings.styles) + len(options.styles) > MOST_STYLES:
        raise HairError(f"Hair has at most {MOST_STYLES} styles: give fewer --style options.")
    styles, names = list(settings.styles), list(settings.style_names or [""] * len(settings.styles))
    for label, found, given in options.styles:
        if size is not None:
            found = fitted(found, *size, kept=given)
        taken = {other.seed for other in styles}
        seed = found.seed if "seed" in given else next(n for n in range(len(taken) + 1) if n not in taken)
        styles.append(replace(found, seed=seed))
        names.append(label)
    return replace(settings, styles=tuple(styles), style_names=tuple(names))
