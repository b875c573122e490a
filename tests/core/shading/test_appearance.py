# SPDX-License-Identifier: GPL-3.0-or-later
"""One set of settings and named looks serve all models."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hair_addon.core.errors import HairError
from hair_addon.core.params import declared
from hair_addon.core.shading import appearance, presets
from hair_addon.core.shading.appearance import Appearance
from hair_addon.core.shading.fibre import kajiya_kay, strand_variation
from hair_addon.core.shading.tables import albedo, lookup_tables

# Of a freshly made Principled Hair BSDF.
SOCKETS = {
    "Roughness": 0.3,
    "Radial Roughness": 0.3,
    "Coat": 0.0,
    "IOR": 1.55,
    "Offset": np.radians(2.0),
    "Random Roughness": 0.0,
}

appearances = st.builds(
    Appearance,
    **{
        name: st.sampled_from([choice[0] for choice in details.choices])
        if details.choices
        else st.tuples(*[st.floats(details.low, min(details.high, 50.0))] * 3)
        if isinstance(default, tuple)
        else st.floats(details.low, details.high)
        for name, default, details in declared(Appearance)
    },
)


def test_defaults_are_those_of_principled_hair():
    sockets = appearance.principled_sockets(Appearance())
    assert {name: sockets[name] for name in SOCKETS} == pytest.approx(SOCKETS)


@given(appearances)
def test_every_appearance_is_one_that_every_model_takes(look):
    appearance.kajiya_kay_settings(look)
    strands = appearance.strand_settings(look)
    assert appearance.table_settings(look).sigma_a == appearance.sigma_a(look)
    least, greatest = strand_variation.absorption_range(strands)
    assert 0.0 <= least <= greatest < np.inf


def test_what_artists_do_not_set_stays_as_it_was():
    base = lookup_tables.Settings(size=32, axes="COSINES", glint_gain=3.0, shifts="PUBLISHED", caustic="exact")
    found = appearance.table_settings(Appearance(mode="classic"), base)
    assert (found.size, found.axes, found.glint_gain) == (32, "COSINES", 3.0)
    assert (found.shifts, found.caustic, found.mode) == ("PUBLISHED", "exact", "classic")


def test_each_setting_of_the_tables_is_the_artist_s_or_the_baker_s():
    """Settings that the appearance decides override those of any base, and no others do."""
    bases = lookup_tables.Settings(), lookup_tables.Settings(
        mode="energy", eta=1.2, sigma_a=(3.0, 2.0, 1.0), tilt=0.01, shifts="PUBLISHED", roughness=0.7,
        radial_roughness=0.6, coat=0.5, beta_r=0.3, caustic="exact", glint_gain=3.0, glint_width=0.1, glint_fade=0.2,
        glint_limit=0.1, eccentricity=0.9, size=32, axes="COSINES",
    )  # fmt: skip
    found = [appearance.table_settings(Appearance(), base) for base in bases]
    for name, *_ in declared(lookup_tables.Settings):
        assert getattr(bases[0], name) != getattr(bases[1], name)
        is_decided = getattr(found[0], name) == getattr(found[1], name)
        assert is_decided == (name in appearance.TABLE_FIELDS), name


def test_the_same_hair_may_be_described_in_three_ways():
    by_melanin = Appearance(melanin=0.4, redness=0.3)
    sigma_a = appearance.sigma_a(by_melanin)
    by_absorption = replace(by_melanin, parametrization="ABSORPTION", absorption=sigma_a)
    color = appearance.kajiya_kay_settings(by_melanin).diffuse_color
    by_color = replace(by_melanin, parametrization="COLOR", color=color)
    for other in (by_absorption, by_color):
        np.testing.assert_allclose(appearance.sigma_a(other), sigma_a, rtol=1e-6)


def test_a_white_dye_is_none_and_another_only_darkens():
    plain, dyed = Appearance(melanin=0.1), Appearance(melanin=0.1, tint=(1.0, 0.5, 0.2))
    np.testing.assert_allclose(appearance.sigma_a(plain), strand_variation.strand_sigma_a(
        appearance.strand_settings(plain), 0.5, 1.0))  # fmt: skip
    added = np.subtract(appearance.sigma_a(dyed), appearance.sigma_a(plain))
    assert added[0] == 0.0 < added[1] < added[2]


def test_roughness_means_one_width_in_both_modes():
    """Roughness means one width in both modes, as Marschner's Gaussian is of theta_h, half of theta_i + theta_o."""
    settings = appearance.table_settings(Appearance(roughness=0.2))
    assert np.degrees(settings.beta_r) == pytest.approx(5.09, abs=0.01)


