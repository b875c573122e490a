# SPDX-License-Identifier: GPL-3.0-or-later
"""Every operator has its result and its undo, and refuses without changes."""

import math

import bpy
import numpy as np
import pytest

from hair_addon.blender.live import invalidation
from hair_addon.blender.render import hair_cache
from hair_addon.blender.settings import properties, setting_properties
from hair_addon.core.files import table_exr
from hair_addon.core.grooming import groom_defaults
from hair_addon.core.grooming.groom import GuideSettings, HairSettings
from hair_addon.core.params import declared
from hair_addon.core.shading import appearance, presets
from hair_addon.core.shading.appearance import Appearance
from hair_addon.core.shading.tables import lookup_tables
from tests.support.reading import points, snapshot


def refusal(operator, **arguments):
    """Return the sentence with which an operator refuses, and check that the file is unchanged."""
    before = snapshot()
    with pytest.raises(RuntimeError) as caught:
        operator(**arguments)
    assert snapshot() == before
    return str(caught.value)


@pytest.fixture
def camera(scene):
    """Return the scene's camera, four meters in front of the origin."""
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, -6.0, 0.0), (math.pi / 2, 0.0, 0.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    return camera


def test_guides_and_hair_are_made_as_asked(hair):
    guides = bpy.data.objects["Guides"]
    assert points(guides).shape == (60, 41, 3)
    assert points(hair).shape == (500, 41, 3)
    assert hair.data.vellus.guide_curves == guides.data


def test_settings_stay_with_what_they_made(hair):
    settings = setting_properties.to_settings(hair.data.vellus.hair, HairSettings)
    assert settings == HairSettings(strand_count=500, radius=0.004, influence_distance=0.03)
    settings = setting_properties.to_settings(bpy.data.objects["Guides"].data.vellus.guides, GuideSettings)
    assert settings == GuideSettings(guide_count=60, length=0.5, gravity=groom_defaults.FUR_GRAVITY, relax_iterations=0)


def test_same_seed_same_strands(hair):
    first = points(hair)
    bpy.ops.vellus.interpolate_hair(strand_count=500, radius=0.004, seed=2)
    other = points(hair)
    bpy.ops.vellus.interpolate_hair(strand_count=500, radius=0.004, seed=1)
    assert np.array_equal(points(hair), first)
    assert not np.array_equal(other, first)


def test_operators_run_again_on_what_they_made(guides):
    bpy.ops.vellus.distribute_guides(guide_count=30)
    assert [c.name for c in bpy.data.hair_curves] == ["Guides"]
    assert len(guides.data.curves) == 30


# Of no one file: paths, and libraries of the user's preferences.
REMEMBERED = {"filepath", "directory", "folder", "filter_glob", "library", "catalog"}


def test_what_names_data_is_not_remembered():
    """Properties that name data are not remembered, as Blender would call the operator with names that may be
    missing.
    """
    remembered = {
        (name, rna.identifier)
        for name in dir(bpy.ops.vellus)
        for rna in getattr(bpy.ops.vellus, name).get_rna_type().properties
        if rna.type == "STRING" and not rna.is_skip_save and rna.identifier not in REMEMBERED
    }
    assert not remembered


def test_a_mask_does_not_stay_for_the_next_mesh(sphere):
    bpy.ops.vellus.distribute_guides("EXEC_DEFAULT", True, guide_count=10, density_group="top")
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.vellus.distribute_guides("EXEC_DEFAULT", True)
    assert sorted(len(curves.curves) for curves in bpy.data.hair_curves) == [10, 10]


def test_a_mesh_may_carry_several_systems(sphere):
    bpy.ops.vellus.distribute_guides(guide_count=10)
    bpy.ops.vellus.distribute_guides(guide_count=20)
    assert sorted(len(c.curves) for c in bpy.data.hair_curves) == [10, 20]


def test_density_keeps_guides_and_strands_in_their_group(sphere):
    bpy.ops.vellus.distribute_guides(guide_count=40, density_group="top")
    bpy.ops.vellus.interpolate_hair(strand_count=300, density_group="top")
    lowest = 0.2  # one ring of faces below the group's border, where its weight runs out
    for name in ("Guides", "Hair"):
        assert points(bpy.data.objects[name])[:, 0, 2].min() > -lowest


def test_undo_takes_guides_away_and_redo_brings_them_back(sphere):
    bpy.ops.vellus.distribute_guides("EXEC_DEFAULT", True, guide_count=25)
    made = points(bpy.data.objects["Guides"])
    bpy.ops.ed.undo()
    assert "Guides" not in bpy.data.objects
    bpy.ops.ed.redo()
    assert np.array_equal(points(bpy.data.objects["Guides"]), made)


def test_nothing_is_done_without_a_mesh(scene):
    assert not bpy.ops.vellus.distribute_guides.poll()
    assert not bpy.ops.vellus.interpolate_hair.poll()
    assert not bpy.ops.vellus.render_picture.poll()


def test_a_light_is_no_surface(scene):
    light = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    scene.collection.objects.link(light)
    bpy.context.view_layer.objects.active = light
    assert not bpy.ops.vellus.distribute_guides.poll()


def use_mesh(scene, vertices, faces):
    mesh = bpy.data.meshes.new("Bad")
    mesh.from_pydata(vertices, [], faces)
    bad = bpy.data.objects.new("Bad", mesh)
    scene.collection.objects.link(bad)
    bpy.context.view_layer.objects.active = bad
    return bad


@pytest.mark.parametrize(
    ("vertices", "faces", "reported"),
    [
        ([], [], "no faces"),
        ([(0, 0, 0), (1, 0, 0)], [], "no faces"),
        ([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1, 2)], "zero area"),
        ([(0, 0, 0), (1, 0, 0), (0, math.nan, 0)], [(0, 1, 2)], "non-finite"),
        ([(0, 0, 0), (1, 0, 0), (0, math.inf, 0)], [(0, 1, 2)], "non-finite"),
    ],
)
def test_a_mesh_that_cannot_grow_hair_is_refused(scene, vertices, faces, reported):
    use_mesh(scene, vertices, faces)
    assert reported in refusal(bpy.ops.vellus.distribute_guides)


