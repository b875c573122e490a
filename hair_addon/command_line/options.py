# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings ↔ options of a command: their names, ranges and descriptions are those of the `Settings` classes."""

import argparse
import re
import sys
from dataclasses import replace

from ..core.files import settings_file
from ..core.imaging.pixel_sampling import FIRST_FRAME, LAST_FRAME
from ..core.params import is_text, label_of, plain_value, unit_of
from ..core.shading.appearance import shown_changes
from . import dynamics_options
from .console import PROGRAM

# Settings with shorter names on the command line.
_OPTIONS = {"guide_count": "--guides", "strand_count": "--strands", "eta": "--ior"}
_OPTIONS |= {"has_hair": "--strands", "has_guides": "--guides", "has_color": "--color"}
_OPTIONS |= {"card_count": "--cards", "tube_count": "--tubes", "picture_count": "--pictures"}

# Sections of a settings file with one option per setting.
_SECTIONS = [name for name in settings_file.SECTIONS if name != "dynamics"]


class Parser(argparse.ArgumentParser):
    """An argument parser that reports errors in one sentence."""

    def __init__(self, **details):
        super().__init__(allow_abbrev=False, **details)

    def parse_known_args(self, args=None, namespace=None):
        """Reject arguments that are not valid UTF-8, which Blender accepts neither as names nor as paths."""
        for word in args or ():
            if not is_text(word):
                self.error(f"{word!a} is not valid UTF-8")
        return super().parse_known_args(args, namespace)

    def print_help(self, file=None):
        """Write the help; unlike argparse's method this raises OSError if writing fails."""
        file = file or sys.stdout or sys.stderr
        file.write(self.format_help())
        file.flush()

    def error(self, message):
        """Print the message and exit with status 2."""
        self.exit(2, f"{PROGRAM}: {message.rstrip('.')}: see {self.prog} --help.\n")


def add_common(parser):
    """Add the options of all commands."""
    parser.add_argument("--json", action="store_true", help="print each result as a line of JSON on standard output")
    parser.add_argument("--quiet", action="store_true", help="print errors only")
    parser.add_argument("--verbose", action="store_true", help="show what Blender prints, on standard error")


def add_scripts(parser):
    """Add the option of commands that open a .blend file."""
    parser.add_argument(
        "--enable-scripts",
        action=argparse.BooleanOptionalAction,
        default=False,
        help="run the scripts and drivers of the .blend file",
    )


def add_settings_file(parser):
    """Add the option of commands with settings."""
    parser.add_argument("--settings", metavar="FILE", help="groom settings (JSON); options override it")


def add_settings(parser, declarations):
    """Add an option for each declared setting, each name once; options that are not given have no attribute."""
    for name, default, details in {setting[0]: setting for setting in declarations}.values():
        _add_setting(parser, name, default, details)


def add_groom_settings(parser):
    """Add --settings, an option for each setting of such a file, and those of dynamics."""
    add_settings_file(parser)
    add_settings(parser, [setting for section in _SECTIONS for setting in settings_file.declared_in(section)])
    dynamics_options.add_dynamics(parser)


def option_of(name):
    """Return the option that sets a field of settings."""
    return _OPTIONS.get(name, "--" + name.replace("_", "-"))


def options_given(options, declarations):
    """Sorted names of the options that were given for some declared settings."""
    return sorted({option_of(name) for name, *_ in declarations if hasattr(options, name)})


def _add_setting(parser, name, default, details):
    option = option_of(name)
    follows = details.typical is not None
    at_first = " [from the surface]" if follows else _in_words(default, unit_of(details))
    shown = f"{label_of(name, details)}: {details.description}{at_first}"
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
    """Return `Settings` with the declared fields that options override. Raises `HairError`, which names the option."""
    return replace(settings, **_given(options, declarations))


def _given(options, declarations):
    """Return {field: value} of the given options. Raises `HairError` for values out of range."""
    return {
        name: plain_value(option_of(name), getattr(options, name), default, details)
        for name, default, details in declarations
        if hasattr(options, name)
    }


def groom_settings(options):
    """Return the `GroomSettings` of --settings, or the defaults, with options applied. Raises `HairError`."""
    settings = settings_file.read(options.settings) if options.settings else settings_file.GroomSettings()
    return changed_groom(settings, options)


def changed_groom(settings, options):
    """Return `GroomSettings` with options applied. Raises `HairError`."""
    given = {name: _given(options, settings_file.declared_in(name)) for name in _SECTIONS}
    given["appearance"] = shown_changes(given["appearance"], option_of)
    sections = {name: replace(getattr(settings, name), **given[name]) for name in _SECTIONS}
    return replace(settings, **sections, dynamics=dynamics_options.changed(options, settings.dynamics))


def frame_range(text):
    """Parse A-B, or A, as a range of frames; returns "all" unchanged, for the scene's range."""
    if text == "all":
        return text
    match = re.fullmatch(r"(-?\d{1,7})(?:-(-?\d{1,7}))?", text)
    if match is None:
        raise argparse.ArgumentTypeError(f"{text!r} is not a frame, a range such as 1-24, or all")
    first, last = int(match[1]), int(match[2] or match[1])
    if not FIRST_FRAME <= min(first, last) <= max(first, last) <= LAST_FRAME:
        raise argparse.ArgumentTypeError(f"{text} is outside Blender's frame range, {FIRST_FRAME} to {LAST_FRAME}")
    if last < first:
        raise argparse.ArgumentTypeError(f"{text} is an empty range: the first frame is after the last")
    return range(first, last + 1)


def count(text):
    """Parse a whole number from 1 to 256."""
    if re.fullmatch(r"\d{1,3}", text) is None or not 1 <= int(text) <= 256:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from 1 to 256")
    return int(text)
