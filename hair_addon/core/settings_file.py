# SPDX-License-Identifier: GPL-3.0-or-later
"""Groom settings as a file that people read and write: JSON, with a section for each stage.

What may stand in it follows from the `Settings` classes. What a file leaves out is at its default; what it names and
Vellus does not know is refused, for it would do nothing. Version 1 was a look alone, as looks are still saved.
"""

import contextlib
import json
import math
import os
import secrets
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path

from .errors import HairError
from .groom import GuideSettings, HairSettings
from .params import declared, label_of, like, unit_of
from .shading import lookup_tables
from .shading.appearance import TABLE_FIELDS, Appearance

FORMAT = "Vellus groom settings"
VERSION = 2

_LARGEST_FILE = 1_048_576  # bytes; all settings take some 2,000


@dataclass(frozen=True)
class GroomSettings:
    """All that a groom follows from, beside the surface it grows on."""

    guides: GuideSettings = field(default_factory=GuideSettings)
    hair: HairSettings = field(default_factory=HairSettings)
    appearance: Appearance = field(default_factory=Appearance)
    tables: lookup_tables.Settings = field(default_factory=lookup_tables.Settings)  # but for what the appearance says


SECTIONS = {section.name: section.default_factory for section in fields(GroomSettings)}


def declared_in(section):
    """[(name, default, Param)] of the settings that a section holds."""
    left_out = TABLE_FIELDS if section == "tables" else ()
    return [setting for setting in declared(SECTIONS[section]) if setting[0] not in left_out]


def write(path, settings):
    """Write `GroomSettings`; the file appears whole or not at all. Raises `HairError`."""
    write_object(path, to_object(settings))


def to_object(settings):
    """What `write` writes."""
    return {"format": FORMAT, "version": VERSION, **sections_of(settings)}


def sections_of(settings):
    """{section: {name: value}} of `GroomSettings`."""
    values = asdict(settings)
    return {section: {name: values[section][name] for name, *_ in declared_in(section)} for section in SECTIONS}


def read(path):
    """The `GroomSettings` of a file; what it leaves out is at its default. Raises `HairError`."""
    return from_object(read_object(path), path)


def from_object(found, path):
    """`GroomSettings` of what `read_object` read from a file. Raises `HairError`, which names the file."""
    sections = _migrated(found, path)
    unknown = next((name for name in sections if name not in SECTIONS), None)
    if unknown is not None:
        raise HairError('{path}: there is no section "{key}" of settings.', path=path, key=unknown)
    made = {}
    for name, settings_class in SECTIONS.items():
        values = sections.get(name, {})
        if not isinstance(values, dict):
            raise HairError('{path}: "{key}" holds no settings.', path=path, key=name)
        made[name] = to_settings(values, settings_class, path, f"{name}.", declared_in(name))
    return GroomSettings(**made)


def to_settings(values, settings_class, path, place="", allowed=None):
    """{name: value} as JSON gave it → `Settings`. Raises `HairError` that names file and key; place: what is before.

    allowed: those of the class' declarations that may be named, None for all.
    """
    declarations = {name: default for name, default, _details in allowed or declared(settings_class)}
    checked = {}
    for name, value in values.items():
        key = f"{place}{name}"
        if name not in declarations:
            raise HairError('{path}: there is no setting "{key}".', path=path, key=key)
        try:
            checked[name] = like(declarations[name], value)
            settings_class(**{name: checked[name]})
        except (TypeError, ValueError, OverflowError) as error:
            kind = _kind(declarations[name])
            raise HairError('{path}: "{key}" must be {kind}.', path=path, key=key, kind=kind) from error
        except HairError as error:
            raise HairError('{path}: "{key}" cannot be that: {reason}', path=path, key=key, reason=error) from error
    return settings_class(**checked)


def _kind(default):
    if isinstance(default, tuple):
        return f"a list of {len(default)} numbers"
    return {bool: "true or false", int: "a whole number", float: "a number", str: "a text in quotes"}[type(default)]


# Versions.


