# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line has input and output files, results as text or JSON, and one message per error."""

import itertools
import json
import re
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.io.pictures import frames
from hair_addon.core.files import settings_file, style_presets, table_exr
from hair_addon.core.files.settings_file import GroomSettings
from hair_addon.core.grooming.groom import GuideSettings, HairSettings
from hair_addon.core.shading import appearance
from hair_addon.core.shading.appearance import Appearance
from hair_addon.core.shading.presets import PRESETS
from hair_addon.core.shading.tables import lookup_tables
from tests.support.commands import HEAD, ROOT, TETRAHEDRON, Ended, load, run, run_here, write_obj

SMALL = ("--guides", 20, "--strands", 100)


@pytest.fixture
def mesh(tmp_path):
    return write_obj(tmp_path / "mesh.obj", *TETRAHEDRON)


@pytest.fixture
def shot(lit, tmp_path):
    """Return a .blend with hair that turns, a camera and a light; frames 1 to 3, pictures of 40 × 30."""
    scene, sphere = bpy.context.scene, bpy.data.objects["Sphere"]
    for frame, angle in ((1, 0.0), (3, 1.0)):
        sphere.rotation_euler = (0.0, angle, angle)
        sphere.keyframe_insert("rotation_euler", frame=frame)
    scene.frame_end, scene.cycles.samples, scene.eevee.taa_render_samples = 3, 1, 1
    scene.eevee.use_shadows = False  # shadows take half of its time
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 80, 60, 50
    scene.frame_set(2)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    return tmp_path / "shot.blend"


def picture(path):
    """Return (height, width, 4)."""
    image = bpy.data.images.load(str(path))
    width, height = image.size
    pixels = np.array(image.pixels[:]).reshape(height, width, 4)
    bpy.data.images.remove(image)
    return pixels


# ---------------------------------------------------------------------------------------------------------- groom


def test_a_head_is_groomed_into_arrays(tmp_path):
    out = tmp_path / "head.npz"
    ended = run_here("groom", HEAD, "--guides", 50, "--strands", 400, "--seed", 3, "--out", out)
    assert (ended.status, ended.errors) == (0, "")
    assert re.fullmatch(r"50 guides, 400 strands on head in \d+\.\d\d s: .*head\.npz\n", ended.out)
    arrays = load(out)
    assert arrays["guide_points"].shape == (50, 41, 3)
    assert arrays["strand_points"].shape == (400, 41, 3)
    np.testing.assert_array_equal(arrays["roots"], arrays["strand_points"][:, 0])
    vertices = np.array([line.split()[1:4] for line in HEAD.read_text().splitlines() if line.startswith("v ")], float)
    assert (arrays["roots"] >= vertices.min(axis=0) - 1e-4).all()
    assert (arrays["roots"] <= vertices.max(axis=0) + 1e-4).all()


def grown(path):
    """Return the `GroomSettings` of the hair in a .blend, and the points of guides and of hair."""
    bpy.ops.wm.open_mainfile(filepath=str(path))
    guides, hair = bpy.data.objects["Guides"], bpy.data.objects["Hair"]
    return api.settings_of(hair), api.points(guides), api.points(hair)


def test_one_seed_is_for_both_stages(scene, mesh, tmp_path):
    found = []
    for seed in (3, 4):
        out = tmp_path / f"{seed}.blend"
        assert run_here("groom", mesh, *SMALL, "--seed", seed, "--out", out).status == 0
        settings, guides, hair = grown(out)
        assert settings.guides.seed == settings.hair.seed == seed
        found.append((guides, hair))
    assert not np.array_equal(found[0][0], found[1][0])
    assert not np.array_equal(found[0][1][:, 0], found[1][1][:, 0])


def test_options_come_before_the_file_of_settings(scene, mesh, tmp_path):
    sizes = {"radius": 0.001, "influence_distance": 0.2}
    wanted = GroomSettings(
        GuideSettings(guide_count=9, seed=5, length=0.4, gravity=0.6),
        HairSettings(strand_count=30, seed=6, **sizes),
        Appearance(melanin=0.4, coat=0.5),
    )
    settings_file.write(tmp_path / "groom.json", wanted)
    out = tmp_path / "out.blend"
    groom = ("groom", mesh, "--settings", tmp_path / "groom.json", "--out", out)
    assert run_here(*groom).status == 0
    assert grown(out)[0] == wanted
    options = ("--strands", 40, "--no-guide-map", "--melanin", 0.7, "--tint", 1, 0.5, 0.2, "--tilt", 0.1, "--size", 32)
    assert run_here(*groom, *options).status == 0
    assert grown(out)[0] == GroomSettings(
        replace(wanted.guides, tilt=0.1),
        HairSettings(strand_count=40, seed=6, guide_map=False, **sizes),
        Appearance(melanin=0.7, coat=0.5, tint=(1.0, 0.5, 0.2)),
        lookup_tables.Settings(size=32),
    )
    assert run_here(*groom, "--preset", "BLOND", "--coat", 0.1).status == 0
    assert grown(out)[0].appearance == replace(PRESETS["BLOND"][1], coat=0.1)


