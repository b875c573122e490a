# SPDX-License-Identifier: GPL-3.0-or-later
"""Groom settings as a human-readable JSON file, with a section for each stage.

Its keys are the fields of the `Settings` classes; styles are a list in the order of application. Omitted settings have
their defaults, or are computed from the surface; unknown keys are errors, because they would have no effect.
"""

import json
import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from ..dynamics.rod.settings import DynamicsSettings
from ..errors import HairError
from ..grooming.groom import GuideSettings, HairSettings
from ..maps import ramp_text, varied_settings
from ..maps.map_settings import MapSettings
from ..params import Param, Settings, declared, described, given, is_text, label_of, like, require_class, unit_of
from ..shading.appearance import TABLE_FIELDS, Appearance
from ..shading.tables import lookup_tables
from ..styling.base import StyleSettings
from ..styling.kinds import KINDS, LABELS, MOST_STYLES, kind_of
from .atomic_file import atomic_file

S = TypeVar("S", bound=Settings)

FORMAT = "Vellus groom settings"
VERSION = 1

_LARGEST_FILE = 1_048_576  # bytes; all settings take some 2,000


@dataclass(frozen=True)
class GroomSettings:
    """All settings of a groom, apart from its surface."""

    guides: GuideSettings = field(default_factory=GuideSettings)
    hair: HairSettings = field(default_factory=HairSettings)
    appearance: Appearance = field(default_factory=Appearance)
    tables: lookup_tables.Settings = field(default_factory=lookup_tables.Settings)  # without settings of the appearance
    styles: tuple[StyleSettings, ...] = ()  # in the order of application; a list is converted to a tuple
    style_names: tuple[str, ...] = ()  # one for each style, "" for unnamed; empty if no style has a name
    dynamics: DynamicsSettings = field(default_factory=DynamicsSettings)
    maps: tuple[MapSettings, ...] = ()  # at most one for each setting; a list is converted to a tuple
    thickness_curve: str = ""  # from root to tip, in the format of `ramp_text`; empty: linear to the tip's thickness

    def __post_init__(self) -> None:
        for name, settings_class in SECTIONS.items():
            require_class(getattr(self, name), settings_class, name)
        styles, names = require_styles(self.styles, self.style_names)
        object.__setattr__(self, "styles", styles)  # the class is frozen
        object.__setattr__(self, "style_names", names)
        object.__setattr__(self, "maps", _require_maps(self.maps))
        if not isinstance(self.thickness_curve, str):
            raise HairError(f"thickness_curve must be text, not {described(self.thickness_curve)}.")
        ramp_text.require_curve(self.thickness_curve)


def _require_maps(maps):
    """Return maps as a tuple. Raises `HairError`."""
    if not isinstance(maps, list | tuple):
        raise HairError(f"maps must be a list of maps, not {described(maps)}.")
    for one in maps:
        require_class(one, MapSettings, "maps")
        varied_settings.require_map(one)
    if len({one.setting for one in maps}) < len(maps):
        raise HairError("maps must have at most one map for each setting.")
    return tuple(maps)


def require_styles(styles: object, names: object = ()) -> tuple[tuple[StyleSettings, ...], tuple[str, ...]]:
    """Return styles and their names as tuples; names are () if all are empty. Raises `HairError`."""
    if not isinstance(styles, list | tuple):
        raise HairError(f"styles must be a list of styles, not {described(styles)}.")
    if len(styles) > MOST_STYLES:
        raise HairError(f"Hair has at most {MOST_STYLES} styles, not {len(styles)}.")
    for style in styles:
        kind_of(style)
    if not isinstance(names, list | tuple) or not all(isinstance(name, str) and is_text(name) for name in names):
        raise HairError("style_names must be a list of strings.")
    if not any(names):
        return tuple(styles), ()
    if len(names) != len(styles):
        raise HairError(f"style_names needs {len(styles)} names, not {len(names)}.")
    return tuple(styles), tuple(map(str, names))


# Sections with a single `Settings` class.
SECTIONS: dict[str, type[Settings]] = {
    name: found
    for name, found in get_type_hints(GroomSettings).items()
    if not name.startswith("style") and name not in ("maps", "thickness_curve")
}


def declared_in(section: str) -> list[tuple[str, Any, Param]]:
    """Return [(name, default, Param)] of the settings in a section."""
    left_out = TABLE_FIELDS if section == "tables" else ()
    return [setting for setting in declared(SECTIONS[section]) if setting[0] not in left_out]


def write(path: str | Path, settings: GroomSettings) -> None:
    """Write `GroomSettings` atomically. Raises `HairError`."""
    write_object(path, to_object(settings))


def to_object(settings: GroomSettings) -> dict[str, Any]:
    """Return `GroomSettings` as the JSON object of a file."""
    lists = {"styles": list_of_styles(settings), "maps": list_of_maps(settings)}
    curves = {"thickness_curve": settings.thickness_curve} if settings.thickness_curve else {}
    return {"format": FORMAT, "version": VERSION, **sections_of(settings), **lists, **curves}


