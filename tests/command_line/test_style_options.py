# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors of styles on the command line are one message, before anything is read."""

import argparse
import json
import re

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.command_line import style_options
from hair_addon.core.files import settings_file, style_presets
from hair_addon.core.files.settings_file import GroomSettings
from hair_addon.core.params import declared
from hair_addon.core.styling import clump, curl, frizz, lean, trim, wet
from hair_addon.core.styling.kinds import OFFERS
from tests.command_line.test_command_line import SMALL, grown, mesh  # noqa: F401 (a fixture)
from tests.support.commands import HEAD, load, run_here


def words(identifier, settings, names):
    """Return a style as the value of an option."""
    return f"{identifier.lower()}:" + ",".join(f"{name}={getattr(settings, name)}" for name in names)


@pytest.mark.parametrize("identifier", OFFERS)
def test_any_style_can_be_given(identifier):
    offer = OFFERS[identifier]
    assert style_options.style(identifier.lower()) == (offer.label, offer.settings, ())
    names = [name for name, *_ in declared(type(offer.settings))]
    assert style_options.style(words(identifier, offer.settings, names)) == (offer.label, offer.settings, tuple(names))


@pytest.mark.parametrize(
    ("text", "reported"),
    [
        ("", "'' is not a style: choose from trim, clump"),
        ("perm", "'perm' is not a style"),
        ("curl:radios=1", "'radios' is not a setting of curl: choose from is_on"),
        ("curl:radius", "radius of curl needs a value"),
        ("curl:radius=1,radius=2", "radius of curl is given twice"),
        ("curl:radius=", "radius must be a number, not ''"),
        ("curl:radius=-1", "Radius must be between 0 and 1000, not -1."),
        ("curl:radius=nan", "Radius must be between"),
        ("curl:radius=0.1,", "'' is not a setting of curl"),
        ("clump:levels=1.5", "levels must be a whole number, not '1.5'"),
        ("curl:is_on=maybe", "is_on must be yes or no, not 'maybe'"),
        ("trim:method=burn", "Method must be one of CUT, SCALE, not 'BURN'."),
    ],
)
def test_what_is_wrong_is_one_sentence(text, reported):
    with pytest.raises(argparse.ArgumentTypeError, match=re.escape(reported)):
        style_options.style(text)


@pytest.mark.parametrize(
    ("options", "reported"),
    [
        (("--style", "perm"), "argument --style: 'perm' is not a style"),
        (("--style-preset", "PERM"), "argument --style-preset: invalid choice: 'PERM'"),
    ],
)
def test_a_command_ends_with_the_sentence(options, reported, tmp_path, capfd):
    assert run_here("groom", "missing.obj", "--out", tmp_path / "a.npz", *options).status == 2
    errors = capfd.readouterr().err
    assert reported in errors and len(errors.splitlines()) == 1


def test_a_preset_that_is_not_given_cannot_be_fitted(tmp_path):
    ended = run_here("settings", "--style-preset", "CURLY", "--out", tmp_path / "a.json")
    assert ended.status == 0
    too_many = [word for _ in range(65) for word in ("--style", "curl")]
    ended = run_here("settings", *too_many)
    assert ended.status == 1 and "at most 64 styles" in ended.errors


def test_styles_are_applied_in_the_order_of_the_words(scene, mesh, tmp_path):  # noqa: F811
    out = tmp_path / "out.blend"
    groom = ("groom", mesh, *SMALL, "--out", out, "--no-style-fit")
    styles = ("--style", "clump:size=0.5,levels=3", "--style", "Wave:radius=0.04,seed=7", "--style=trim:method=scale")
    assert run_here(*groom, *styles, "--style", "lean:is_on=no").status == 0
    settings = grown(out)[0]
    wave = curl.Settings(radius=0.04, seed=7, **curl.WAVE)
    first = clump.Settings(size=0.5, levels=3)
    assert settings.styles[:2] == (first, wave)
    assert settings.styles[2:] == (trim.Settings(method="SCALE", seed=1), lean.Settings(is_on=False, seed=2))
    assert settings.style_names == ("Clump", "Wave", "Trim", "Lean")
    settings_file.write(tmp_path / "groom.json", GroomSettings(styles=[frizz.Settings()]))
    assert run_here(*groom, "--settings", tmp_path / "groom.json", "--style", "curl").status == 0
    assert grown(out)[0].styles == (frizz.Settings(), curl.Settings(seed=1))