def test_existing_objects_of_a_file_are_kept(lit, tmp_path):
    """Existing objects of a .blend are kept beside new hair, and a path relative to it finds what it names."""
    (tmp_path / "from").mkdir()
    picture_path = tmp_path / "from" / "dots.png"
    image = bpy.data.images.new("dots", 2, 2)
    image.filepath_raw, image.file_format = str(picture_path), "PNG"
    image.save()
    image.use_fake_user = True
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "from" / "a.blend"))
    image.filepath = "//dots.png"
    bpy.ops.wm.save_mainfile()
    out = tmp_path / "to" / "b.blend"
    assert run_here("groom", tmp_path / "from" / "a.blend", *SMALL, "--out", out).status == 0
    bpy.ops.wm.open_mainfile(filepath=str(out))
    assert Path(bpy.path.abspath(bpy.data.images["dots"].filepath)).resolve() == picture_path.resolve()
    assert sorted(len(c.curves) for c in bpy.data.hair_curves) == [20, 60, 100, 500]
    assert [path.name for path in (tmp_path / "to").iterdir()] == ["b.blend"]


# ---------------------------------------------------------------------------------------------------- other verbs


def test_tables_are_baked(tmp_path):
    bake = ("bake-tables", "--size", 32, "--sigma-a", 0.1, 0.2, 0.3, "--axes", "COSINES")
    assert run_here(*bake, "--out", tmp_path / "t").status == 0
    settings = table_exr.read_tables(tmp_path / "t").settings
    assert settings == lookup_tables.Settings(size=32, sigma_a=(0.1, 0.2, 0.3), axes="COSINES")


def test_tables_of_the_energy_conserving_mode_are_baked_and_plotted(tmp_path):
    bake = ("bake-tables", "--mode", "energy", "--roughness", 0.2, "--ior", 1.5, "--size", 32, "--plot")
    ended = run_here(*bake, "--out", tmp_path / "t", "--json")
    assert ended.status == 0
    expected = lookup_tables.Settings(mode="energy", roughness=0.2, eta=1.5, size=32)
    assert (
        table_exr.read_tables(tmp_path / "t").settings
        == table_exr.read_dual_tables(tmp_path / "t").settings
        == expected
    )
    tables, pictures = ({path.stem for path in (tmp_path / "t").glob(f"*.{ending}")} for ending in ("exr", "png"))
    assert tables == pictures == {"m", "n", "n_trt", "n_res", "dual", "n_g", "n_g_trt"}
    assert sorted(ended.results[0]["files"]) == sorted(map(str, (tmp_path / "t").iterdir()))


def test_tables_of_a_file_of_settings(tmp_path):
    look = Appearance(roughness=0.4, melanin=0.2)
    tables = lookup_tables.Settings(size=64, glint_gain=0.5)
    settings_file.write(tmp_path / "groom.json", GroomSettings(appearance=look, tables=tables))
    bake = ("bake-tables", "--settings", tmp_path / "groom.json", "--size", 32, "--out", tmp_path / "t")
    assert run_here(*bake).status == 0
    expected = appearance.table_settings(look, replace(tables, size=32))
    assert table_exr.read_tables(tmp_path / "t").settings == expected


def test_a_color_is_the_one_that_is_shown():
    (told,) = run_here("settings", "--color", 0.5, 0.25, 0.125, "--json").results
    assert told["appearance"]["parametrization"] == "COLOR" and told["appearance"]["color"] == [0.5, 0.25, 0.125]


def test_settings_are_printed_or_written_to_begin_with(tmp_path):
    options = ("--strands", 77, "--gravity", 0.25)
    ended = run_here("settings", *options)
    written = run_here("settings", *options, "--out", tmp_path / "a.json", "--json")
    assert (ended.status, written.status) == (0, 0)
    assert ended.out == (tmp_path / "a.json").read_text()
    expected = GroomSettings(GuideSettings(gravity=0.25), HairSettings(strand_count=77))
    assert settings_file.read(tmp_path / "a.json") == expected
    assert written.results == [{"verb": "settings", "out": str(tmp_path / "a.json")}]
    assert json.loads(run_here("settings", "--schema").out) == settings_file.schema()