def list_of_maps(settings: GroomSettings) -> list[dict[str, Any]]:
    """Return [{name: value}] of the maps of `GroomSettings`."""
    return [{_MAP_KEYS.get(name, name): value for name, value in given(one).items()} for one in settings.maps]


_MAP_KEYS = {"source": "name", "low": "from", "high": "to"}  # fields of `MapSettings`: keys in files


def sections_of(settings: GroomSettings) -> dict[str, dict[str, Any]]:
    """Return {section: {name: value}} of `GroomSettings`, without values to be computed from the surface."""
    values = {section: given(getattr(settings, section)) for section in SECTIONS}
    return {
        section: {name: values[section][name] for name, *_ in declared_in(section) if name in values[section]}
        for section in SECTIONS
    }


def list_of_styles(settings: GroomSettings) -> list[dict[str, Any]]:
    """Return [{name: value}] of the styles of `GroomSettings`, each with its kind, and its name if it has one."""
    names = settings.style_names or [""] * len(settings.styles)
    return [
        {"kind": kind_of(style), **({"name": name} if name else {}), **given(style)}
        for name, style in zip(names, settings.styles, strict=True)
    ]


@dataclass(frozen=True)
class PartialSettings:
    """Some of the settings of a groom; omitted settings are unchanged."""

    values: dict[str, dict[str, Any]]  # {section: {name: value}}
    styles: tuple[StyleSettings, ...] | None = None  # None: unchanged
    style_names: tuple[str, ...] = ()
    maps: tuple[MapSettings, ...] | None = None  # None: unchanged
    thickness_curve: str | None = None  # None: unchanged

    def changed(self, settings: GroomSettings) -> GroomSettings:
        """Return `GroomSettings` with these settings applied."""
        sections = {name: replace(getattr(settings, name), **values) for name, values in self.values.items()}
        settings = replace(settings, **sections)
        settings = settings if self.maps is None else replace(settings, maps=self.maps)
        if self.thickness_curve is not None:
            settings = replace(settings, thickness_curve=self.thickness_curve)
        return settings if self.styles is None else self._styled(settings, self.styles)

    def _styled(self, settings, styles):
        return replace(settings, styles=styles, style_names=self.style_names)


def read(path: str | Path) -> GroomSettings:
    """Return the `GroomSettings` in a file; omitted settings have their defaults. Raises `HairError`."""
    return from_object(read_object(path), path)


def from_object(found: dict[str, Any], path: str | Path) -> GroomSettings:
    """Return the result of `read_object` as `GroomSettings`. Raises `HairError`, which names the file."""
    return partial_of_object(found, path).changed(GroomSettings())


def read_partial(path: str | Path) -> PartialSettings:
    """Return only the settings that a file contains. Raises `HairError`."""
    return partial_of_object(read_object(path), path)


def partial_of_object(found: dict[str, Any], path: str | Path) -> PartialSettings:
    """Return the result of `read_object` as `PartialSettings`. Raises `HairError`, which names the file."""
    sections = _sections(found, path)
    styles, names = None, ()
    if "styles" in sections:
        styles, names = _styles(sections.pop("styles"), path)
    maps = _maps(sections.pop("maps"), path) if "maps" in sections else None
    curve = _curve(sections.pop("thickness_curve"), path) if "thickness_curve" in sections else None
    result = {}
    for name, values in sections.items():
        if name not in SECTIONS:
            raise HairError('{path}: unknown section "{key}".', path=path, key=name)
        if not isinstance(values, dict):
            raise HairError('{path}: "{key}" must be a group of settings.', path=path, key=name)
        settings = to_settings(values, SECTIONS[name], path, f"{name}.", declared_in(name))
        result[name] = {setting: getattr(settings, setting) for setting in values}
    return PartialSettings(result, styles, names, maps, curve)


def _maps(found, path):
    """Return the maps of a file's list."""
    if not isinstance(found, list):
        raise HairError('{path}: "maps" must be a list of maps.', path=path)
    fields = {key: name for name, key in _MAP_KEYS.items()}
    read = []
    for place, values in enumerate(found):
        if not isinstance(values, dict):
            raise HairError('{path}: "{key}" must be a group of settings.', path=path, key=f"maps[{place}]")
        unknown = [key for key in values if key in _MAP_KEYS]
        if unknown:
            raise HairError('{path}: unknown setting "{key}".', path=path, key=f"maps[{place}].{unknown[0]}")
        renamed = {fields.get(key, key): value for key, value in values.items()}
        read.append(to_settings(renamed, MapSettings, path, f"maps[{place}]."))
    return _require_maps(read)


def _curve(found, path):
    """Return the text of a file's curve."""
    if not isinstance(found, str):
        raise HairError('{path}: "{key}" must be {kind}.', path=path, key="thickness_curve", kind="a string")
    try:
        ramp_text.require_curve(found)
    except HairError as error:
        sentence = '{path}: invalid value for "{key}": {reason}'
        raise HairError(sentence, path=path, key="thickness_curve", reason=error) from error
    return found


