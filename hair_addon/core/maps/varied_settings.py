# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings that a map may vary, as declared with each setting."""

from functools import cache
from typing import Any

from ..dynamics.rod.settings import DynamicsSettings
from ..errors import HairError
from ..grooming.groom import GuideSettings, HairSettings
from ..params import Param, Settings, declared
from ..shading.appearance import COLOR_FIELDS, Appearance
from ..styling import courses, kinds
from ..styling.base import StyleSettings
from . import map_settings, ramp_text

# {first part of a setting's name: class of settings}
SECTIONS = {"look": Appearance, "strands": HairSettings, "guides": GuideSettings, "dynamics": DynamicsSettings}

_STYLES = "styles."  # first part of the names of settings of styles

# {setting: color parametrization that uses the setting}
_PARAMETRIZATION = {f"look.{name}": way for way, names in COLOR_FIELDS.items() for name in names}


@cache
def all_varied() -> dict[str, tuple[Any, Param]]:
    """Return {"section.setting": (default, its `Param`)} of all settings that may vary.

    A radius has the name of the diameter that panels show: "strands.thickness".
    """
    return {
        f"{section}.{details.diameter[0] if details.diameter else name}": (default, details)
        for section, settings_class in SECTIONS.items()
        for name, default, details in declared(settings_class)
        if details.may_vary
    }


def name_of(settings_class: type[Settings], name: str) -> str:
    """Return "section.setting" of a class's setting; "" if no map can vary it."""
    section = next((section for section, known in SECTIONS.items() if known is settings_class), "")
    details = next(details for its_name, _default, details in declared(settings_class) if its_name == name)
    found = f"{section}.{details.diameter[0] if details.diameter else name}"
    return found if found in all_varied() else ""


def style_of(setting: str) -> tuple[str, str]:
    """Return (name of a style, name of its setting) of a setting such as "styles.Curl.radius"; ("", "") for others."""
    if not setting.startswith(_STYLES):
        return "", ""
    name, _, found = setting.removeprefix(_STYLES).rpartition(".")
    return name, found


def setting_of_style(name: str, setting: str) -> str:
    """Return the name of a setting of a style, such as "styles.Curl.radius"."""
    return f"{_STYLES}{name}.{setting}"


def details_of_style(settings: StyleSettings, name: str) -> Param | None:
    """Return the `Param` of a style's setting; None if neither a map nor a curve can vary it."""
    known = ((its_name, details) for its_name, _default, details in declared(type(settings)))
    return next((d for its_name, d in known if its_name == name and (d.may_vary or d.has_course)), None)


@cache
def of_styles() -> tuple[str, ...]:
    """Return the names of the settings of styles that may vary, without the names of styles."""
    return tuple(dict.fromkeys(name for kind in kinds.KINDS for name in kinds.varied_settings_of(kind)))


@cache
def with_course() -> frozenset[str]:
    """Return the names of settings, without the names of styles, that may have a curve from root to tip."""
    return frozenset(name for kind in kinds.KINDS.values() for name in courses.settings_with_course(kind))


def require_course(setting: str) -> None:
    """Raise `HairError` unless a setting such as "styles.Curl.radius" may have a curve from root to tip."""
    name, of_style = style_of(setting)
    if not name or of_style not in with_course():
        known = ", ".join(setting_of_style("NAME", each) for each in sorted(with_course()))
        sentence = '"{setting}" cannot have a curve from root to tip: use one of {known}.'
        raise HairError(sentence, setting=setting, known=known)


def require_varied(setting: str) -> None:
    """Raise `HairError` unless a map may vary a setting such as "look.color" or "styles.Curl.radius"."""
    name, of_style = style_of(setting)
    if setting not in all_varied() and not (name and of_style in of_styles()):
        known = ", ".join([*all_varied(), *(setting_of_style("NAME", each) for each in of_styles())])
        raise HairError('No map can vary "{setting}": use one of {known}.', setting=setting, known=known)


def require_varied_or_course(setting: str) -> None:
    """Raise `HairError` unless a map may vary a setting, or a curve from root to tip may multiply it."""
    if style_of(setting)[1] not in with_course():
        require_varied(setting)


def require_map(settings: map_settings.MapSettings) -> None:
    """Raise `HairError` unless a map may vary its setting and has a ramp of the setting's kind.

    The setting of a map without a source may be one that only a curve from root to tip can multiply.
    """
    require_varied_or_course(settings.setting)
    if settings.course:
        require_course(settings.setting)
    if settings.has_source:
        require_varied(settings.setting)
    ramp = ramp_text.parsed(settings.ramp)
    if isinstance(ramp, ramp_text.Curve) and is_color(settings.setting):
        raise HairError('The map of "{setting}" needs a color ramp, not a curve.', setting=settings.setting)
    if isinstance(ramp, ramp_text.Colors) and not is_color(settings.setting):
        raise HairError('The map of "{setting}" needs a curve, not a color ramp.', setting=settings.setting)


def parsed_source(text: str) -> tuple[str, str]:
    """Return (kind, name) of a map's source such as "image:Coat", "group:dark" or "strand". Raises `HairError`."""
    kind, _, name = text.partition(":")
    known = {identifier.lower(): identifier for identifier, *_ in map_settings.KINDS}
    found = known.get(kind.strip().lower())
    if found is None or (found in (*map_settings.NAMED, "IMAGE") and not name):
        sources = "image:NAME, group:NAME, attribute:NAME, curves:NAME, strand or clump"
        raise HairError('"{source}" is not a map source: use {sources}.', source=text, sources=sources)
    return found, name


def is_color(setting: str) -> bool:
    """Return whether a setting is a color."""
    return setting in all_varied() and isinstance(all_varied()[setting][0], tuple)


def is_of_guides(setting: str) -> bool:
    """Return whether a setting belongs to guides."""
    return setting.startswith(("guides.", "dynamics."))


def is_used(setting: str, parametrization: str) -> bool:
    """Return whether a value of `Appearance.parametrization` uses a setting."""
    return _PARAMETRIZATION.get(setting, parametrization) == parametrization
