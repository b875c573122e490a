# SPDX-License-Identifier: GPL-3.0-or-later
"""Styles as words of a command line: what is wrong with one is one sentence, before anything is read."""

import argparse
import re

import pytest

from hair_addon.command_line import style_options
from hair_addon.core.params import declared
from hair_addon.core.styling.kinds import OFFERS
from tests.support.commands import run


def words(identifier, settings, names):
    """A style as an option says it."""
    return f"{identifier.lower()}:" + ",".join(f"{name}={getattr(settings, name)}" for name in names)


@pytest.mark.parametrize("identifier", OFFERS)
def test_any_style_can_be_said(identifier):
    offer = OFFERS[identifier]
    assert style_options.style(identifier.lower()) == (offer.label, offer.settings, False)
    names = [name for name, *_ in declared(type(offer.settings))]
    assert style_options.style(words(identifier, offer.settings, names)) == (offer.label, offer.settings, True)


@pytest.mark.parametrize(
    ("text", "said"),
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
def test_what_is_wrong_is_one_sentence(text, said):
    with pytest.raises(argparse.ArgumentTypeError, match=re.escape(said)):
        style_options.style(text)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--style", "perm"), "argument --style: 'perm' is not a style"),
        (("--style-preset", "PERM"), "argument --style-preset: invalid choice: 'PERM'"),
    ],
)
def test_a_command_ends_with_the_sentence(options, said, tmp_path):
    ended = run("groom", "missing.obj", "--out", tmp_path / "a.npz", *options)
    assert ended.status == 2 and said in ended.errors and len(ended.errors.splitlines()) == 1


def test_a_preset_that_is_not_given_cannot_be_fitted(tmp_path):
    ended = run("settings", "--style-preset", "CURLY", "--out", tmp_path / "a.json")
    assert ended.status == 0
    too_many = [word for _ in range(65) for word in ("--style", "curl")]
    ended = run("settings", *too_many)
    assert ended.status == 1 and "at most 64 styles" in ended.errors
