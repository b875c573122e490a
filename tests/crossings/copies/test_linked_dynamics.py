# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulated characters linked by a shot are baked in the shot, and move as in their own file."""

import shutil

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom.dynamics import frame_folders, guide_baking
from hair_addon.core.long_work import run_now
from tests.support.dynamics.swung import simulate, swing
from tests.support.pairs import share_of
from tests.support.reading import evaluated_points, points

FRAME = 7
HOW_MANY = '"Hair" keeps the {} strands of its file: change them there.'


@pytest.fixture
def character(hair, tmp_path):
    """Return (file of hair that swings, without baked frames; its points in a frame)."""
    surface, guides = bpy.data.objects["Sphere"], bpy.data.objects["Guides"]
    collection = bpy.data.collections.new("Character")
    for part in (surface, guides, hair):
        for before in part.users_collection:
            before.objects.unlink(part)
        collection.objects.link(part)
    bpy.context.scene.collection.children.link(collection)
    swing(surface)
    simulate(guides, "//haircache")
    path = tmp_path / "library" / "character.blend"
    path.parent.mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bake()
    bpy.context.scene.frame_set(FRAME)
    there = points(hair)
    return path, there


def bake(last=FRAME):
    run_now(guide_baking.baking(frame_folders.simulating(), last, bpy.context.scene))


def shot_of(path, folder, way):
    """Save a new file that links a character, and return its path."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    shot = folder / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(shot))
    with bpy.data.libraries.load(str(path), link=True, relative=True) as (_there, here):
        here.collections = ["Character"]
    character, scene = bpy.data.collections["Character"], bpy.context.scene
    if way == "instance":
        instance = bpy.data.objects.new("Character", None)
        instance.instance_type, instance.instance_collection = "COLLECTION", character
        scene.collection.objects.link(instance)
    else:
        scene.collection.children.link(character)
    if way == "override":
        character.override_hierarchy_create(scene, bpy.context.view_layer)
    if way == "local hair":
        next(o for o in bpy.data.objects if o.name == "Hair").data.make_local()
    bpy.context.view_layer.update()
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=str(shot))
    return shot


def shown_hair():
    """Return the object of the hair in the shot."""
    found = [o for o in bpy.data.objects if o.type == "CURVES" and o.data.vellus.kind == "HAIR"]
    return next((o for o in found if o.override_library is not None), found[0])


@pytest.mark.parametrize("way", share_of(["linked", "instance", "override", "local hair"]))
def test_a_shot_bakes_and_shows_a_linked_character(character, tmp_path, way):
    path, there = character
    in_library = path.read_bytes()
    shot = shot_of(path, tmp_path, way)
    hair, scene = shown_hair(), bpy.context.scene
    combed = points(hair)
    (guides,) = frame_folders.simulating()
    bake()
    assert frame_folders.folder_of(guides).parent == tmp_path / "haircache"
    scene.frame_set(FRAME)
    np.testing.assert_allclose(points(hair), there, atol=1e-6)
    np.testing.assert_allclose(evaluated_points(hair), there, atol=1e-6)
    scene.frame_set(1)
    np.testing.assert_allclose(points(hair), combed, atol=1e-6)
    scene.frame_set(FRAME)
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=str(shot))
    bpy.context.scene.frame_set(FRAME)
    np.testing.assert_allclose(points(shown_hair()), there, atol=1e-6)
    assert path.read_bytes() == in_library


@pytest.mark.parametrize("way", ["linked", "local"])
def test_linked_hair_keeps_its_strands_and_local_hair_between_linked_guides_does_not(character, tmp_path, way):
    """Linked hair keeps its strands, and local hair between linked guides is refused with a sentence and stays as it
    was.
    """
    path, there = character
    shot_of(path, tmp_path, "linked")
    bpy.context.scene.frame_set(FRAME)
    hair = shown_hair().data if way == "linked" else shown_hair().data.copy()
    hair.vellus.hair.strand_count = wanted = len(there) // 2
    bpy.context.view_layer.update()
    if way == "local":
        assert (len(hair.curves), hair.vellus.status) == (wanted, "")
    else:
        assert (len(hair.curves), hair.vellus.status) == (len(there), HOW_MANY.format(len(there)))


def test_frames_that_are_baked_in_the_library_play_in_the_shot(character, tmp_path):
    path, there = character
    shot_of(path, tmp_path, "linked")
    bpy.context.scene.frame_set(FRAME)
    np.testing.assert_allclose(points(shown_hair()), there, atol=1e-6)


def test_a_shot_has_settings_of_its_own(character, tmp_path):
    path, there = character
    shot = shot_of(path, tmp_path, "override")
    (guides,) = frame_folders.simulating()
    guides.vellus.dynamics.gravity = -2.0
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=str(shot))
    (guides,) = frame_folders.simulating()
    assert guides.vellus.dynamics.gravity == -2.0
    bake()
    bpy.context.scene.frame_set(FRAME)
    assert np.abs(points(shown_hair()) - there).max() > 1e-3


def test_characters_of_files_with_one_name_have_frames_of_their_own(character, tmp_path):
    """Characters in files of one name in two folders have separate frames, also when the project is moved."""
    path, _there = character
    project, moved = tmp_path / "project", tmp_path / "moved"
    for owner in ("one", "other"):
        (project / owner).mkdir(parents=True)
        shutil.copy(path, project / owner)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(project / "shot.blend"))
    for owner in ("one", "other"):
        with bpy.data.libraries.load(str(project / owner / path.name), link=True, relative=True) as (_there, here):
            here.collections = ["Character"]
    for collection in bpy.data.collections:
        bpy.context.scene.collection.children.link(collection)
    bpy.ops.wm.save_mainfile()
    bake(2)
    folders = sorted(frame_folders.folder_of(guides).name for guides in frame_folders.simulating())
    assert len(set(folders)) == 2
    assert sorted(folder.name for folder in (project / "haircache").iterdir()) == folders
    project.rename(moved)
    bpy.ops.wm.open_mainfile(filepath=str(moved / "shot.blend"))
    for guides in frame_folders.simulating():
        assert frame_folders.frames_of(guides).frame_numbers() == [1, 2, 3]


def test_shots_in_one_folder_have_frames_of_their_own(character, tmp_path):
    """Shots in one folder have separate frames, except that a shot saved from another plays its frames until it is
    baked.
    """
    path, there = character
    shutil.rmtree(path.parent / "haircache")
    first = shot_of(path, tmp_path, "linked")
    bake()
    (guides,) = frame_folders.simulating()
    folder = frame_folders.folder_of(guides)
    kept = {file.name: file.read_bytes() for file in folder.iterdir()}
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "other.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "other.blend"))
    (guides,) = frame_folders.simulating()
    assert frame_folders.folder_of(guides) != folder
    bpy.context.scene.frame_set(FRAME)
    np.testing.assert_allclose(points(shown_hair()), there, atol=1e-6)
    bpy.context.scene.gravity[2] = 3.0
    bake()
    bpy.context.scene.frame_set(FRAME)
    assert np.abs(points(shown_hair()) - there).max() > 1e-3
    assert {file.name: file.read_bytes() for file in folder.iterdir()} == kept
    bpy.ops.wm.open_mainfile(filepath=str(first))
    bpy.context.scene.frame_set(FRAME)
    np.testing.assert_allclose(points(shown_hair()), there, atol=1e-6)
