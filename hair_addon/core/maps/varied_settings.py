# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings that a map may vary, as declared with each setting."""

from functools import cache
from typing import Any

from ..errors import HairError
from ..grooming.groom import GuideSettings, HairSettings
from ..params import Param, Settings, declared
from ..shading.appearance import COLOR_FIELDS, Appearance
from . import map_settings, ramp_text

# {first part of a setting's name: class of settings}
SECTIONS = {"look": Appearance, "strands": HairSettings, "guides": GuideSettings}

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


def require_varied(setting: str) -> None:
    """Raise `HairError` unless a map may vary a setting such as "look.color"."""
    if setting not in all_varied():
        known = ", ".join(all_varied())
        raise HairError('No map can vary "{setting}": use one of {known}.', setting=setting, known=known)


def require_map(settings: map_settings.MapSettings) -> None:
    """Raise `HairError` unless a map may vary its setting and has a ramp of the setting's kind."""
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
    return isinstance(all_varied()[setting][0], tuple)


def is_of_guides(setting: str) -> bool:
    """Return whether a setting belongs to guides."""
    return setting.startswith("guides.")


def is_used(setting: str, parametrization: str) -> bool:
    """Return whether a value of `Appearance.parametrization` uses a setting."""
    return _PARAMETRIZATION.get(setting, parametrization) == parametrization
