# SPDX-License-Identifier: GPL-3.0-or-later
"""Groom settings as a human-readable JSON file, with a section for each stage.

Its keys are the fields of the `Settings` classes. Omitted settings have their defaults, or are computed from the
surface; unknown keys are errors, as they would have no effect. Version 1 was a single look, the format of saved looks.
"""

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_type_hints

from ..errors import HairError
from ..grooming.groom import GuideSettings, HairSettings
from ..params import Param, Settings, declared, given, label_of, like, require_class, unit_of
from ..shading.appearance import TABLE_FIELDS, Appearance
from ..shading.tables import lookup_tables
from .whole_file import whole_file

FORMAT = "Vellus groom settings"
VERSION = 2

_LARGEST_FILE = 1_048_576  # bytes; all settings take some 2,000


@dataclass(frozen=True)
class GroomSettings:
    """All settings of a groom, apart from its surface."""

    guides: GuideSettings = field(default_factory=GuideSettings)
    hair: HairSettings = field(default_factory=HairSettings)
    appearance: Appearance = field(default_factory=Appearance)
    tables: lookup_tables.Settings = field(default_factory=lookup_tables.Settings)  # except those in the appearance

    def __post_init__(self) -> None:
        for name, settings_class in SECTIONS.items():
            require_class(getattr(self, name), settings_class, name)


SECTIONS: dict[str, type[Settings]] = get_type_hints(GroomSettings)


def declared_in(section: str) -> list[tuple[str, Any, Param]]:
    """[(name, default, Param)] of the settings that a section holds."""
    left_out = TABLE_FIELDS if section == "tables" else ()
    return [setting for setting in declared(SECTIONS[section]) if setting[0] not in left_out]


def write(path: str | Path, settings: GroomSettings) -> None:
    """Write `GroomSettings`; the file appears whole or not at all. Raises `HairError`."""
    write_object(path, to_object(settings))


def to_object(settings: GroomSettings) -> dict[str, Any]:
    """Convert `GroomSettings` to the object that `write` writes."""
    return {"format": FORMAT, "version": VERSION, **sections_of(settings)}


def sections_of(settings: GroomSettings) -> dict[str, dict[str, Any]]:
    """{section: {name: value}} of `GroomSettings`, without those that follow from the surface."""
    values = {section: given(getattr(settings, section)) for section in SECTIONS}
    return {
        section: {name: values[section][name] for name, *_ in declared_in(section) if name in values[section]}
        for section in SECTIONS
    }


def read(path: str | Path) -> GroomSettings:
    """Read `GroomSettings` from a file; omitted settings have their defaults. Raises `HairError`."""
    return from_object(read_object(path), path)


def from_object(found: dict[str, Any], path: str | Path) -> GroomSettings:
    """Convert the result of `read_object` to `GroomSettings`. Raises `HairError`, which names the file."""
    sections = _migrated(found, path)
    unknown = next((name for name in sections if name not in SECTIONS), None)
    if unknown is not None:
        raise HairError('{path}: unknown section "{key}".', path=path, key=unknown)
    made: dict[str, Any] = {}
    for name, settings_class in SECTIONS.items():
        values = sections.get(name, {})
        if not isinstance(values, dict):
            raise HairError('{path}: "{key}" must be a group of settings.', path=path, key=name)
        made[name] = to_settings(values, settings_class, path, f"{name}.", declared_in(name))
    return GroomSettings(**made)


def to_settings[S: Settings](
    values: dict[str, Any],
    settings_class: type[S],
    path: str | Path,
    place: str = "",
    allowed: list[tuple[str, Any, Param]] | None = None,
) -> S:
    """{name: value} as JSON gave it → `Settings`. Raises `HairError` that names file and key; place: what is before.

    allowed: those of the class' declarations that may be named, None for all.
    """
    declarations = {name: default for name, default, _details in allowed or declared(settings_class)}
    checked = {}
    for name, value in values.items():
        key = f"{place}{name}"
        if name not in declarations:
            raise HairError('{path}: unknown setting "{key}".', path=path, key=key)
        try:
            checked[name] = like(declarations[name], value)
            settings_class(**{name: checked[name]})
        except (TypeError, ValueError, OverflowError) as error:
            kind = _kind(declarations[name])
            raise HairError('{path}: "{key}" must be {kind}.', path=path, key=key, kind=kind) from error
        except HairError as error:
            raise HairError('{path}: invalid value for "{key}": {reason}', path=path, key=key, reason=error) from error
    return settings_class(**checked)


def _kind(default):
    if isinstance(default, tuple):
        return f"a list of {len(default)} numbers"
    return {bool: "true or false", int: "a whole number", float: "a number", str: "a string"}[type(default)]


# Versions.


def _migrated(found, path):
    """The sections of a file of any version up to ours."""
    version = found.get("version")
    is_ours = found.get("format") == FORMAT or version == 1
    if not is_ours or type(version) is not int or version < 1:
        raise HairError("{path} is not a groom settings file.", path=path)
    if version > VERSION:
        sentence = (
            "{path} was saved by a newer Vellus: its version is {version}, and this Vellus reads up to version {known}."
        )
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


def read_object(path: str | Path) -> dict[str, Any]:
    """The JSON object in a file, {name: value}. Raises `HairError`."""
    path = Path(path)
    try:
        if not path.is_file():
            raise HairError("{path} does not exist or is not a file.", path=path)
        if path.stat().st_size > _LARGEST_FILE:
            raise HairError("{path} is too large for a settings file.", path=path)
        text = path.read_text(encoding="utf-8")
        found = json.loads(text, object_pairs_hook=_once, parse_constant=_refuse_constant)
    except OSError as error:
        raise HairError("{path} cannot be read: {cause}.", path=path, cause=error.strerror) from error
    except (ValueError, RecursionError) as error:
        raise HairError("{path} cannot be read: invalid JSON ({cause}).", path=path, cause=error) from error
    if not isinstance(found, dict):
        raise HairError("{path} is not a groom settings file.", path=path)
    return found


def _once(pairs):
    values = dict(pairs)
    if len(values) != len(pairs):
        raise ValueError("duplicate key")
    return values


def _refuse_constant(name):
    raise ValueError(f"{name} is not a number")


def write_object(path: str | Path, values: dict[str, Any]) -> None:
    """Write {name: value} as JSON; the file appears whole or not at all. Raises `HairError`."""
    with whole_file(path) as partial:
        partial.write_text(text_of(values), encoding="utf-8")


def text_of(values: dict[str, Any]) -> str:
    """Format JSON with a line for each setting."""
    return json.dumps(values, indent=2) + "\n"


# For validation in editors.


def schema() -> dict[str, Any]:
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
    if details.typical is not None:
        del described["default"]
        described["description"] += ". Computed from the surface if omitted"
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
