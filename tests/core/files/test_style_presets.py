# SPDX-License-Identifier: GPL-3.0-or-later
"""Each style preset has its file, stores only necessary settings, and fits surfaces of any size."""

import json

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.files import settings_file, style_presets
from hair_addon.core.files.settings_file import GroomSettings
from hair_addon.core.grooming.groom import HairSettings
from hair_addon.core.params import declared
from hair_addon.core.styling import base, clump, curl
from hair_addon.core.styling.kinds import LABELS, kind_of
from tests.support.dynamics.stepped import stepped


def lengths(preset):
    """Return {location: value} of all lengths in a preset."""
    found = {
        (place, name): getattr(style, name)
        for place, style in enumerate(preset.styles)
        for name, _default, details in declared(type(style))
        if details.unit == "LENGTH"
    }
    for section, values in preset.values.items():
        units = {name: details.unit for name, _default, details in settings_file.declared_in(section)}
        found |= {(section, name): value for name, value in values.items() if units[name] == "LENGTH"}
    return found


def test_each_preset_has_its_file_and_each_file_its_preset():
    assert sorted(path.stem.upper() for path in style_presets.FOLDER.glob("*.json")) == sorted(style_presets.PRESETS)
    assert sorted(path.stem.upper() for path in style_presets.FOLDER.glob("*.png")) == sorted(style_presets.PRESETS)
    assert len(style_presets.PRESETS) >= 12


@pytest.mark.parametrize("identifier", style_presets.PRESETS)
def test_presets_can_be_read_and_do_something(identifier):
    preset = style_presets.read(identifier)
    assert set(preset.values) <= {"hair"}
    assert preset.styles
    assert all(base.has_effect(style) for style in preset.styles)
    seeds = [style.seed for style in preset.styles]
    assert len(set(seeds)) == len(seeds)
    # All of them say what another would leave behind.
    assert {"point_count", "tip_taper"} <= set(preset.values["hair"])


@pytest.mark.parametrize("identifier", style_presets.PRESETS)
def test_wet_belongs_last_and_guides_lean_first(identifier):
    kinds = [kind_of(style) for style in style_presets.read(identifier).styles]
    assert "WET" not in kinds[:-1]
    assert "LEAN" not in kinds[1:]


def test_sleek_hair_stays_above_the_scalp():
    """Strands that lie around the crown of a head, 2.5 mm above its skin, are not smoothed into the skin."""
    radius, arc = 0.1, np.linspace(0.0, 0.15, 41)  # [m]
    height = radius + 0.0025 * np.minimum(arc / 0.01, 1.0)
    strand = np.stack([height * np.sin(arc / radius), 0.0 * arc, height * np.cos(arc / radius)], axis=1)
    settings = next(style for style in style_presets.read("SLEEK").styles if kind_of(style) == "SMOOTH")
    made = stepped(strand[None].astype(np.float32), settings)
    assert np.linalg.norm(made, axis=2).min() > radius - 1e-6


@pytest.mark.parametrize("identifier", style_presets.PRESETS)
def test_curls_have_the_points_they_want(identifier):
    preset = style_presets.read(identifier)
    length = 0.12  # of new hair on a head
    for style in preset.styles:
        if isinstance(style, curl.Settings):
            assert preset.values["hair"]["point_count"] >= curl.points_wanted(style, length)


@pytest.mark.parametrize("identifier", style_presets.PRESETS)
@pytest.mark.parametrize("factor", [0.05, 1.0, 8.0])
def test_all_lengths_fit_and_nothing_else_changes(identifier, factor):
    preset = style_presets.read(identifier)
    fit = style_presets.fit(preset, factor, 0.0)
    before, after = lengths(preset), lengths(fit)
    highest = {name: details.high for style in fit.styles for name, _default, details in declared(type(style))}
    assert {place: min(factor * value, highest.get(place[1], value * factor)) for place, value in before.items()} == {
        place: pytest.approx(value, rel=5e-3) for place, value in after.items()
    }
    assert style_presets.fit(preset, 1.0, 0.0) == preset
    for style, fitted in zip(preset.styles, fit.styles, strict=True):
        for name, _default, details in declared(type(style)):
            assert details.unit == "LENGTH" or getattr(style, name) == getattr(fitted, name)


def test_locks_have_strands_enough():
    preset = settings_file.PartialSettings({}, (clump.Settings(size=0.01), curl.Settings()))
    fit = style_presets.fit(preset, 1.0, 0.005)
    assert fit.styles == (clump.Settings(size=0.02), curl.Settings())
    assert style_presets.fit(preset, 1.0, 0.001) == preset


def test_a_saved_preset_comes_back_and_leaves_the_rest_alone(tmp_path):
    styles = (clump.Settings(size=0.02), curl.Settings(radius=0.004))
    hair = HairSettings(tip_taper=0.9, strand_count=7, radius=0.1)
    wanted = GroomSettings(hair=hair, styles=styles, style_names=("Locks", "Curl"))
    settings_file.write_object(tmp_path / "mine.json", style_presets.to_object(wanted))
    present = GroomSettings(hair=HairSettings(strand_count=99))
    changed = settings_file.read_partial(tmp_path / "mine.json").changed(present)
    assert (changed.styles, changed.style_names) == (styles, ("Locks", "Curl"))
    assert changed.hair == HairSettings(strand_count=99, tip_taper=0.9)


def test_an_unknown_preset_is_one_sentence():
    with pytest.raises(HairError, match='No style preset "PERM": choose from STRAIGHT, SLEEK'):
        style_presets.read("PERM")


@pytest.mark.parametrize("identifier", style_presets.PRESETS)
def test_presets_name_only_what_departs_from_defaults(identifier):
    """Presets name only settings that differ from the defaults, so that improved defaults reach them."""
    found = json.loads((style_presets.FOLDER / f"{identifier.lower()}.json").read_text(encoding="utf-8"))
    for values, style in zip(found["styles"], style_presets.read(identifier).styles, strict=True):
        defaults = type(style)()
        same = [
            name for name in values if name not in ("kind", "name", "seed") and values[name] == getattr(defaults, name)
        ]
        assert not set(same) - {"amount", "wavelength", "tip", "undercoat_length", "coherence"}, same
        assert values["kind"] in LABELS