def _migrated(found, path):
    """The sections of a file of any version up to ours."""
    version = found.get("version")
    is_ours = found.get("format") == FORMAT or version == 1
    if not is_ours or type(version) is not int or version < 1:
        raise HairError("{path} is no file of groom settings.", path=path)
    if version > VERSION:
        sentence = "{path} comes from a newer Vellus: it is of version {version}, and this one reads up to {known}."
        raise HairError(sentence, path=path, version=version, known=VERSION)
    while version < VERSION:
        found = _MIGRATIONS[version](found)
        version += 1
    return {name: value for name, value in found.items() if name not in ("format", "version")}


def _sections_of_look(found):
    """Version 1, a look, has the settings of its appearance beside its version."""
    return {"appearance": {name: value for name, value in found.items() if name != "version"}}


_MIGRATIONS = {1: _sections_of_look}  # from each version to the next


# JSON.


def read_object(path):
    """The JSON object in a file, {name: value}. Raises `HairError`."""
    path = Path(path)
    try:
        if not path.is_file():
            raise HairError("{path} is not there, or is no file.", path=path)
        if path.stat().st_size > _LARGEST_FILE:
            raise HairError("{path} is too large to be a file of settings.", path=path)
        text = path.read_text(encoding="utf-8")
        found = json.loads(text, object_pairs_hook=_once, parse_constant=_refuse_constant)
    except OSError as error:
        raise HairError("{path} cannot be read: {cause}.", path=path, cause=error.strerror) from error
    except (ValueError, RecursionError) as error:
        raise HairError("{path} cannot be read: it is no JSON ({cause}).", path=path, cause=error) from error
    if not isinstance(found, dict):
        raise HairError("{path} is no file of groom settings.", path=path)
    return found


def _once(pairs):
    values = dict(pairs)
    if len(values) != len(pairs):
        raise ValueError("a name stands there twice")
    return values


def _refuse_constant(name):
    raise ValueError(f"{name} is no number")


def write_object(path, values):
    """Write {name: value} as JSON; the file appears whole or not at all. Raises `HairError`."""
    path = Path(path)
    partial = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial.write_text(text_of(values), encoding="utf-8")
        os.replace(partial, path)
    except (OSError, ValueError) as error:
        cause = getattr(error, "strerror", None) or error
        raise HairError("{path} cannot be written: {cause}.", path=path, cause=cause) from error
    finally:
        with contextlib.suppress(OSError, ValueError):  # it has moved to its place, or was never made
            partial.unlink()


def text_of(values):
    """JSON for people: a line for each setting."""
    return json.dumps(values, indent=2) + "\n"


# What editors check a file by.


def schema():
    """The JSON Schema (draft 2020-12) of files that `read` takes."""
    sections = {
        name: {
            "type": "object",
            "additionalProperties": False,
            "properties": {setting[0]: _property(*setting) for setting in declared_in(name)},
        }
        for name in SECTIONS
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": FORMAT,
        "type": "object",
        "required": ["format", "version"],
        "additionalProperties": False,
        "properties": {"format": {"const": FORMAT}, "version": {"const": VERSION}, **sections},
    }


def _property(name, default, details):
    unit = unit_of(details)
    description = f"{details.description} [{unit}]" if unit else details.description
    described = {"title": label_of(name, details), "description": description, "default": default}
    if isinstance(default, tuple):
        count = len(default)
        numbers = {"type": "array", "items": _number("number", details), "minItems": count, "maxItems": count}
        return described | numbers | {"default": list(default)}
    if isinstance(default, str):
        choices = [choice[0] for choice in details.choices]
        return described | {"type": "string"} | ({"enum": choices} if choices else {})
    if isinstance(default, bool):
        return described | {"type": "boolean"}
    return described | _number("integer" if isinstance(default, int) else "number", details)


def _number(kind, details):
    limits = {"minimum": details.low, "exclusiveMinimum": details.above, "maximum": details.high}
    return {"type": kind} | {name: limit for name, limit in limits.items() if math.isfinite(limit)}
