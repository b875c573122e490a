# SPDX-License-Identifier: GPL-3.0-or-later
"""settings: write groom settings, or the JSON Schema of such files."""

from ..core.files import settings_file
from . import options, style_options


def add(verbs):
    """Add the command's options."""
    parser = verbs.add_parser("settings", help="write groom settings: defaults and the given options")
    parser.add_argument("--out", metavar="FILE", help=".json file [printed]")
    parser.add_argument("--schema", action="store_true", help="write the JSON Schema of settings files instead")
    style_options.add_styles(parser, has_surface=False)
    options.add_groom_settings(parser)
    options.add_common(parser)
    parser.set_defaults(run=run)


def run(given, console):
    """Write or print the settings or their schema."""
    if given.schema:
        values = settings_file.schema()
    else:
        settings = style_options.styled(given, options.groom_settings(given))
        values = settings_file.to_object(options.changed_groom(settings, given))
    if given.out is None:
        console.result(values, settings_file.text_of(values).rstrip())
        return
    settings_file.write_object(given.out, values)
    console.result({"verb": "settings", "out": str(given.out)}, f"Settings written to {given.out}")
