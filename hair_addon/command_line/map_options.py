# SPDX-License-Identifier: GPL-3.0-or-later
"""Options of maps, such as --map look.color=image:coat.png, and of curves from root to tip."""

import argparse
from dataclasses import replace
from pathlib import Path

from ..core import lazy
from ..core.errors import HairError
from ..core.maps import ramp_text, varied_settings
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
        "with fields after a comma, as in look.melanin=group:dark,low=0.5 or "
        f"'look.color=strand,ramp=0:0.1/0.05/0 1:1/0.8/0.5'; settings: {known}, "
        "and settings of styles by their names, such as styles.Curl.radius",
    )
    parser.add_argument(
        "--course",
        dest="courses",
        metavar="SETTING=POINTS",
        type=_parsed_course,
        action="append",
        default=[],
        help="multiply a number of a style by a curve from root to tip, as in 'styles.Curl.radius=0:0 0.3:1 1:0.4'",
    )
    parser.add_argument(
        "--thickness-curve",
        metavar="POINTS",
        type=_parsed_curve,
        help="thickness from root to tip, as in '0:1 0.8:0.9 1:0.1'",
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
        settings = MapSettings(**{"setting": setting.strip(), "kind": kind, "source": name} | changes)
        varied_settings.require_map(settings)
        return settings
    except HairError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def _parsed_curve(text):
    """Return the text of a curve if it is valid."""
    try:
        ramp_text.require_curve(text)
    except HairError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
    return text


def _parsed_course(text):
    """Parse SETTING=POINTS as (setting, text of a curve)."""
    setting, is_given, points = text.partition("=")
    if not is_given or not points.strip():
        raise argparse.ArgumentTypeError(f"{text!r} needs a curve, as in 'styles.Curl.radius=0:0 0.3:1 1:0.4'")
    try:
        varied_settings.require_course(setting.strip())
    except HairError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
    return setting.strip(), _parsed_curve(points)


def mapped(given, settings):
    """Return `GroomSettings` with the maps and the curves of options; images are loaded. Raises `HairError`.

    A map from an option keeps the curve from root to tip of the map that it replaces.
    """
    maps = {one.setting: one for one in settings.maps}
    for one in map(_loaded, given.maps):
        before = maps.get(one.setting, one)
        maps[one.setting] = replace(one, course=one.course or before.course)
    for setting, course in given.courses:
        maps[setting] = replace(maps.get(setting, MapSettings(setting=setting)), course=course)
    curve = settings.thickness_curve if given.thickness_curve is None else given.thickness_curve
    return replace(settings, maps=tuple(maps.values()), thickness_curve=curve)


def without_effect(given, hair):
    """Return the settings with a map or a curve whose styles hair Curves do not have."""
    items = blender.settings.style_items
    styles = dict(zip(items.names_of(hair.vellus), items.styles_of(hair.vellus), strict=True))
    found = []
    every = [*given.maps, *blender.settings.map_items.maps_of(hair.vellus)]
    for setting in dict.fromkeys([*(one.setting for one in every), *(setting for setting, _ in given.courses)]):
        name, of_style = varied_settings.style_of(setting)
        if name and (name not in styles or varied_settings.details_of_style(styles[name], of_style) is None):
            found.append(setting)
    return found


def _loaded(one):
    if one.kind != "IMAGE" or not Path(one.source).is_file():
        return one
    return replace(one, source=blender.data.maps.image_pixels.load(one.source))
