# SPDX-License-Identifier: GPL-3.0-or-later
"""One option of the command line has all settings of dynamics, without conflicts with other options."""

import argparse
import json
import re
from dataclasses import asdict, replace

import bpy
import pytest

from hair_addon import api
from hair_addon.command_line import dynamics_options
from hair_addon.core.dynamics.rod.settings import DynamicsSettings
from hair_addon.core.files import settings_file
from hair_addon.core.files.settings_file import GroomSettings
from tests.command_line.test_command_line import SMALL, grown, mesh  # noqa: F401 (a fixture)
from tests.support.commands import run_here


def dynamics_of(*options):
    """Return the section of dynamics that `settings` prints."""
    ended = run_here("settings", *options)
    assert ended.status == 0
    return json.loads(ended.out)["dynamics"]


def test_the_last_word_counts_after_the_preset_and_the_file(tmp_path):
    path = tmp_path / "a.json"
    settings_file.write(path, GroomSettings(dynamics=DynamicsSettings(damping=0.1, hold=1.0, colliders="Body")))
    assert dynamics_of("--settings", path)["damping"] == 0.1
    given = ("--dynamics", "hold=3,weight=2", "--dynamics-preset", "STYLED", "--dynamics", "hold=4", "--settings", path)
    wanted = DynamicsSettings(bend_stiffness=100.0, hold=4.0, weight=2.0, colliders="Body")
    assert dynamics_of(*given) == asdict(wanted)


def test_settings_that_share_a_name_are_apart():
    """Gravity, wetness and size of guides, look and tables are separate settings with one name."""
    alone = dynamics_of("--gravity", 0.25, "--size", 32, "--wetness", 0.5)
    assert alone == asdict(DynamicsSettings())
    ended = run_here("settings", "--gravity", 0.25, "--dynamics", "gravity=0.5,wetness=1,sag-free=no,vertex_count=12")
    found = json.loads(ended.out)
    assert found["guides"]["gravity"] == 0.25 and found["appearance"]["wetness"] == 0.0
    wanted = replace(DynamicsSettings(), gravity=0.5, wetness=1.0, sag_free=False, vertex_count=12)
    assert found["dynamics"] == asdict(wanted)


@pytest.mark.parametrize(
    ("text", "reported"),
    [
        ("bend=1", "'bend' is not a setting of dynamics: choose from bend_stiffness"),
        ("hold", "hold of dynamics needs a value"),
        ("hold=1,hold=2", "hold of dynamics is given twice"),
        ("hold=-1", "Hold must be between 0 and 10000, not -1."),
        ("hold=nan", "Hold must be between"),
        ("substeps=1.5", "substeps must be a whole number, not '1.5'"),
        ("sag_free=maybe", "sag_free must be yes or no, not 'maybe'"),
    ],
)
def test_what_is_wrong_is_one_sentence(text, reported):
    with pytest.raises(argparse.ArgumentTypeError, match=re.escape(reported)):
        dynamics_options.dynamics(text)


def test_a_command_ends_with_the_sentence(tmp_path, capfd):
    words = ("groom", "missing.obj", "--out", tmp_path / "a.npz", "--dynamics-preset", "CURLY")
    assert run_here(*words).status == 2
    errors = capfd.readouterr().err
    assert "argument --dynamics-preset: invalid choice: 'CURLY'" in errors and len(errors.splitlines()) == 1


def test_guides_of_a_file_have_the_dynamics_that_are_given(scene, mesh, tmp_path):  # noqa: F811
    out = tmp_path / "out.blend"
    assert run_here("groom", mesh, *SMALL, "--out", out, "--dynamics", "hold=5").status == 0
    assert grown(out)[0].dynamics == api.dynamics_of(bpy.data.objects["Guides"]) == DynamicsSettings(hold=5.0)
    told = run_here("info", out, "--json").results[0]["guides"][0]
    assert told["dynamics"] == asdict(DynamicsSettings(hold=5.0)) and told["simulates"] is False