@pytest.mark.parametrize("roughness", [0.15, 0.3, 0.5])
def test_kajiya_kay_s_highlight_has_the_energy_of_the_first_reflection(roughness):
    look = Appearance(roughness=roughness, parametrization="ABSORPTION", absorption=(1000.0, 1000.0, 1000.0))
    reflected = albedo.mean_albedo(
        lookup_tables.bake(appearance.table_settings(look, lookup_tables.Settings(size=128)))
    )
    settings = appearance.kajiya_kay_settings(look)
    highlight = kajiya_kay.kajiya_kay_specular_albedo(settings.exponent) * np.array(settings.specular_color)
    np.testing.assert_allclose(highlight, reflected, rtol=0.02)


@pytest.mark.parametrize(
    "wrong",
    [
        {"melanin": 1.5},
        {"roughness": -0.1},
        {"radial_roughness": np.nan},
        {"ior": 1.0},
        {"absorption": (-1.0, 0.0, 0.0)},
        {"color": (0.5, 0.5)},
        {"tip_absorption": -1.0},
        {"parametrization": "PAINT"},
    ],
)
def test_impossible_looks_are_refused(wrong):
    with pytest.raises(HairError):
        Appearance(**wrong)


# Presets


def color_of(name, **changes):
    """Return the color, RGB, of a groom with a look."""
    look = replace(presets.PRESETS[name][1], **changes)
    return np.array(appearance.kajiya_kay_settings(look).diffuse_color)


def test_natural_hair_darkens_in_the_order_of_its_names():
    names = ["WHITE", "PLATINUM", "BLOND", "DARK_BLOND", "LIGHT_BROWN", "BROWN", "DARK_BROWN", "BLACK"]
    luminances = [color_of(name) @ [0.2126, 0.7152, 0.0722] for name in names]
    assert (np.diff(luminances) < 0.0).all()


@pytest.mark.parametrize("name", ["AUBURN", "GINGER"])
def test_red_hair_is_redder_than_as_much_brown(name):
    red, green, _blue = color_of(name) / color_of(name, redness=0.25)
    assert red > 1.1 * green


def test_dyed_hair_has_the_colour_of_its_dye():
    red, green, blue = color_of("DYED_BLUE")
    assert blue > 2.0 * green > 2.0 * red
    pink = strand_variation.strand_sigma_a(appearance.strand_settings(presets.PRESETS["DYED_PINK"][1]), 0.5, 1.0)
    assert pink[0] < pink[2] < pink[1]


def test_wet_hair_differs_in_its_optics_and_not_in_its_pigment():
    for name in ("BLACK", "BROWN", "BLOND"):
        dry, wet = presets.PRESETS[name][1], presets.PRESETS[f"WET_{name}"][1]
        assert appearance.sigma_a(wet) == appearance.sigma_a(dry)
        assert wet.roughness < dry.roughness and wet.ior < dry.ior


NATURAL = ("BLACK", "BROWN", "BLOND")
STEPS = np.linspace(0.0, 1.0, 5)


@given(appearances)
def test_dry_is_dry_and_soaked_is_soaked_to_the_bit(look):
    dry = replace(look, wetness=0.0)
    assert appearance.wetted(look, 0.0) == dry
    assert appearance.table_settings(dry) == appearance.table_settings(appearance.wetted(look, 0.0))
    soaked = appearance.wetted(look, 1.0)
    assert (soaked.roughness, soaked.coat, soaked.cuticle_angle, soaked.ior) == (0.14, dry.coat, np.radians(0.5), 1.38)
    # Of a look that is wet itself.
    wet = replace(look, wetness=1.0)
    for made in (
        appearance.table_settings,
        appearance.kajiya_kay_settings,
        appearance.kajiya_kay_strand_settings,
        appearance.principled_sockets,
        appearance.strand_settings,
    ):
        assert made(wet) == made(soaked), made.__name__


@pytest.mark.parametrize("name", NATURAL)
def test_wet_presets_are_soaked_hair(name):
    assert presets.PRESETS[f"WET_{name}"][1] == appearance.wetted(presets.PRESETS[name][1], 1.0)


@pytest.mark.parametrize("name", NATURAL)
def test_hair_darkens_with_each_step_of_wetness(name):
    """Hair darkens with each step of wetness, by all scattered and all reflected light and by R's share for
    Kajiya-Kay.
    """
    looks = [appearance.wetted(presets.PRESETS[name][1], wetness) for wetness in STEPS]
    small = lookup_tables.Settings(size=32)
    tables = [lookup_tables.bake(appearance.table_settings(look, small)) for look in looks]
    total = np.array([albedo.mean_albedo(table) for table in tables])
    back = total - [albedo.mean_forward(table) for table in tables]
    assert (np.diff(total, axis=0) < 0.0).all() and (np.diff(back, axis=0) < 0.0).all()
    assert (back[-1] < 0.85 * back[0]).all()
    reflected = [appearance.kajiya_kay_strand_settings(look).reflectance for look in looks]
    assert (np.diff(reflected) < 0.0).all()


