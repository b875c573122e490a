# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings saved from the panel can be loaded on the same hair, on other hair, and on a mesh without hair."""

from dataclasses import asdict

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom.transfer import groom_settings
from hair_addon.core.dynamics.rod.settings import DynamicsSettings
from hair_addon.core.files import settings_file
from hair_addon.core.files.settings_file import GroomSettings
from hair_addon.core.grooming import groom_defaults
from hair_addon.core.grooming.groom import GuideSettings, HairSettings
from hair_addon.core.shading.appearance import Appearance
from hair_addon.core.shading.tables import lookup_tables
from hair_addon.core.styling import clump, curl
from tests.support.interface.layout import draw_all
from tests.support.reading import points, snapshot

WANTED = GroomSettings(
    GuideSettings(guide_count=33, seed=5, length=0.2, gravity=0.6),
    HairSettings(strand_count=70, radius=0.003, influence_distance=0.4),
    Appearance(melanin=0.3, mode="classic"),
    lookup_tables.Settings(size=64, eccentricity=0.9),
    (clump.Settings(size=0.3, levels=3), curl.Settings(radius=0.004), curl.Settings(is_on=False, seed=7)),
    ("Locks", "Curl", "Curl.001"),
    DynamicsSettings(bend_stiffness=20.0, hold=0.3, colliders="Body", vertex_count=33),
)


@pytest.fixture
def path(tmp_path):
    settings_file.write(tmp_path / "wanted.json", WANTED)
    return str(tmp_path / "wanted.json")


def settings_of(name="Hair"):
    return groom_settings.settings_of(bpy.data.objects[name].data)


@pytest.mark.parametrize("active", ["Sphere", "Guides", "Hair"])
def test_settings_are_saved_as_they_are(hair, tmp_path, active):
    bpy.context.view_layer.objects.active = bpy.data.objects[active]
    hair.data.vellus.appearance.mode = "classic"
    assert bpy.ops.vellus.save_groom_settings(filepath=str(tmp_path / "groom")) == {"FINISHED"}
    saved = settings_file.read(tmp_path / "groom.json")
    assert saved == settings_of()
    assert saved.guides == GuideSettings(
        guide_count=60, length=0.5, gravity=groom_defaults.FUR_GRAVITY, relax_iterations=0
    )
    assert saved.hair == HairSettings(strand_count=500, radius=0.004, influence_distance=0.03)
    assert saved.appearance == Appearance(mode="classic")
    assert saved.tables == lookup_tables.Settings()
    assert saved.dynamics == DynamicsSettings()


@pytest.mark.parametrize("active", ["Sphere", "Guides", "Hair"])
def test_settings_are_applied_to_existing_hair(hair, path, active):
    bpy.context.view_layer.objects.active = bpy.data.objects[active]
    names = snapshot()["curves"]
    assert bpy.ops.vellus.load_groom_settings(filepath=path) == {"FINISHED"}
    assert settings_of() == WANTED
    assert snapshot()["curves"] == names
    assert (len(points(bpy.data.objects["Guides"])), len(points(hair))) == (33, 70)


def test_hair_grows_on_a_mesh_without_any(sphere, path):
    assert bpy.ops.vellus.load_groom_settings(filepath=path) == {"FINISHED"}
    assert settings_of() == WANTED
    assert bpy.context.object == bpy.data.objects["Hair"]
    grown = points(bpy.data.objects["Hair"])
    bpy.context.view_layer.objects.active = sphere
    bpy.ops.vellus.load_groom_settings(filepath=path)  # the same settings again: nothing moves
    assert np.array_equal(points(bpy.data.objects["Hair"]), grown)


def test_one_undo_reverts_the_settings(hair, path):
    before, grown = settings_of(), points(hair)
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.vellus.load_groom_settings("EXEC_DEFAULT", True, filepath=path)
    bpy.ops.ed.undo()
    assert settings_of() == before
    assert np.array_equal(points(bpy.data.objects["Hair"]), grown)


@pytest.mark.parametrize(
    ("text", "reported"),
    [
        ("{", "invalid JSON"),
        ('{"format": "Vellus groom settings", "version": 99}', "newer Vellus"),
        (
            '{"format": "Vellus groom settings", "version": 1, "hair": {"radius": -1}}',
            'value for "hair.radius"',
        ),
    ],
)
@pytest.mark.parametrize("active", ["Hair", "Bare"])
def test_an_invalid_settings_file_changes_nothing(hair, tmp_path, text, reported, active):
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.name = "Bare"
    bpy.context.view_layer.objects.active = bpy.data.objects[active]
    (tmp_path / "bad.json").write_text(text)
    before, settings_before = snapshot(), asdict(settings_of())
    with pytest.raises(RuntimeError) as refused:
        bpy.ops.vellus.load_groom_settings(filepath=str(tmp_path / "bad.json"))
    assert reported in str(refused.value) and "Traceback" not in str(refused.value)
    assert (snapshot(), asdict(settings_of())) == (before, settings_before)


def test_nothing_is_saved_without_hair_or_without_a_name(sphere, hair):
    assert bpy.ops.vellus.save_groom_settings.poll()
    with pytest.raises(RuntimeError, match="pick one"):
        bpy.ops.vellus.save_groom_settings(filepath="")
    bpy.ops.mesh.primitive_cube_add()
    assert not bpy.ops.vellus.save_groom_settings.poll()
    assert bpy.ops.vellus.load_groom_settings.poll()


def test_the_output_panel_offers_both(hair):
    drawn = draw_all([bpy.types.VELLUS_PT_output])
    assert drawn["vellus.save_groom_settings"] == drawn["vellus.load_groom_settings"] == 1
