# SPDX-License-Identifier: GPL-3.0-or-later
"""`cards` and `tubes` write hair of a .blend as meshes in files; errors are one message."""

import json
import struct
from pathlib import Path

import bpy
import pytest

from tests.support.commands import run_here


@pytest.fixture
def shot(hair, tmp_path):
    path = tmp_path / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def test_cards_go_into_a_file_with_their_textures(shot):
    words = ("--cards", "10", "--segment-count", "2", "--texture-size", "128", "--level-count", "2", "--json")
    (told,) = run_here("cards", shot, "--out", "//cards.glb", *words).results
    (made,) = told["made"]
    assert made == {"hair": "Hair", "cards": 10, "pictures": 10, "levels": 2, "triangles": [40, 10]}
    data = (shot.parent / "cards.glb").read_bytes()
    described = json.loads(data[20 : 20 + struct.unpack("<I", data[12:16])[0]])
    assert {mesh["name"] for mesh in described["meshes"]} == {"Hair Cards LOD0", "Hair Cards LOD1"}
    for material in described["materials"]:
        assert "baseColorTexture" in material["pbrMetallicRoughness"] and "normalTexture" in material
        assert material["alphaMode"] != "OPAQUE"
    triangles = [described["accessors"][m["primitives"][0]["indices"]]["count"] // 3 for m in described["meshes"]]
    assert sorted(triangles) == [10, 40]
    assert sorted(p.name for p in shot.parent.iterdir()) == ["cards.glb", "shot.blend"]


def test_errors_of_cards_are_printed(shot):
    """The errors of each level are a line of the result, and values of --json."""
    words = ("--cards", "10", "--segment-count", "2", "--texture-size", "128", "--error-measure", "MEASURED")
    ended = run_here("cards", shot, "--out", "//cards.glb", *words)
    assert ended.out.startswith("Hair, level 0: errors: coverage 0.") and "FLIP 0." in ended.out.splitlines()[0]
    (told,) = run_here("cards", shot, "--out", "//cards.glb", *words, "--json").results
    (error,) = told["made"][0]["errors"]
    assert set(error) == {"coverage", "flip"} and all(0.0 < value < 1.0 for value in error.values())


def test_textures_lie_beside_files_that_have_none(shot):
    words = ("--cards", "10", "--texture-size", "128")
    ended = run_here("cards", shot, "--out", "//out/cards.obj", *words)
    assert ended.status == 0 and "1 meshes" in ended.out
    names = {path.name for path in (shot.parent / "out").iterdir()}
    assert {"cards.obj", "Hair_Cards_LOD0_color.png"} <= names and len(names) == 7


def test_textures_of_engines_lie_beside_files_that_embed_others(shot):
    words = ("--cards", "10", "--texture-size", "128", "--texture-layout", "UNREAL")
    assert run_here("cards", shot, "--out", "//out/cards.glb", *words).status == 0
    names = {path.name for path in (shot.parent / "out").iterdir()}
    assert {"cards.glb", "Hair_Cards_LOD0_unreal_Attributes.png", "Hair_Cards_LOD0_unreal_Material.png"} <= names


def test_relative_paths_lead_to_all_levels_and_their_textures(shot, monkeypatch):
    """Paths relative to the .blend lead to all levels and textures; USD names textures relative to its own folder."""
    bpy.utils.expose_bundled_modules()
    from pxr import Usd, UsdGeom, UsdShade

    here = shot.parent / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    words = ("--cards", "10", "--texture-size", "128", "--level-count", "2")
    for more in (("--out", "cards.usdc"), ("--out", "out/cards.blend", "--textures", "textures")):
        assert run_here("cards", "../shot.blend", *more, *words).status == 0
    stage = Usd.Stage.Open("cards.usdc")
    meshes = {prim.GetName() for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)}
    assert meshes == {"Hair_Cards_LOD0", "Hair_Cards_LOD1"}
    named = [prim.GetAttribute("inputs:file").Get() for prim in stage.Traverse() if prim.IsA(UsdShade.Shader)]
    named = [asset.path for asset in named if asset is not None]
    assert len(named) == 4 and all((here / path).is_file() for path in named)
    monkeypatch.chdir("/")
    bpy.ops.wm.open_mainfile(filepath=str(here / "out" / "cards.blend"))
    made = [image for image in bpy.data.images if "LOD" in image.name]
    assert made and {Path(bpy.path.abspath(image.filepath)).parent for image in made} == {here / "textures"}
    assert all(Path(bpy.path.abspath(image.filepath)).is_file() for image in made)


def test_tubes_go_into_a_file(shot):
    ended = run_here("tubes", shot, "--out", "//tubes.obj", "--tubes", "20", "--side-count", "3", "--point-count", "5")
    assert ended.status == 0
    lines = (shot.parent / "tubes.obj").read_text().splitlines()
    assert sum(line.startswith("v ") for line in lines) == 20 * 15
    assert sum(line.startswith("o ") for line in lines) == 1


@pytest.mark.parametrize(
    ("words", "reported"),
    [
        (["cards", "--out", "a.abc"], "exported as .blend"),
        (["tubes", "--out", "a.obj", "--hair", "Nobody"], 'has no hair "Nobody"'),
        (["cards", "--out", "a.obj", "--cards", "0"], "must be"),
    ],
)
def test_what_is_wrong_is_one_sentence(shot, tmp_path, monkeypatch, words, reported):
    monkeypatch.chdir(tmp_path)
    ended = run_here(words[0], shot, *words[1:])
    assert ended.status == 1 and reported in ended.errors and len(ended.errors.splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["shot.blend"]