def test_a_scale_of_zero_is_refused(sphere):
    sphere.scale = (0.0, 1.0, 1.0)
    bpy.context.view_layer.update()
    assert "scale" in refusal(bpy.ops.vellus.distribute_guides)


def test_a_density_of_zero_is_refused(sphere):
    sphere.vertex_groups.new(name="empty")
    assert "zero everywhere" in refusal(bpy.ops.vellus.distribute_guides, density_group="empty")
    assert "no vertex group" in refusal(bpy.ops.vellus.distribute_guides, density_group="missing")


@pytest.mark.parametrize(("name", "value"), [("length", math.nan), ("tilt", math.nan), ("gravity", math.nan)])
def test_nan_is_refused_for_guides(sphere, name, value):
    assert "must be" in refusal(bpy.ops.vellus.distribute_guides, **{name: value})


def test_nan_is_refused_for_hair(guides):
    reported = refusal(bpy.ops.vellus.interpolate_hair, influence_distance=math.nan, automatic_influence=False)
    assert "Influence distance" in reported


@pytest.mark.parametrize(
    ("operator", "name"), [("distribute_guides", "guide_count"), ("interpolate_hair", "strand_count")]
)
@pytest.mark.parametrize("count", [0, -5])
def test_a_count_below_one_cannot_be_given(guides, operator, name, count):
    """A count below one cannot be given, as Blender keeps an operator's properties in their range."""
    getattr(bpy.ops.vellus, operator)(**{name: count})
    made = max(bpy.data.hair_curves, key=lambda c: c.session_uid) if operator == "interpolate_hair" else guides.data
    assert len(made.curves) == 1


def test_hair_without_guides_is_refused(guides):
    guides.data.remove_curves()
    assert "no guides" in refusal(bpy.ops.vellus.interpolate_hair)


def test_a_lost_surface_is_refused(guides):
    guides.data.surface = None
    assert "mesh" in refusal(bpy.ops.vellus.interpolate_hair)


def test_tables_are_baked_without_any_hair(scene, tmp_path):
    bpy.ops.vellus.bake_tables(directory=str(tmp_path), size=32, tilt=0.1)
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(
        f"{name}.exr" for name in ("m", "n", "n_trt", "dual", "n_g", "n_g_trt")
    )
    assert table_exr.read_tables(tmp_path).settings == lookup_tables.Settings(size=32, tilt=0.1)


