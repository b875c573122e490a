# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings ↔ options of a command: their names, ranges and descriptions are those of the `Settings` classes."""

import argparse
import re
from dataclasses import replace
from pathlib import Path

from ..core import settings_file
from ..core.params import label_of, unit_of
from .console import PROGRAM

# Settings that a shorter word names better on a command line.
_OPTIONS = {"guide_count": "--guides", "strand_count": "--strands", "eta": "--ior"}


class Parser(argparse.ArgumentParser):
    """What is not understood is told in one sentence."""

    def __init__(self, **details):
        super().__init__(allow_abbrev=False, **details)

    def error(self, message):
        """End with status 2."""
        self.exit(2, f"{PROGRAM}: {message.rstrip('.')}: see {self.prog} --help.\n")


def add_common(parser):
    """What every verb takes."""
    parser.add_argument("--json", action="store_true", help="one line of JSON on standard output for each result")
    parser.add_argument("--quiet", action="store_true", help="no progress, no warnings, no sentences about results")
    parser.add_argument("--verbose", action="store_true", help="show what Blender prints, on standard error")


def add_scripts(parser):
    """For verbs that open a .blend."""
    parser.add_argument("--enable-scripts", action="store_true", help="let a .blend run scripts and drivers of its own")


def add_settings_file(parser):
    """For verbs that take settings."""
    parser.add_argument("--settings", type=Path, metavar="FILE", help="groom settings (JSON); options come before it")


def add_settings(parser, declarations):
    """An option for each declared setting, each name once; one that is not given leaves no trace."""
    for name, default, details in {setting[0]: setting for setting in declarations}.values():
        _add_setting(parser, name, default, details)


def add_groom_settings(parser):
    """--settings, and an option for each setting that such a file may hold."""
    add_settings_file(parser)
    add_settings(
        parser, [setting for section in settings_file.SECTIONS for setting in settings_file.declared_in(section)]
    )


def _add_setting(parser, name, default, details):
    option = _OPTIONS.get(name, "--" + name.replace("_", "-"))
    shown = f"{label_of(name, details)}: {details.description}{_in_words(default, unit_of(details))}"
    described = {"dest": name, "default": argparse.SUPPRESS, "help": shown.replace("%", "%%")}
    if isinstance(default, bool):
        parser.add_argument(option, action=argparse.BooleanOptionalAction, **described)
    elif isinstance(default, tuple):
        parser.add_argument(option, type=float, nargs=len(default), metavar="X", **described)
    elif details.choices:
        parser.add_argument(option, choices=[choice[0] for choice in details.choices], **described)
    else:
        parser.add_argument(option, type=type(default), metavar="TEXT" if default == "" else "N", **described)


def _in_words(default, unit):
    parts = default if isinstance(default, tuple) else (default,)
    words = [*(f"{part:g}" if isinstance(part, float) else str(part) for part in parts), unit]
    return f" [{' '.join(filter(None, words))}]" if any(words) else ""


def changed(settings, options, declarations):
    """`Settings` with those of the declared fields changed that options name. Raises `HairError`."""
    given = {name: getattr(options, name) for name, *_ in declarations if hasattr(options, name)}
    return replace(settings, **{name: tuple(v) if isinstance(v, list) else v for name, v in given.items()})


def groom_settings(options):
    """The `GroomSettings` of --settings, or the defaults, with what single options change. Raises `HairError`."""
    settings = settings_file.read(options.settings) if options.settings else settings_file.GroomSettings()
    return changed_groom(settings, options)


def changed_groom(settings, options):
    """`GroomSettings` with what single options change. Raises `HairError`."""
    sections = {
        name: changed(getattr(settings, name), options, settings_file.declared_in(name))
        for name in settings_file.SECTIONS
    }
    return replace(settings, **sections)


def frame_range(text):
    """A-B, or A alone, as a range of frames; "all" for the scene's."""
    if text == "all":
        return text
    match = re.fullmatch(r"(-?\d{1,7})(?:-(-?\d{1,7}))?", text)
    if match is None:
        raise argparse.ArgumentTypeError(f"{text!r} is no range of frames such as 1-24, nor a frame, nor all")
    first, last = int(match[1]), int(match[2] or match[1])
    if last < first:
        raise argparse.ArgumentTypeError(f"{text} holds no frame: the first is after the last")
    return range(first, last + 1)


def count(text):
    """A whole number from 1 to 256."""
    if re.fullmatch(r"\d{1,3}", text) is None or not 1 <= int(text) <= 256:
        raise argparse.ArgumentTypeError(f"{text!r} is no whole number from 1 to 256")
    return int(text)