@pytest.mark.parametrize("name", (*NATURAL, "WHITE"))
def test_the_flat_colour_of_wet_hair_is_darker_as_its_fibres_say(name):
    """The color is that of a deep layer of fibers with the absorption and reflection of the Marschner tables."""
    looks = [replace(presets.PRESETS[name][1], wetness=wetness) for wetness in STEPS]
    colors = np.array([appearance.mean_color(look) for look in looks])
    assert (np.diff(colors, axis=0) < 0.0).all()
    np.testing.assert_array_equal(colors[-1], appearance.mean_color(appearance.wetted(looks[0], 1.0)))
    layers = []
    for look in (looks[0], looks[-1]):
        table = lookup_tables.bake(appearance.table_settings(look, lookup_tables.Settings(size=32)))
        total = albedo.mean_albedo(table)
        k_by_s = (1.0 - total) / (total - albedo.mean_forward(table))
        layers.append(1.0 + k_by_s - np.sqrt(k_by_s**2 + 2.0 * k_by_s))
    np.testing.assert_allclose(colors[-1] / colors[0], layers[1] / layers[0], rtol=0.1)


@pytest.mark.parametrize("name", NATURAL)
def test_highlights_narrow_with_each_step_of_wetness(name):
    looks = [appearance.wetted(presets.PRESETS[name][1], wetness) for wetness in STEPS]
    assert (np.diff([appearance.kajiya_kay_settings(look).exponent for look in looks]) > 0.0).all()


# From strand to strand and from root to tip


def strands_of(**details):
    return appearance.strand_settings(Appearance(**details))


def test_even_hair_says_so():
    assert strands_of().is_even
    for varied in ({"random_color": 0.1}, {"tip_absorption": 0.9}, {"tip_tint": (1.0, 0.9, 1.0)}):
        assert not strands_of(**varied).is_even


@given(st.floats(0.05, 0.9), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_random_strands_are_hair_of_other_melanin(melanin, spread, random):
    """Melanin varies as in Cycles: its amount is multiplied by 1 + 2 (random - ½) spread."""
    found = strand_variation.strand_sigma_a(strands_of(melanin=melanin, random_color=spread), random, 0.0)
    other = min(melanin * (1.0 + 2.0 * (random - 0.5) * spread), 1.0)
    np.testing.assert_allclose(found, appearance.sigma_a(Appearance(melanin=other)), rtol=1e-9, atol=1e-12)


@given(st.floats(0.0, 1.0))
def test_tips_begin_and_end_where_they_are_told(position):
    strands = strands_of(tip_absorption=0.25, gradient_start=0.4, gradient_end=0.6, melanin=0.5)
    part = strand_variation.strand_sigma_a(strands, 0.5, position) / np.array(
        appearance.sigma_a(Appearance(melanin=0.5))
    )
    assert (part <= 1.0 + 1e-12).all() and (part >= 0.25 - 1e-12).all()
    if position <= 0.4:
        np.testing.assert_allclose(part, 1.0)
    if position >= 0.6:
        np.testing.assert_allclose(part, 0.25)


@given(appearances, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_the_range_holds_every_strand(look, random, position):
    strands = appearance.strand_settings(look)
    least, greatest = strand_variation.absorption_range(strands)
    sigma_a = strand_variation.strand_sigma_a(strands, random, position)
    assert least * (1.0 - 1e-9) <= sigma_a.min() and sigma_a.max() <= greatest * (1.0 + 1e-9)


def test_grey_hair_is_grey_and_of_white_and_dark_strands():
    look = presets.PRESETS["GREY"][1]
    color = appearance.mean_color(look)
    assert color.max() < 1.1 * color.min()
    strands = appearance.strand_settings(look)
    sigma_a = strand_variation.strand_sigma_a(strands, np.array([0.0, 1.0]), 0.0)
    white, dark = np.exp(-5.5 * np.sqrt(sigma_a)).mean(axis=1)
    assert white > 0.9 and dark < 0.02


def color_at(name, position):
    strands = appearance.strand_settings(presets.PRESETS[name][1])
    return np.exp(-5.5 * np.sqrt(strand_variation.strand_sigma_a(strands, 0.5, position)))


def test_sun_bleached_hair_is_lighter_at_its_tips():
    assert (color_at("SUN_BLEACHED", 1.0) > 2.0 * color_at("SUN_BLEACHED", 0.0)).all()


def test_pink_tips_are_pink_and_their_roots_blond():
    red, green, blue = color_at("DYED_PINK", 1.0)
    assert red > 2.0 * blue > 2.0 * green
    red, green, blue = color_at("DYED_PINK", 0.0)
    assert red > green > blue


def test_the_mean_colour_of_even_hair_is_that_of_each_strand():
    look = Appearance(melanin=0.4, redness=0.2)
    np.testing.assert_allclose(appearance.mean_color(look), appearance.kajiya_kay_settings(look).diffuse_color)