@pytest.mark.parametrize("look", [{}, {"mode": "classic", "roughness": 1.0, "tint": (0.3, 0.7, 0.9)}])
def test_tables_of_the_hair_are_baked_and_used(hair, tmp_path, monkeypatch, look):
    state = hair.data.vellus
    state.marschner.size = 32
    for name, value in look.items():
        setattr(state.appearance, name, value)
    bpy.ops.vellus.bake_tables(directory=str(tmp_path))
    assert table_exr.read_tables(tmp_path).settings == properties.table_settings_of(state)
    assert state.table_folder == str(tmp_path)
    monkeypatch.setattr(lookup_tables, "bake", None)  # whoever bakes now fails
    invalidation.clear()
    assert hair_cache.shading_of(hair.data).samplers


def test_tables_of_other_settings_leave_the_look_alone(hair, tmp_path):
    state = hair.data.vellus
    before = properties.look_of(state), properties.table_settings_of(state)
    bpy.ops.vellus.bake_tables(directory=str(tmp_path), size=32, mode="classic", sigma_a=(0.1, 0.2, 0.3))
    found = table_exr.read_tables(tmp_path).settings
    assert (found.mode, found.sigma_a, found.size) == ("classic", (0.1, 0.2, 0.3), 32)
    assert found.radial_roughness == before[1].radial_roughness  # what was not asked for is the hair's
    assert (properties.look_of(state), properties.table_settings_of(state)) == before
    assert state.table_folder == str(tmp_path)


def sockets(hair):
    node = next(n for n in hair.data.materials[0].node_tree.nodes if n.bl_idname == "ShaderNodeBsdfHairPrincipled")
    return {s.identifier: np.array(s.default_value) for s in node.inputs if hasattr(s, "default_value")}


@pytest.mark.parametrize("preset", presets.PRESETS)
def test_every_preset_is_applied_whole(hair, preset):
    """Every preset sets all of its settings and the material, and keeps how hair is drawn."""
    look = presets.PRESETS[preset][1]
    state = hair.data.vellus
    unlike = Appearance(mode="classic", parametrization="ABSORPTION", tint=(0.1, 0.2, 0.3), random_color=1.0, coat=1.0)
    setting_properties.assign(state.appearance, unlike)
    assert bpy.ops.vellus.apply_preset(preset=preset) == {"FINISHED"}
    found = properties.look_of(state)
    assert found.mode == "classic"
    for name, *_ in declared(Appearance):
        if name not in ("mode", "parametrization"):
            np.testing.assert_allclose(getattr(found, name), getattr(look, name), rtol=1e-6, err_msg=name)
    assert found.parametrization == look.parametrization
    for name, value in appearance.principled_sockets(look).items():
        np.testing.assert_allclose(sockets(hair)[name], value, rtol=1e-5, err_msg=name)
    assert properties.table_settings_of(state).sigma_a == pytest.approx(appearance.sigma_a(look), rel=1e-5)


def test_undo_takes_a_preset_back(hair):
    bpy.ops.ed.undo_push(message="made")
    before, sockets_before = properties.look_of(hair.data.vellus), sockets(hair)
    bpy.ops.vellus.apply_preset("EXEC_DEFAULT", True, preset="WET_BLOND")
    assert properties.look_of(hair.data.vellus) != before
    bpy.ops.ed.undo()
    bpy.context.view_layer.update()
    hair = bpy.data.objects["Hair"]
    assert properties.look_of(hair.data.vellus) == before
    for name, value in sockets(hair).items():
        np.testing.assert_array_equal(value, sockets_before[name], err_msg=name)


def test_a_preset_needs_hair(guides):
    assert not bpy.ops.vellus.apply_preset.poll()


def test_a_folder_that_cannot_be_written_is_refused(hair, tmp_path):
    in_the_way = tmp_path / "file"
    in_the_way.write_text("here first")
    assert str(in_the_way) in refusal(bpy.ops.vellus.bake_tables, directory=str(in_the_way))
    assert in_the_way.read_text() == "here first"
    assert "No file or folder" in refusal(bpy.ops.vellus.bake_tables, directory="")