def _styles(found, path):
    """Return (styles, their names) of a file's list."""
    if not isinstance(found, list):
        raise HairError('{path}: "styles" must be a list of styles.', path=path)
    if len(found) > MOST_STYLES:
        sentence = '{path}: "styles" has {count} styles: hair has at most {most}.'
        raise HairError(sentence, path=path, count=len(found), most=MOST_STYLES)
    read = [_style(values, path, f"styles[{place}]") for place, values in enumerate(found)]
    names = tuple(name for name, _style in read)
    return tuple(style for _name, style in read), names if any(names) else ()


def _style(values, path, place):
    """Return (name, `StyleSettings`) of a style's object."""
    if not isinstance(values, dict):
        raise HairError('{path}: "{key}" must be a group of settings.', path=path, key=place)
    values = dict(values)
    kind, name = values.pop("kind", None), values.pop("name", "")
    if not isinstance(kind, str) or kind not in KINDS:
        known = ", ".join(KINDS)
        raise HairError('{path}: "{key}" must be one of {known}.', path=path, key=f"{place}.kind", known=known)
    if not isinstance(name, str) or not is_text(name):
        raise HairError('{path}: "{key}" must be {kind}.', path=path, key=f"{place}.name", kind="a string")
    return name, to_settings(values, KINDS[kind], path, f"{place}.")


def to_settings(
    values: dict[str, Any],
    settings_class: type[S],
    path: str | Path,
    place: str = "",
    allowed: list[tuple[str, Any, Param]] | None = None,
) -> S:
    """Return a JSON object as `Settings`. Raises `HairError`, which names the file and the key.

    place: prefix of the key in errors; allowed: the accepted declarations of the class, None for all.
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


def _sections(found, path):
    """Return the sections of a file of this version. Raises `HairError`."""
    version = found.get("version")
    if found.get("format") != FORMAT or type(version) is not int or version < 1:
        raise HairError("{path} is not a groom settings file.", path=path)
    if version > VERSION:
        sentence = (
            "{path} was saved by a newer Vellus: its version is {version}, and this Vellus reads up to version {known}."
        )
        raise HairError(sentence, path=path, version=version, known=VERSION)
    return {name: value for name, value in found.items() if name not in ("format", "version")}


# JSON.


def read_object(path: str | Path) -> dict[str, Any]:
    """Return the JSON object {name: value} of a file. Raises `HairError`."""
    path = Path(path)
    try:
        if not path.is_file():
            raise HairError("{path} does not exist or is not a file.", path=path)
        if path.stat().st_size > _LARGEST_FILE:
            raise HairError("{path} is too large for a settings file.", path=path)
        return object_of_text(path.read_text(encoding="utf-8"), path)
    except OSError as error:
        raise HairError("{path} cannot be read: {cause}.", path=path, cause=error.strerror) from error
    except UnicodeDecodeError as error:
        raise HairError("{path} cannot be read: invalid JSON ({cause}).", path=path, cause=error) from error


def object_of_text(text: str, path: str | Path) -> dict[str, Any]:
    """Return the JSON object {name: value} of a text; path: for error messages. Raises `HairError`."""
    try:
        found = json.loads(text, object_pairs_hook=_once, parse_constant=_refuse_constant)
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
    """Write {name: value} as JSON, atomically. Raises `HairError`."""
    with atomic_file(path) as partial:
        partial.write_text(text_of(values), encoding="utf-8")


def text_of(values: dict[str, Any]) -> str:
    """Return formatted JSON with a line for each setting."""
    return json.dumps(values, indent=2) + "\n"


# For validation in editors.


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of files for `read`."""
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
        "properties": {
            "format": {"const": FORMAT},
            "version": {"const": VERSION},
            **sections,
            "styles": _style_schema(),
            "maps": _map_schema(),
            "thickness_curve": {
                "title": "Thickness curve from root to tip, such as 0:1 0.5:0.3 1:0.2",
                "type": "string",
            },
        },
    }


def _map_schema():
    keys = {_MAP_KEYS.get(setting[0], setting[0]): _property(*setting) for setting in declared(MapSettings)}
    of_styles = sorted({*varied_settings.of_styles(), *varied_settings.with_course()})
    names = "|".join(of_styles)
    known = {"enum": list(varied_settings.all_varied())}, {"pattern": rf"^styles\..+\.({names})$"}
    keys["setting"] |= {"anyOf": list(known)}
    item = {"type": "object", "required": ["setting"], "additionalProperties": False, "properties": keys}
    return {"title": "Maps, at most one for each setting", "type": "array"} | {
        "minItems": 0,
        "maxItems": len(varied_settings.all_varied()) + MOST_STYLES * len(of_styles),
        "items": item,
    }


def _style_schema():
    kinds = [
        {
            "title": LABELS[kind],
            "type": "object",
            "required": ["kind"],
            "additionalProperties": False,
            "properties": {
                "kind": {"const": kind},
                "name": {"type": "string", "title": "Name"},
                **{setting[0]: _property(*setting) for setting in declared(settings_class)},
            },
        }
        for kind, settings_class in KINDS.items()
    ]
    return {"title": "Styles, in the order of their application", "type": "array"} | {
        "minItems": 0,
        "maxItems": MOST_STYLES,
        "items": {"anyOf": kinds},
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
