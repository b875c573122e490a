# SPDX-License-Identifier: GPL-3.0-or-later
"""The functions for scripts: they have examples, plain arrays need no Blender, and errors are one sentence."""

import doctest
import importlib
import os
import re
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.api.blender_access import NO_BLENDER
from hair_addon.core.kernels import compiled_kernels
from hair_addon.core.long_work import Stopped
from hair_addon.core.placement import cvt
from hair_addon.core.shading import appearance
from hair_addon.core.styling import kinds
from tests.support.commands import PYTHONPATH
from tests.support.dynamics.following import update
from tests.support.reading import evaluated_points, points, snapshot
from tests.support.walk import walk_installed

ROOT = Path(__file__).resolve().parents[2]
MODULES = (api, *(importlib.import_module(f"{api.__name__}.{name}") for name in walk_installed.API_FILES))
WITHOUT_BLENDER = "import sys\nfor name in ('bpy', 'gpu', 'mathutils', 'imbuf'): sys.modules[name] = None\n"


def examples():
    """Return the doctests of the functions, in the order of the files, beginning with that of the module."""
    return [test for module in MODULES for test in examples_of(module)]


def examples_of(module):
    found = doctest.DocTestFinder(exclude_empty=True).find(module, "api")
    return sorted((test for test in found if test.examples), key=lambda test: test.lineno)


def shown_code():
    """Return the blocks of Python code in docs/scripts.md."""
    text = (ROOT / "docs" / "scripts.md").read_text(encoding="utf-8")
    return re.findall(r"```python\n(.*?)```", text, re.DOTALL)


def test_every_function_has_an_example():
    """Every function has an example, which tests/test_install.py runs in the installed extension."""
    public = {name for name in api.__all__ if name[0].islower()}
    assert {example.name.removeprefix("api.") for example in examples()[1:]} == public - {"settings_of"}