def test_info_shows_the_content_of_a_file(lit, tmp_path):
    blend = tmp_path / "lit.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    told = run_here("info", blend, "--json").results[0]
    assert [(s["name"], s["uv_map"]) for s in told["surfaces"]] == [("Sphere", "UVMap")]
    (guides,), (hair,) = told["guides"], told["hair"]
    assert (guides["strands"], guides["points"], guides["hair"]) == (60, 60 * 41, ["Hair"])
    assert (hair["strands"], hair["guides"], hair["surface"], hair["warnings"]) == (500, "Guides", "Sphere", [])
    assert settings_file.from_object(
        {"format": settings_file.FORMAT, "version": 1, "guides": guides["settings"], "hair": hair["settings"]}, blend
    ).hair == HairSettings(strand_count=500, radius=0.004, influence_distance=0.03)
    assert hair["bytes"] > 500 * 41 * 16
    reported = run_here("info", blend).out
    assert "strands: 500" in reported and f"melanin: {Appearance().melanin}" in reported


def test_info_warns_as_the_panel_does(lit, tmp_path):
    bpy.data.objects["Hair"].data.vellus.hair.part_lines = "Gone"
    bpy.context.view_layer.update()
    blend = tmp_path / "lit.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    assert any("Gone" in warning for warning in run_here("info", blend, "--json").results[0]["hair"][0]["warnings"])


def test_info_reads_files_of_vellus(mesh, tmp_path):
    run_here("settings", "--strands", 9, "--out", tmp_path / "a.json")
    assert run_here("info", tmp_path / "a.json", "--json").results[0]["settings"]["hair"]["strand_count"] == 9
    run_here("bake-tables", "--size", 32, "--out", tmp_path)
    for name in ("n.exr", "dual.exr"):
        assert run_here("info", tmp_path / name, "--json").results[0]["settings"]["size"] == 32


def test_info_without_a_file_lists_looks_and_style_presets():
    listed = run_here("info", "--json").results[0]
    assert listed == {"verb": "info", "looks": [*PRESETS], "style_presets": [*style_presets.PRESETS]}
    assert "AUBURN" in run_here("info").out


# ---------------------------------------------------------------------------------------------------------- render


def test_a_dry_run_states_what_is_rendered_and_writes_no_file(shot, tmp_path):
    folder = tmp_path / "frames"
    words = ("render", shot, "--frames", "1-3", "--samples", 3, "--width", 60, "--out", folder / "f_#.png", "--json")
    plan = run_here(*words, "--dry-run").results[0]
    assert (plan["frames"], plan["to_render"], plan["samples"], plan["width"]) == ([1, 2, 3], [1, 2, 3], 3, 60)
    assert [(hair["name"], hair["surface"]) for hair in plan["hair"]] == [("Hair", "Sphere")]
    assert [*folder.iterdir()] == []
    assert run_here(*words).status == 0
    (folder / "f_2.png").unlink()
    before = sorted(folder.iterdir())
    assert run_here(*words, "--dry-run").results[0]["to_render"] == [2]
    assert sorted(folder.iterdir()) == before
    other = run_here(*words, "--dry-run", "--engine", "cycles")
    assert other.status == 1 and "belongs to another sequence (engine)" in other.errors


def test_a_dry_run_fails_where_rendering_would(shot, tmp_path):
    bpy.ops.wm.open_mainfile(filepath=str(shot))
    bpy.data.objects.remove(bpy.context.scene.camera)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "blind.blend"))
    ended = run_here("render", tmp_path / "blind.blend", "--dry-run", "--out", tmp_path / "f.png")
    assert (ended.status, ended.out) == (1, "") and "no camera" in ended.errors


def test_frames_are_drawn_each_to_its_file(shot, tmp_path):
    ended = run_here("render", shot, "--frames", "1-3", "--out", tmp_path / "f" / "f_###.exr", "--json")
    assert ended.status == 0, ended.errors
    assert [(result["frame"], Path(result["out"]).name) for result in ended.results] == [
        (1, "f_001.exr"),
        (2, "f_002.exr"),
        (3, "f_003.exr"),
    ]
    assert sorted(path.name for path in (tmp_path / "f").glob("[!.]*")) == ["f_001.exr", "f_002.exr", "f_003.exr"]
    pictures = [picture(tmp_path / "f" / f"f_00{number}.exr") for number in (1, 2, 3)]
    assert all(made.shape == (30, 40, 4) for made in pictures)
    assert all(np.abs(first - second).max() > 0.01 for first, second in itertools.pairwise(pictures))


