# SPDX-License-Identifier: GPL-3.0-or-later
"""Named styles: partial settings files in presets/. Lengths are for the hair of a human head.

Settings that a preset omits are unchanged.
"""

from pathlib import Path
from typing import Any

from ..errors import HairError
from ..styling.fitting import fitted, fitted_value
from . import settings_file
from .settings_file import GroomSettings, PartialSettings

FOLDER = Path(__file__).resolve().parents[2] / "presets"

# {identifier: label} in the order of the menu; the file of FUR_SHORT is fur_short.json.
PRESETS = {
    "STRAIGHT": "Straight",
    "SLEEK": "Sleek",
    "WAVY": "Wavy",
    "CURLY": "Curly",
    "COILY": "Coily",
    "FRIZZY": "Frizzy",
    "WET": "Wet",
    "PIXIE": "Pixie",
    "BUZZ": "Buzz Cut",
    "BEARD": "Beard",
    "FUR_SHORT": "Short Fur",
    "FUR_LONG": "Long Fur",
    "BRAIDS": "Braids",
}

# Hair settings that a saved preset stores beside its styles.
_OF_HAIR = ("point_count", "tip_taper")


def read(identifier: str) -> PartialSettings:
    """Return the preset of an identifier. Raises `HairError`."""
    if identifier not in PRESETS:
        sentence = 'No style preset "{name}": choose from {known}.'
        raise HairError(sentence, name=identifier, known=", ".join(PRESETS))
    return settings_file.read_partial(FOLDER / f"{identifier.lower()}.json")


def fit(preset: PartialSettings, factor: float, strand_spacing: float) -> PartialSettings:
    """Return a preset with its lengths multiplied by a factor; strand_spacing [m]: see `fitting.fitted`."""
    values = {}
    for section, found in preset.values.items():
        details = {name: declared for name, _default, declared in settings_file.declared_in(section)}
        values[section] = {name: fitted_value(value, details[name], factor) for name, value in found.items()}
    styles = preset.styles
    if styles is not None:
        styles = tuple(fitted(style, factor, strand_spacing) for style in styles)
    return PartialSettings(values, styles, preset.style_names)


def to_object(settings: GroomSettings) -> dict[str, Any]:
    """Return the styles of `GroomSettings`, and the hair settings of `_OF_HAIR`, as the JSON object of a preset."""
    found = settings_file.to_object(settings)
    hair_values = {name: value for name, value in found["hair"].items() if name in _OF_HAIR}
    return {"format": found["format"], "version": found["version"], "hair": hair_values, "styles": found["styles"]}