@pytest.mark.long
def test_style_presets_fit_the_surface(scene, mesh, tmp_path):  # noqa: F811
    out = tmp_path / "out.blend"
    groom = ("groom", mesh, *SMALL, "--out", out, "--style-preset", "FRIZZY")
    assert run_here(*groom, "--no-style-fit").status == 0
    plain = grown(out)[0]
    assert plain.styles == style_presets.read("FRIZZY").styles
    assert run_here(*groom, "--style", "wet:lock=0.01", "--tip-taper", 0.9).status == 0
    settings = grown(out)[0]
    factor = settings.guides.length / 0.12  # the length of new hair on a head
    assert settings.styles[0].amplitude / plain.styles[0].amplitude == pytest.approx(factor, rel=0.01)
    assert settings.styles[1] == wet.Settings(lock=0.01, seed=1) and settings.hair.tip_taper == 0.9


def test_lengths_that_are_not_given_fit_the_surface(scene, mesh, tmp_path):  # noqa: F811
    out = tmp_path / "out.blend"
    unknown = ("--course", "styles.Crul.radius=0:1 1:0", "--course", "styles.Curl.angle=0:1 1:0")
    ended = run_here("groom", mesh, *SMALL, "--out", out, "--style", "curl:radius=0.01,seed=3", *unknown)
    assert ended.status == 0
    warning = "The hair has only the styles Curl: styles.Crul.radius, styles.Curl.angle have no effect."
    assert warning in ended.errors
    settings = grown(out)[0]
    (found,) = settings.styles
    factor = settings.guides.length / 0.12
    assert abs(factor - 1.0) > 0.1
    assert found.pitch == pytest.approx(curl.Settings().pitch * factor, rel=0.01)
    assert (found.radius, found.seed) == (0.01, 3)


def test_without_styles_there_is_nothing_to_fit(tmp_path):
    ended = run_here("groom", HEAD, "--out", tmp_path / "a.npz", "--no-style-fit")
    assert ended.status == 1 and ended.errors.strip().endswith("--no-style-fit needs --style or --style-preset.")


def test_settings_have_the_styles_of_the_words():
    styled = json.loads(run_here("settings", "--style", "curl:radius=0.01", "--style-preset", "WET").out)
    assert [(style["kind"], style["seed"]) for style in styled["styles"]] == [("WET", 0), ("CURL", 1)]


def test_info_lists_styles(hair, tmp_path):
    blend, styles = tmp_path / "a.blend", (clump.Settings(size=0.5), curl.Settings(radius=0.04))
    api.set_styles(hair, styles)
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    told = run_here("info", blend, "--json").results[0]["hair"][0]["styles"]
    head = {"format": settings_file.FORMAT, "version": settings_file.VERSION}
    named = GroomSettings(styles=styles, style_names=("Clump", "Curl"))
    assert settings_file.from_object(head | {"styles": told}, blend) == named
    settings_file.write(tmp_path / "a.json", GroomSettings(styles=styles))
    told = run_here("info", tmp_path / "a.json", "--json").results[0]["settings"]["styles"]
    assert [style["kind"] for style in told] == ["CLUMP", "CURL"]


def test_what_is_written_is_styled(tmp_path):
    groom = ("groom", HEAD, "--guides", 30, "--strands", 100)
    assert run_here(*groom, "--out", tmp_path / "plain.npz").status == 0
    assert run_here(*groom, "--style", "curl:radius=0.02", "--out", tmp_path / "curly.npz").status == 0
    plain, curly = (load(tmp_path / f"{name}.npz")["strand_points"] for name in ("plain", "curly"))
    np.testing.assert_array_equal(plain[:, 0], curly[:, 0])
    assert np.abs(plain - curly).max() > 0.005
