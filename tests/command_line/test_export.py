# SPDX-License-Identifier: GPL-3.0-or-later
"""`export` writes hair of a .blend to files for other programs; errors are one message."""

import bpy
import pytest

from tests.support.commands import run_here
from tests.support.exchange import alembic_reader


@pytest.fixture
def shot(hair, tmp_path):
    """Return a .blend with two kinds of hair on a sphere."""
    bpy.context.view_layer.objects.active = bpy.data.objects["Sphere"]
    bpy.ops.vellus.add_hair(guide_count=10, strand_count=30, length=0.2)
    bpy.context.object.data.name = "Fluff"
    bpy.context.scene.frame_end = 3
    path = tmp_path / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def exported(path):
    """Return the names of the objects with curves."""
    return {p.rpartition("/")[2] for p in alembic_reader.objects(alembic_reader.read(path)) if p.endswith("Shape")}


def test_all_hair_or_the_one_that_is_named(shot):
    (told,) = run_here("export", shot, "--out", "//all.abc", "--json").results
    assert (told["groups"], told["guides"], told["strands"], told["frames"]) == (2, 70, 530, 1)
    assert told["notes"] == [] and told["bytes"] == (shot.parent / "all.abc").stat().st_size
    names = {"HairShape", "Hair_guidesShape", "FluffShape", "Fluff_guidesShape"}
    assert exported(shot.parent / "all.abc") == names
    ended = run_here("export", shot, "--out", "//one.abc", "--hair", "Fluff", "--no-guides", "--no-color")
    assert ended.status == 0 and exported(shot.parent / "one.abc") == {"FluffShape"}
    assert "0 guides, 30 strands" in ended.out


@pytest.mark.parametrize("ending", [".abc", ".usdc"])
def test_animation_has_the_frames_of_the_scene(shot, ending):
    (told,) = run_here("export", shot, "--out", f"//moving{ending}", "--animation", "ALL", "--json").results
    assert told["frames"] == 3


def test_levels_of_detail_and_looks_are_variants_of_usd(shot):
    options = ["--level-count", "2", "--looks", "Black, Dyed Blue"]
    assert run_here("export", shot, "--out", "//variants.usdc", *options).status == 0
    bpy.utils.expose_bundled_modules()
    from pxr import Usd

    stage = Usd.Stage.Open(str(shot.parent / "variants.usdc"))
    for group in ("Hair", "Fluff"):
        sets = stage.GetPrimAtPath(f"/groom/{group}").GetVariantSets()
        assert sets.GetVariantSet("lod").GetVariantNames() == ["full", "half"]
        assert sets.GetVariantSet("look").GetVariantNames() == ["Black", "Dyed_Blue", "present"]


@pytest.mark.parametrize(
    ("words", "reported"),
    [
        (["--out", "a.fbx"], "exported as .abc"),
        (["--out", "a.abc", "--hair", "Nobody"], 'has no hair "Nobody"'),
        (["--out", "a.abc", "--no-strands", "--no-guides"], "choose one"),
        (["--out", "a.abc", "--level-count", "2"], "neither levels of detail"),
        (["--out", "a.usdc", "--looks", "Black, Nothing"], 'no look "Nothing"'),
    ],
)
def test_what_is_wrong_is_one_sentence(shot, tmp_path, monkeypatch, words, reported):
    monkeypatch.chdir(tmp_path)
    ended = run_here("export", shot, *words)
    assert ended.status == 1 and reported in ended.errors and len(ended.errors.splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["shot.blend"]


def test_a_file_without_hair_is_refused(sphere, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "bare.blend"))
    assert "no hair" in run_here("export", tmp_path / "bare.blend", "--out", "//a.abc").errors