def test_a_path_beside_an_unsaved_file_is_refused(hair):
    assert "save" in refusal(bpy.ops.vellus.bake_tables, directory="//tables")


@pytest.fixture
def user_folder(tmp_path, monkeypatch):
    """Return an empty user folder of Blender, with the add-on as if it were an installed extension."""
    monkeypatch.setattr(hair_cache.preferences, "ADDON_MODULE", "bl_ext.user_default.vellus")
    made = tmp_path / "user"

    def extension_path_user(module, *, path, create):
        assert module == "bl_ext.user_default.vellus" and create
        (made / path).mkdir(parents=True, exist_ok=True)
        return str(made / path)

    monkeypatch.setattr(bpy.utils, "extension_path_user", extension_path_user)
    return made


def test_tables_are_found_again_in_another_session(hair, user_folder, monkeypatch):
    hair.data.vellus.marschner.size = 32
    invalidation.clear()
    hair_cache.shading_of(hair.data)
    (cached,) = (user_folder / "tables").iterdir()
    assert table_exr.read_tables(cached).settings == properties.table_settings_of(hair.data.vellus)
    bakes = []
    bake = lookup_tables.bake
    monkeypatch.setattr(lookup_tables, "bake", lambda *arguments: bakes.append(arguments) or bake(*arguments))
    invalidation.clear()
    hair_cache.shading_of(hair.data)
    assert bakes == []
    (cached / "n.exr").write_bytes(b"damaged")
    invalidation.clear()
    hair_cache.shading_of(hair.data)
    assert len(bakes) == 1
    assert table_exr.read_tables(cached).settings == properties.table_settings_of(hair.data.vellus)


def test_a_checkout_caches_nothing(hair, monkeypatch):
    monkeypatch.setattr(bpy.utils, "extension_path_user", None)  # whoever asks for the folder fails
    invalidation.clear()
    assert hair_cache.cache_folder() is None
    assert hair_cache.shading_of(hair.data).samplers


def test_an_uncreatable_cache_folder_is_ignored(hair, user_folder, monkeypatch):
    monkeypatch.setattr(bpy.utils, "extension_path_user", lambda *_arguments, **_named: "")
    invalidation.clear()
    assert hair_cache.shading_of(hair.data).samplers


def test_a_picture_is_written(hair, camera, tmp_path):
    path = tmp_path / "hair.png"
    bpy.ops.vellus.render_picture(filepath=str(path), width=64, height=48, samples_per_side=2)
    image = bpy.data.images.load(str(path))
    assert tuple(image.size) == (64, 48)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("name", ["hair.jpg", "hair", "folder/in/the/way/../../file/hair.png"])
def test_a_picture_that_cannot_be_written_is_refused(hair, camera, tmp_path, name):
    (tmp_path / "folder" / "in").mkdir(parents=True)
    (tmp_path / "folder" / "in" / "file").write_text("here first")
    refusal(bpy.ops.vellus.render_picture, filepath=str(tmp_path / name), width=8, height=8, samples_per_side=1)


def test_a_damaged_table_is_refused_by_the_picture(hair, camera, tmp_path):
    bpy.ops.vellus.bake_tables(directory=str(tmp_path), size=32)
    table = tmp_path / "n.exr"
    table.write_bytes(table.read_bytes()[:300])
    reported = refusal(bpy.ops.vellus.render_picture, filepath=str(tmp_path / "p.png"), width=8, height=8)
    assert "n.exr" in reported
    assert not (tmp_path / "p.png").exists()


def test_tables_of_other_settings_are_not_used(hair, camera, tmp_path):
    """Tables of other settings are not used: a folder of blond tables does not turn brown hair blond."""

    def picture(name):
        path = tmp_path / name
        bpy.ops.vellus.render_picture(filepath=str(path), width=32, height=32, samples_per_side=1)
        return path.read_bytes()

    own = picture("own.exr")
    table_exr.write_tables(tmp_path / "blond", lookup_tables.bake(lookup_tables.Settings(sigma_a=(0.0, 0.0, 0.0))), "0")
    hair.data.vellus.table_folder = str(tmp_path / "blond")
    assert picture("other.exr") == own