def run_python(program, folder):
    kept = {name: os.environ[name] for name in (compiled_kernels.VARIABLE,) if name in os.environ}
    line, environment = [sys.executable, "-c", program], kept | {"PYTHONPATH": PYTHONPATH}
    done = subprocess.run(line, cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_examples_of_plain_arrays_run_without_blender(tmp_path):
    """The examples of the module and of docs/scripts.md on plain arrays run without Blender."""
    program = "import doctest, warp\nfrom hair_addon import api\nwarp.config.log_level = warp.LOG_WARNING\n"
    program += "test = doctest.DocTestFinder(recurse=False).find(api, 'api')[0]\n"
    program += "assert doctest.DocTestRunner().run(test).failed == 0 and test.examples\n"
    *_in_blender, plain = shown_code()
    assert "bpy" not in plain
    run_python(WITHOUT_BLENDER + program + plain, tmp_path)


def test_without_blender_functions_and_commands_say_so(tmp_path):
    program = "from hair_addon import api\nfor call in (api.settings_of, api.add_hair, api.points):\n"
    program += "    try: call(None)\n    except api.HairError as error: print(error)\n"
    assert run_python(WITHOUT_BLENDER + program, tmp_path).splitlines() == [NO_BLENDER] * 3
    program = "from hair_addon import command_line\nsys.exit(command_line.main(['info', 'shot.blend'], 'vellus'))"
    ended = subprocess.run([sys.executable, "-c", WITHOUT_BLENDER + program], cwd=ROOT, capture_output=True, text=True)
    assert (ended.returncode, ended.stderr) == (1, f"vellus: {NO_BLENDER}\n")


@pytest.mark.parametrize(
    ("call", "reported"),
    [
        (lambda: api.distribute_guides(bpy.data.objects["Sphere"], guide_cuont=3), "Unknown setting"),
        (lambda: api.distribute_guides(bpy.data.objects["Sphere"], guide_count=0), "Guide count must be between"),
        (lambda: api.distribute_guides(bpy.data.objects["Sphere"], density_group="none"), "no vertex group"),
        (lambda: api.distribute_guides("Sphere"), "neither a mesh object"),
        (lambda: api.distribute_guides(None), "neither a mesh object"),
        (lambda: api.distribute_guides(([[0, 0, 0]], [[0, 0, 5]])), "uses vertex 5"),
        (lambda: api.distribute_guides(([[0, 0]], [[0, 0, 0]])), "A mesh is vertices"),
        (lambda: api.distribute_guides((np.eye(3), [[0, 1, 2]]), density_group="top"), "plain arrays"),
        (lambda: api.interpolate_hair(bpy.data.objects["Hair"]), "is not Vellus guides"),
        (lambda: api.interpolate_hair(api.distribute_guides((np.eye(3), [[0, 1, 2]]), guide_count=3)), "mesh="),
        (lambda: api.add_hair(bpy.data.objects["Hair"]), "neither a mesh object"),
        (lambda: api.shade(bpy.data.objects["Hair"], "PLAID"), "Unknown preset"),
        (lambda: api.shade(bpy.data.objects["Hair"], model="PHONG"), "Unknown model"),
        (lambda: api.shade(bpy.data.objects["Hair"], melanin=3), "Melanin must be between"),
        (lambda: api.shade(bpy.data.objects["Hair"], melanin=1, color=(1, 0, 0)), "exclude each other"),
        (lambda: api.shade(bpy.data.objects["Hair"], parametrization="MELANIN", color=(1, 0, 0)), "change nothing"),
        (lambda: api.shade(bpy.data.objects["Guides"]), "is not Vellus hair"),
        (lambda: api.points(bpy.data.objects["Sphere"]), "is not Vellus guides or hair"),
        (lambda: api.change_guides(bpy.data.objects["Guides"], "SHAVE"), "Unknown guide tool"),
        (lambda: api.change_guides(bpy.data.objects["Guides"], "LENGTH", factor=0), "Factor must be positive"),
        (lambda: api.change_guides(bpy.data.objects["Guides"], "LIFT", api.Clump()), "settings must be"),
        (lambda: api.change_guides(bpy.data.objects["Hair"], "LIFT"), "is not Vellus guides"),
        (lambda: api.change_guides(bpy.data.objects["Guides"], "TRIM"), "Pick the object that cuts"),
        (lambda: api.draw(width=0), "Width must be"),
        (lambda: api.draw(), "no camera"),
        (lambda: api.draw(height=16385), "exceed 16384 a side"),
        (lambda: api.draw(has_passes=True), "choose from width, height, samples_per_side, is_transparent"),
        (lambda: api.render("a.png", samples_per_side=2), 'Unknown setting "samples_per_side"'),
        (lambda: api.render("a.png"), "no camera"),
        (lambda: api.render("a.gif"), "saved as .png or .exr"),
        (lambda: api.render("a.png", engine="pencil"), "Unknown engine"),
        (lambda: api.load_settings("missing.json"), "does not exist"),
        (lambda: api.add_style(bpy.data.objects["Hair"], "PERM"), "Unknown style 'PERM': choose from TRIM"),
        (lambda: api.add_style(bpy.data.objects["Hair"], api.Appearance()), "A style must be the settings of a style"),
        (lambda: api.add_style(bpy.data.objects["Hair"], "CURL", radios=1), 'Unknown setting "radios"'),
        (lambda: api.add_style(bpy.data.objects["Hair"], "CURL", radius=-1), "Radius must be between"),
        (lambda: api.add_style(bpy.data.objects["Hair"], "CURL", fit="no"), "fit must be True or False"),
        (lambda: api.add_style(bpy.data.objects["Hair"], "CURL", name=3), "name must be text"),
        (lambda: api.add_style(bpy.data.objects["Guides"], "CURL"), "is not Vellus hair"),
        (lambda: api.styles_of(bpy.data.objects["Sphere"]), "is not Vellus"),
        (lambda: api.set_styles(bpy.data.objects["Hair"], api.Curl()), "styles must be a list"),
        (lambda: api.set_styles(bpy.data.objects["Hair"], [api.Curl()] * 65), "at most 64 styles"),
        (lambda: api.set_styles(bpy.data.objects["Guides"], []), "is not Vellus hair"),
        (lambda: api.apply_style_preset(bpy.data.objects["Hair"], "PERM"), "Unknown style preset 'PERM'"),
        (lambda: api.apply_style_preset(bpy.data.objects["Hair"], None), "Unknown style preset None"),
        (lambda: api.save_settings("pyproject.toml/a.json", api.GroomSettings()), "cannot be written"),
    ],
)
def test_failures_are_one_sentence_and_change_nothing(hair, call, reported, tmp_path, monkeypatch):
    (tmp_path / "pyproject.toml").touch()
    monkeypatch.chdir(tmp_path)
    before = snapshot()
    with pytest.raises(api.HairError) as refused:
        call()
    assert reported in str(refused.value) and "\n" not in str(refused.value)
    assert snapshot() == before
    assert [path.name for path in tmp_path.iterdir()] == ["pyproject.toml"]


def test_points_are_meters_in_the_world(hair):
    sphere = bpy.data.objects["Sphere"]
    sphere.location, sphere.rotation_euler, sphere.scale = (1.0, 2.0, 3.0), (0.3, 0.2, 0.5), (2.0, 2.0, 2.0)
    bpy.context.scene.unit_settings.scale_length = 0.01
    update()
    matrix = np.array(hair.matrix_world)
    expected = 0.01 * (points(hair) @ matrix[:3, :3].T + matrix[:3, 3])
    np.testing.assert_allclose(api.points(hair), expected, atol=1e-6)


def test_points_are_where_the_surface_carries_them(hair):
    twist = bpy.data.objects["Sphere"].modifiers.new("Twist", "SIMPLE_DEFORM")
    twist.deform_method, twist.angle = "TWIST", 1.0
    update()
    assert np.abs(evaluated_points(hair) - points(hair)).max() > 0.1
    np.testing.assert_allclose(api.points(hair), evaluated_points(hair), atol=1e-5)


def test_points_follow_guides_that_were_combed(guides):
    bpy.ops.vellus.interpolate_hair(strand_count=50)
    hair = bpy.data.objects["Hair"]
    before = api.points(hair)
    moved = points(guides)
    moved[:, 1:] += (0.0, 0.0, 0.2)
    guides.data.attributes["position"].data.foreach_set("vector", moved.ravel())
    guides.data.update_tag()
    update()
    assert np.abs(api.points(hair) - before).max() > 0.1


def test_deleting_hair_leaves_guides_that_other_hair_follows(guides):
    first, second = (api.interpolate_hair(guides, strand_count=40) for _ in range(2))
    assert api.hair_systems() == [first, second] and api.hair_systems(guides.data.surface) == [first, second]
    api.delete_hair(first)
    assert api.hair_systems() == [second] and second.vellus.guide_curves == guides.data
    api.delete_hair(guides)
    assert api.hair_systems() == [] and not [o for o in bpy.data.objects if o.type == "CURVES"]


def test_a_look_keeps_how_it_is_drawn(hair):
    api.shade(hair, mode="classic", model="KAJIYA_KAY")
    api.shade(hair, "BLOND")
    look = api.settings_of(hair).appearance
    assert (look.mode, look.melanin, hair.data.vellus.model) == ("classic", 0.22, "KAJIYA_KAY")


def test_a_color_of_a_script_is_seen(hair):
    """A script's color takes effect in every parametrization of the previous color."""
    api.shade(hair, color=(0.5, 0.1, 0.02))
    look = api.settings_of(hair).appearance
    assert appearance.mean_color(look) == pytest.approx((0.5, 0.1, 0.02), rel=0.01)
    api.shade(hair, melanin=0.9)
    assert appearance.mean_color(api.settings_of(hair).appearance).max() < 0.1
    api.shade(hair, "BLOND", color=(0.5, 0.1, 0.02))
    mixed = appearance.mean_color(api.settings_of(hair).appearance)  # of strands that differ
    assert mixed == pytest.approx((0.5, 0.1, 0.02), rel=0.03)


def test_settings_of_combed_guides_leave_them(guides):
    bpy.ops.vellus.interpolate_hair(strand_count=50)
    moved = points(guides) + np.float32(0.01)
    guides.data.attributes["position"].data.foreach_set("vector", moved.ravel())
    guides.data.update_tag()
    update()
    api.apply_settings(bpy.data.objects["Hair"], api.GroomSettings(api.GuideSettings(guide_count=7)))
    update()
    assert np.array_equal(points(guides), moved)
    assert "Regenerate Guides" in guides.data.vellus.status


def test_styles_are_what_a_script_says(hair):
    added = api.add_style(hair, "WAVE", radius=0.004)
    assert added.flatness == 1.0 and api.styles_of(hair) == (added,)
    again = api.add_style(hair, api.Curl(pitch=0.05, seed=9), name="Ends")
    assert again == api.Curl(pitch=0.05, seed=9) and hair.data.vellus.styles[1].name == "Ends"
    third = api.add_style(hair, "FRIZZ", seed=9, wavelength=0.03)
    assert third.seed == 9 and third.amplitude > api.Frizz().amplitude  # a sphere of two meters
    assert third.wavelength == api.Frizz().wavelength and third.spread > api.Frizz().spread
    api.set_styles(hair, api.styles_of(hair)[::-1])
    assert api.styles_of(hair) == (third, again, added)
    assert [item.name for item in hair.data.vellus.styles] == ["Frizz", "Ends", "Wave"]
    settings = api.settings_of(hair)
    api.set_styles(hair, [])
    api.apply_settings(hair, settings)
    assert api.settings_of(hair) == settings and settings.styles == (third, again, added)


def test_each_kind_of_style_has_its_class_under_its_label():
    """Each kind of style has a class named after its label, although a kind is registered only in kinds.py."""
    classes = {name: getattr(api, name) for name in kinds.__all__}
    assert classes == {kinds.LABELS[kind]: settings_class for kind, settings_class in kinds.KINDS.items()}
    assert set(classes) <= set(api.__all__)


def _giving_locks(hair):
    """Return {name: function of (progress) that adds locks to hair}."""
    other = api.Clump(size=0.3, seed=5)
    return {
        "add": lambda progress: api.add_style(hair, "CLUMP", progress=progress),
        "set": lambda progress: api.set_styles(hair, [api.Frizz(), other], progress=progress),
        "preset": lambda progress: api.apply_style_preset(hair, "CURLY", progress=progress),
    }


@pytest.mark.parametrize("what", ["add", "set", "preset"])
def test_placing_locks_tells_how_far_it_is_and_leaves_nothing_where_it_is_stopped(hair, what, monkeypatch):
    api.add_style(hair, "FRIZZ")
    update()
    before, shown = api.settings_of(hair), points(hair)
    give, told = _giving_locks(hair)[what], []

    def stop(step, part):
        told.append((step, part))
        if part > 0.5:
            raise Stopped

    with pytest.raises(Stopped):
        give(stop)
    update()
    assert {step for step, _part in told} == {"Placing locks"} and len(told) > 3
    assert [part for _step, part in told] == sorted(part for _step, part in told)
    assert api.settings_of(hair) == before and hair.data.vellus.status == ""
    np.testing.assert_array_equal(points(hair), shown)

    heard = []
    give(lambda step, part: heard.append((step, part)))
    assert heard[: len(told)] == told and heard[-1][1] > 0.9
    monkeypatch.setattr(cvt, "place", None)  # the update finds what was placed
    update()
    gathered = points(hair)
    assert hair.data.vellus.status == "" and (gathered.shape != shown.shape or not np.allclose(gathered, shown))


def test_new_hair_with_locks_tells_of_them_among_its_stages(sphere):
    """New hair whose styles have locks reports placing them among its stages, which `groom` shows on the command
    line.
    """
    settings = api.GroomSettings(
        api.GuideSettings(guide_count=20), api.HairSettings(strand_count=100), styles=(api.Clump(size=0.1),)
    )
    heard, objects = [], set(bpy.data.objects)
    api.add_hair(sphere, settings, progress=lambda step, part: heard.append((step, part)))
    steps, parts = list(dict.fromkeys(step for step, _part in heard)), [part for _step, part in heard]
    assert steps[-3:] == ["Finding guides", "Placing locks", "Growing strands"]
    assert parts == sorted(parts) and sum(step == "Placing locks" for step, _part in heard) > 5

    def stop(step, _part):
        if step == "Placing locks":
            raise Stopped

    made = set(bpy.data.objects) - objects
    with pytest.raises(Stopped):
        api.add_hair(sphere, settings, progress=stop)
    assert set(bpy.data.objects) - objects == made


@pytest.mark.parametrize("style", [api.Frizz(), "FRIZZ"], ids=["settings", "a name"])
def test_a_style_that_is_not_to_be_fitted_keeps_its_lengths(hair, style):
    assert api.add_style(hair, style, fit=isinstance(style, api.Frizz)) == api.Frizz()


@pytest.mark.parametrize("style", ["CLUMP", "BRAID", "WET"])
def test_styles_of_the_menu_have_few_locks_on_any_surface(hair, style, monkeypatch):
    """Locks of styles from the menu are scaled to the surface: a sphere of two meters has few."""
    placed, place = [], cvt.place
    monkeypatch.setattr(
        cvt, "place", lambda mesh, count, *rest, **named: placed.append(count) or place(mesh, count, *rest, **named)
    )
    api.add_style(hair, style)
    update()
    assert 0 < sum(placed) < 3000 and hair.data.vellus.status == ""


def test_new_hair_has_the_styles_of_its_settings(sphere):
    few = api.GuideSettings(guide_count=20), api.HairSettings(strand_count=50)
    _guides, hair = api.add_hair(sphere, api.GroomSettings(*few, styles=[api.Clump(size=0.5), api.Curl(), api.Curl()]))
    assert api.styles_of(hair) == (api.Clump(size=0.5), api.Curl(), api.Curl())
    assert api.settings_of(hair).style_names == ("Clump", "Curl", "Curl.001")