def test_the_default_frame_is_the_current_frame_of_the_file(shot, tmp_path):
    assert run_here("render", shot, "--frames", "2", "--out", tmp_path / "asked.png").status == 0
    assert run_here("render", shot, "--out", tmp_path / "saved.png").status == 0
    assert np.array_equal(picture(tmp_path / "asked.png"), picture(tmp_path / "saved.png"))
    assert run_here("render", shot, "--frames", "all", "--out", tmp_path / "all_#.png").status == 0
    assert np.array_equal(picture(tmp_path / "all_2.png"), picture(tmp_path / "saved.png"))
    assert (tmp_path / "all_3.png").exists()


def test_every_engine_is_available(capsys):
    run_here("render", "--help")
    assert f"{{{','.join(frames.ENGINES)}}}" in capsys.readouterr().out


@pytest.mark.farm
@pytest.mark.parametrize("engine", ["cycles", "eevee"])
def test_other_engines_render_the_same_frames(shot, tmp_path, engine):
    out = tmp_path / "f_#.png"
    ended = run_here("render", shot, "--frames", "1-2", "--engine", engine, "--width", 60, "--out", out, "--json")
    assert ended.status == 0, ended.errors
    assert [result["engine"] for result in ended.results] == [engine] * 2
    first, second = (picture(tmp_path / f"f_{number}.png") for number in (1, 2))
    assert first.shape == (30, 60, 4)
    assert first.std() > 0.02 and np.abs(first - second).max() > 0.02


def test_an_empty_background_is_empty(shot, tmp_path):
    for engine in ("vellus", "cycles"):
        out = tmp_path / f"{engine}.exr"
        assert run_here("render", shot, "--engine", engine, "--transparent", "--out", out).status == 0
        alpha = picture(out)[..., 3]
        assert alpha[0, 0] == 0.0 and alpha[15, 20] == pytest.approx(1.0, abs=1e-6)


# ------------------------------------------------------------------------------------------------ what is not done


@pytest.mark.parametrize(
    ("arguments", "reported"),
    [
        (["groom", "missing.obj", "--out", "x.npz"], "missing.obj does not exist"),
        (["groom", HEAD, "--out", "x.fbx"], ".blend, .npz, .usd"),
        (["groom", HEAD, "--out", "x"], "not as a file without an extension"),
        (["groom", ROOT / "pyproject.toml", "--out", "x.npz"], "format that Vellus cannot read"),
        (["groom", HEAD, "--guides", 0, "--out", "x.npz"], "--guides must be"),
        (["groom", HEAD, "--strands", -3, "--out", "x.npz"], "--strands must be"),
        (["groom", HEAD, "--influence-distance", "nan", "--out", "x.npz"], "--influence-distance must be"),
        (["groom", HEAD, "--influence-distance", 0, "--out", "x.npz"], "--influence-distance must be"),
        (["groom", HEAD, "--influence-distance", -1, "--out", "x.npz"], "--influence-distance must be"),
        (["groom", HEAD, "--density-group", "scalp", "--out", "x.npz"], 'no vertex group or attribute "scalp"'),
        (["groom", HEAD, "--settings", "missing.json", "--out", "x.npz"], "missing.json does not exist"),
        (["bake-tables", "--ior", 0.9, "--out", "x"], "--ior must be"),
        (["bake-tables", "--sigma-a", -1, 0, 0, "--out", "x"], "--sigma-a must be"),
        (["bake-tables", "--mode", "energy", "--roughness", 1.5, "--out", "x"], "--roughness must be"),
        (["settings", "--color", 1, 0, 0, "--melanin", 0.2, "--out", "x.json"], "--melanin and --color exclude each"),
        (["render", "missing.blend", "--out", "x.png"], "missing.blend does not exist"),
        (["render", HEAD.with_name("none.blend"), "--out", "x.gif"], "none.blend does not exist"),
        (["info", "missing.npz"], "missing.npz cannot be read"),
    ],
)
def test_failures_are_one_sentence_with_status_1(tmp_path, monkeypatch, arguments, reported):
    monkeypatch.chdir(tmp_path)
    ended = run_here(*arguments)
    assert (ended.status, ended.out) == (1, "")
    assert reported in ended.errors and len(ended.errors.splitlines()) == 1
    assert ended.errors.startswith("vellus: ")
    assert list(tmp_path.iterdir()) == []


