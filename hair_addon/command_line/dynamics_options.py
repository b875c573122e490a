# SPDX-License-Identifier: GPL-3.0-or-later
"""Options of dynamics: --dynamics bend_stiffness=20,hold=5 and --dynamics-preset WET.

All settings share one option: some names, such as gravity and size, are taken by other settings, and forty more options
would bury the rest of the help.
"""

import argparse
from dataclasses import replace

from ..core.dynamics.rod.presets import PRESETS, applied
from ..core.dynamics.rod.settings import DynamicsSettings
from ..core.errors import HairError
from ..core.params import declared
from . import setting_pairs


def add_dynamics(parser):
    """Add the options."""
    known = ", ".join(name for name, *_ in declared(DynamicsSettings))
    parser.add_argument(
        "--dynamics",
        metavar="SETTINGS",
        type=dynamics,
        action="append",
        default=[],
        help=f"settings of the simulation, as in bend_stiffness=20,hold=5; settings: {known}",
    )
    parser.add_argument(
        "--dynamics-preset", choices=PRESETS, metavar="NAME", help=f"a preset of the simulation: {', '.join(PRESETS)}"
    )


def dynamics(text):
    """Parse name=value,name=value as {name: value}."""
    changes = setting_pairs.parsed(text, DynamicsSettings, "dynamics")
    try:
        DynamicsSettings(**changes)
    except HairError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
    return changes


def changed(options, settings):
    """Return `DynamicsSettings` with the preset of the options applied, then their settings."""
    if options.dynamics_preset:
        settings = applied(settings, options.dynamics_preset)
    for changes in options.dynamics:
        settings = replace(settings, **changes)
    return settings
