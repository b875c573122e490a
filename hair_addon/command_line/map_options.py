# SPDX-License-Identifier: GPL-3.0-or-later
"""Option of maps: --map look.color=image:coat.png, again for other settings."""

import argparse
from dataclasses import replace
from pathlib import Path

from ..core import lazy
from ..core.errors import HairError
from ..core.maps import varied_settings
from ..core.maps.map_settings import MapSettings
from . import setting_pairs

blender = lazy.Package("..blender", __package__)


def add_maps(parser):
    """Add the option."""
    known = ", ".join(varied_settings.all_varied())
    parser.add_argument(
        "--map",
        dest="maps",
        metavar="SETTING=SOURCE",
        type=parsed_map,
        action="append",
        default=[],
        help="vary a setting by image:FILE or image:NAME, group:NAME, attribute:NAME, curves:NAME, strand or clump, "
        f"with fields after a comma, as in look.melanin=group:dark,low=0.5; settings: {known}",
    )


def parsed_map(text):
    """Parse SETTING=SOURCE,name=value as `MapSettings`."""
    setting, is_given, rest = text.partition("=")
    source, _, fields = rest.partition(",")
    if not is_given:
        raise argparse.ArgumentTypeError(f"{text!r} needs a source, as in look.color=image:coat.png")
    changes = setting_pairs.parsed(fields, MapSettings, "a map")
    try:
        varied_settings.require_varied(setting.strip())
        kind, name = varied_settings.parsed_source(source.strip())
        return MapSettings(**{"setting": setting.strip(), "kind": kind, "source": name} | changes)
    except HairError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def mapped(given, settings):
    """Return `GroomSettings` with the maps of options; images are loaded from files. Raises `HairError`."""
    maps = {one.setting: one for one in (*settings.maps, *map(_loaded, given.maps))}
    return replace(settings, maps=tuple(maps.values()))


def _loaded(one):
    if one.kind != "IMAGE" or not Path(one.source).is_file():
        return one
    return replace(one, source=blender.data.maps.image_pixels.load(one.source))
