# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings in a single command-line argument: name=value,name=value."""

import argparse

from ..core.params import declared

_FLAGS = {"true": True, "yes": True, "on": True, "1": True, "false": False, "no": False, "off": False, "0": False}


def parsed(text, settings_class, owner):
    """Parse name=value,name=value as {name: value}; owner: name for errors."""
    declarations = {name: (default, details) for name, default, details in declared(settings_class)}
    changes = {}
    for pair in text.split(",") if text else ():
        name, is_given, value = pair.partition("=")
        name = name.strip().replace("-", "_")
        if name not in declarations:
            known = ", ".join(declarations)
            raise argparse.ArgumentTypeError(f"{name!r} is not a setting of {owner}: choose from {known}")
        if name in changes or not is_given:
            wrong = "is given twice" if name in changes else "needs a value"
            raise argparse.ArgumentTypeError(f"{name} of {owner} {wrong}, as in {name}=0.01")
        changes[name] = _value(name, value.strip(), *declarations[name])
    return changes


def _value(name, text, default, details):
    """Convert text to the type of a setting's default; choices are case-insensitive."""
    if isinstance(default, bool):
        if text.lower() not in _FLAGS:
            raise argparse.ArgumentTypeError(f"{name} must be yes or no, not {text!r}")
        return _FLAGS[text.lower()]
    try:
        return text.upper() if details.choices else type(default)(text)
    except (ValueError, OverflowError) as error:
        kind = "whole number" if isinstance(default, int) else "number"
        raise argparse.ArgumentTypeError(f"{name} must be a {kind}, not {text!r}") from error