def test_rendering_needs_a_camera_an_extension_and_a_frame_number(shot, tmp_path):
    bpy.context.scene.camera = None
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "blind.blend"))
    for blend, out, reported, *options in (
        (tmp_path / "blind.blend", "a.png", "no camera"),
        (tmp_path / "blind.blend", "a.png", "no camera", "--engine", "cycles"),
        (shot, "a.gif", "saved as .png or .exr"),
        (shot, "a.png", "add ####", "--frames", "1-3"),
        (shot, "a.png", "add ####", "--frames", "all"),
        (shot, "a.png", "Width must be", "--width", 0),
    ):
        ended = run_here("render", blend, *options, "--out", tmp_path / out)
        assert ended.status == 1 and reported in ended.errors, ended.errors
    assert not list(tmp_path.glob("a*"))


@pytest.mark.parametrize(
    ("arguments", "reported"),
    [
        ([], "VERB"),
        (["comb"], "comb"),
        (["groom"], "input, --out"),
        (["groom", "a.obj", "--out", "b.npz", "--guides", "many"], "many"),
        (["groom", "a.obj", "--out", "b.npz", "--guide", "3"], "--guide"),
        (["groom", "a.obj", "--out", "b.npz", "--mode", "magic"], "magic"),
        (["render", "a.blend", "--out", "b.png", "--frames", "one"], "not a frame, a range"),
        (["render", "a.blend", "--out", "b.png", "--frames", "1-"], "not a frame, a range"),
        (["render", "a.blend", "--out", "b.png", "--frames", "1-2-3"], "not a frame, a range"),
        (["render", "a.blend", "--out", "b.png", "--frames", ""], "not a frame, a range"),
        (["render", "a.blend", "--out", "b.png", "--frames", "9-3"], "empty range"),
        (["render", "a.blend", "--out", "b.png", "--engine", "pencil"], "pencil"),
    ],
)
def test_invalid_arguments_are_one_sentence_with_status_2(capfd, arguments, reported):
    capfd.readouterr()
    assert run_here(*arguments).status == 2
    told = capfd.readouterr()
    assert told.out == "" and reported in told.err
    assert len(told.err.splitlines()) == 1 and told.err.startswith("vellus: ")


def test_statuses_are_those_of_the_process():
    assert run("settings", "--out", "pyproject.toml/a.json").status == 1
    assert run("comb").status == 2


def test_every_verb_explains_itself(capsys):
    assert run_here("--help").status == 0
    helped = capsys.readouterr()
    assert "bake-tables" in helped.out and helped.err == ""
    for verb in ("groom", "bake-tables", "render", "export", "info", "settings"):
        assert run_here(verb, "--help").status == 0
        assert "--json" in capsys.readouterr().out


@pytest.mark.farm
def test_json_output_contains_only_results(mesh, tmp_path):
    """JSON output contains only results, whatever importers, exporters and Warp print on standard output."""
    groom = ("groom", mesh, *SMALL, "--out", tmp_path / "a.usdc", "--json")
    ended = run(*groom)
    assert (ended.status, ended.errors) == (0, "")
    (result,) = ended.results
    assert (result["guides"], result["strands"], result["points"]) == (20, 100, 4100)
    assert result["bytes"] == (tmp_path / "a.usdc").stat().st_size
    told = run("info", mesh, "--json", "--verbose")
    assert len(told.results) == 1 and "OBJ import" in told.errors


def test_quiet_output_is_what_programs_asked_for(tmp_path):
    bake = ("bake-tables", "--size", 32, "--out", tmp_path, "--quiet")
    assert run_here(*bake) == Ended(0, "", "")
    assert run_here(*bake, "--json").results[0]["verb"] == "bake-tables"


@pytest.mark.parametrize("engine", ["vellus", "cycles"])
@pytest.mark.parametrize("kind", ["VIDEO", "MULTI_LAYER_IMAGE"])
def test_the_scene_s_output_settings_are_restored(lit, tmp_path, engine, kind):
    scene = bpy.context.scene
    scene.cycles.samples = 1
    image = scene.render.image_settings
    image.media_type = kind
    before = (image.media_type, image.file_format, scene.render.engine, scene.render.resolution_x)
    api.render(tmp_path / "a.png", engine=engine, width=32, height=24)
    assert picture(tmp_path / "a.png").shape == (24, 32, 4)
    assert (image.media_type, image.file_format, scene.render.engine, scene.render.resolution_x) == before
