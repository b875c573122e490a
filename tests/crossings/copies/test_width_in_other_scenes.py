# SPDX-License-Identifier: GPL-3.0-or-later
"""Each scene to which hair is added gets the setting for EEVEE's strand width."""

import bpy
import pytest

from hair_addon.blender.data import thin_hair
from tests.support.pictures import render_probe


@pytest.fixture
def character(hair, tmp_path):
    """Return the file of a collection with hair."""
    collection = bpy.data.collections.new("Character")
    for part in (bpy.data.objects[name] for name in ("Sphere", "Guides", "Hair")):
        bpy.context.scene.collection.objects.unlink(part)
        collection.objects.link(part)
    bpy.context.scene.collection.children.link(collection)
    path = tmp_path / "character.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


@pytest.fixture
def rendered_type():
    """Return a function that renders a scene in the background, and returns how that render draws hair."""
    with render_probe.reading(lambda depsgraph: depsgraph.scene_eval.render.hair_type) as render:
        yield lambda scene: render(scene)[0]


def bring(way, path):
    """Link the character to the scene of an empty file without an update, as a script does."""
    scene, within = bpy.context.scene, {"directory": f"{path}/Collection/", "filename": "Character"}
    if way == "appended":
        bpy.ops.wm.append(**within)
    elif way == "linked":
        bpy.ops.wm.link(**within, instance_collections=False)
    elif way == "instanced":
        bpy.ops.wm.link(**within, instance_collections=True)
    elif way == "overridden":
        bpy.ops.wm.link(**within, instance_collections=False)
        bpy.data.collections["Character"].override_hierarchy_create(scene, bpy.context.view_layer)
    else:
        with bpy.data.libraries.load(str(path), link=False) as (_there, here):
            here.collections = ["Character"]
        scene.collection.children.link(bpy.data.collections["Character"])


@pytest.mark.parametrize("way", ["appended", "linked", "instanced", "overridden", "loaded"])
def test_a_shot_draws_a_character_that_it_brings_in_as_thin_as_it_is(character, rendered_type, way):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bring(way, character)
    scene = bpy.context.scene
    assert rendered_type(scene) == "STRIP"
    scene.render.hair_type = "STRAND"  # as the artist wants it from now on
    bpy.context.view_layer.update()
    assert rendered_type(scene) == "STRAND"
    bpy.ops.wm.save_as_mainfile(filepath=str(character.with_name("shot.blend")))
    bpy.ops.wm.open_mainfile(filepath=str(character.with_name("shot.blend")))
    assert rendered_type(bpy.context.scene) == "STRAND"


def test_scenes_beside_it_draw_the_same_hair_as_thin(character, rendered_type):
    new, behind, without = (bpy.data.scenes.new(name) for name in ("New", "Set", "Without"))
    new.collection.children.link(bpy.data.collections["Character"])
    behind.background_set = new
    assert rendered_type(new) == "STRIP"
    assert [scene.render.hair_type for scene in (behind, without)] == ["STRIP", "STRAND"]
    new.render.hair_type = "CYLINDER"
    bpy.context.window.scene = new
    bpy.ops.scene.new(type="FULL_COPY")
    assert rendered_type(bpy.context.scene) == "CYLINDER"


def test_it_is_set_at_the_next_update(character):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bring("loaded", character)
    bpy.context.view_layer.update()
    assert bpy.context.scene.render.hair_type == "STRIP"


def test_shots_of_older_files_are_drawn_so_when_they_are_opened(character, monkeypatch):
    with monkeypatch.context() as older:
        older.setattr(thin_hair, "follow", lambda _scenes: None)
        del bpy.context.scene["vellus_thin_hair"]
        bpy.context.scene.render.hair_type = "STRAND"
        bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=str(character))
    assert bpy.context.scene.render.hair_type == "STRIP"
