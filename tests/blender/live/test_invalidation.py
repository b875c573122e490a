# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawing never uses cached data older than an event, and no data remain after opening a file or disabling the
add-on.
"""

import importlib
import inspect
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

import hair_addon
from hair_addon import api
from hair_addon.blender.data import scene as scene_door
from hair_addon.blender.host import running
from hair_addon.blender.host.caches import Cache
from hair_addon.blender.live import events, invalidation
from hair_addon.blender.render import hair_cache
from hair_addon.blender.render.viewport import hair_picture, viewport
from tests.blender.gpu.test_world_texture import environment_node
from tests.blender.ui.test_own_modifiers import add_asset
from tests.support.invariants import changed
from tests.support.pictures.viewports import context_of, view3d
from tests.support.reading import points, write_points
from tests.test_conventions import ADDON, MODULES

SIZE = 24


# ------------------------------------------------------------------------------------------------------- the table


def every_cache():
    """Return {location: cache} of all modules."""
    names = [".".join(path.relative_to(ADDON).with_suffix("").parts) for path in MODULES]
    modules = [importlib.import_module(f"hair_addon.{name}") for name in names if not name.endswith("__")]
    return {
        f"{module.__name__}.{name}": value
        for module in modules
        for name, value in vars(module).items()
        if isinstance(value, Cache)
    }


def test_the_table_names_every_cache_once():
    assert len({*invalidation.CACHES}) == len(invalidation.CACHES)
    assert {*every_cache().values()} == {*invalidation.CACHES}


@pytest.fixture
def full(hair):
    """Fill every cache."""
    for cache in every_cache().values():
        cache.keep("something", "kept")


def filled():
    return {cache for cache in every_cache().values() if len(cache)}


def test_another_file_leaves_programs_alone(full):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert filled() == {*invalidation.PROGRAMS}


def test_undo_leaves_no_copy_of_data(full):
    changed("before")
    changed("after")
    bpy.ops.ed.undo()
    kept = {cache for cache in every_cache().values() if cache.get("something")}
    assert kept == {*invalidation.OTHERS, *invalidation.PROGRAMS}


def test_the_addon_leaves_programs_when_it_is_switched_off(full):
    hair_addon.unregister()
    try:
        assert filled() == {*invalidation.PROGRAMS}
    finally:
        hair_addon.register()


def test_nothing_is_left_when_python_ends(full, monkeypatch):
    for cache in invalidation.PROGRAMS:  # the process still needs programs after this test
        monkeypatch.setattr(cache, "_values", dict(cache._values))
    invalidation.end()
    assert not filled()


# ------------------------------------------------------------------------------------------------------ the events


@pytest.fixture
def stage(lit, monkeypatch):
    """Return hair on a surface that a modifier may bend, lit by a sun and by a world's image."""
    monkeypatch.setattr(hair_picture, "SAMPLE_COUNT", 4)
    restart = hair_picture.HairPicture.restart

    def restart_with_the_same_samples(picture, is_moved=False):
        """Start passes with the same samples and spreads again, as others after a movement would change the picture
        by their noise.
        """
        restart(picture, is_moved)
        picture._first_turn, picture._spreads = 0, hair_picture._SPREADS

    monkeypatch.setattr(hair_picture.HairPicture, "restart", restart_with_the_same_samples)
    image = bpy.data.images.new("Sky", 16, 8)
    image.generated_color = (0.2, 0.4, 0.8, 1.0)
    environment_node(bpy.context.scene, image)
    changed("stage")
    return image


def seen():
    """Return the arrays that a viewport shows, by name."""
    context, space = bpy.context, view3d()
    space.shading.type = "MATERIAL"
    space.shading.use_scene_lights = space.shading.use_scene_world = True
    drawn = viewport.drawn_scene_of(context_of(space))
    camera = scene_door.read_camera(context.scene, context.evaluated_depsgraph_get(), SIZE, SIZE)
    view = SimpleNamespace(view_matrix=camera[0], window_matrix=camera[1])
    region = SimpleNamespace(width=SIZE, height=SIZE, as_pointer=lambda: 1)
    region_picture = viewport._picture(drawn, view, region, is_see_through=False)
    while not region_picture.picture.is_fine:
        region_picture = viewport._picture(drawn, view, region, is_see_through=False)
    (strands, shading, *_place), guides = drawn.hair[0], hair_cache.strands_on_gpu(bpy.data.hair_curves["Guides"])
    return {
        "picture": region_picture.picture.read_shown(),
        "strands": np.array(strands.texture.read()),
        "strands here": strands.points,
        "guides": np.array(guides.texture.read()),
        "forward": shading.forward,
        "lights": np.array(drawn.lights.tobytes()),
    }


def sculpt():
    """Edit the hair itself, as by a tool other than its guides."""
    sculpted = points(bpy.data.objects["Hair"])
    sculpted[:, -1] += np.float32([0.3, 0.0, 0.2])
    write_points(bpy.data.objects["Hair"], sculpted)


def regrow():
    """Change the length of guides, which are drawn before Blender has reported the change."""
    bpy.data.objects["Guides"].data.vellus.guides.length = 0.8


def dye():
    """Color strands by a map of their random numbers."""
    api.set_map(bpy.data.objects["Hair"], "look.melanin", "strand", low=0.0, high=0.2)


def move_sun():
    bpy.data.objects["Sun"].rotation_euler = (1.5, 0.3, 0.0)


def bend():
    bend = bpy.data.objects["Sphere"].modifiers.new("Bend", "SIMPLE_DEFORM")
    bend.angle = 1.0


def repaint():
    bpy.data.images["Sky"].generated_color = (0.9, 0.1, 0.0, 1.0)


def play_modifiers():
    """Add a modifier that viewports have drawn, and a keyed one."""
    add_asset(bpy.data.objects["Hair"], "Curl Hair Curves")
    keyed = add_asset(bpy.data.objects["Hair"], "Duplicate Hair Curves")
    for frame in (1, 2):
        keyed.show_viewport = frame == 2
        keyed.keyframe_insert("show_viewport", frame=frame)
    bpy.context.scene.frame_set(1)
    seen()
    bpy.context.scene.frame_set(2)


def spoil():
    """Draw another hair, surface, light and picture in viewports."""
    sculpt()
    move_sun()
    bend()
    repaint()
    changed("spoilt")
    seen()


def undo():
    """Undo as in a window, which shows changes before the hair's Curves are written."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(running, "has_window", lambda: True)
        bpy.data.objects["Hair"].data.vellus.hair.strand_count = 300
        changed("fewer strands")
        assert len(seen()["strands here"]) == 300
    bpy.ops.ed.undo()


def open_another(folder):
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "other.blend"), copy=True)
    spoil()
    bpy.ops.wm.open_mainfile(filepath=str(folder / "other.blend"))


# Event → an action that causes it.
SCENARIOS = {
    "scene_changed": lambda _folder: move_sun(),
    "hair_evaluated": lambda _folder: play_modifiers(),
    "curves_reported": lambda _folder: sculpt(),
    "strands_computed": lambda _folder: regrow(),
    "looks_written": lambda _folder: dye(),
    "surface_moved": lambda _folder: bend(),
    "image_changed": lambda _folder: repaint(),
    "data_replaced": lambda _folder: undo(),
    "clear": open_another,
}


BROUGHT_BACK = {"data_replaced", "clear"}


def test_each_event_has_a_scenario():
    named = {name for module in (events, invalidation) for name, it in vars(module).items() if inspect.isfunction(it)}
    assert named - {"end"} == {*SCENARIOS}


def older_than(event, folder):
    """Return the names of all shown data that differ after an event from those of a first redraw."""
    before = seen()
    SCENARIOS[event](folder)
    bpy.context.view_layer.update()
    after = seen()
    for cache in invalidation.COPIES + invalidation.OTHERS:
        cache.clear()
    fresh = seen()
    assert np.array_equal(before["picture"], fresh["picture"]) == (event in BROUGHT_BACK)
    return {name for name in after if not np.array_equal(after[name], fresh[name])}


@pytest.mark.parametrize("event", SCENARIOS)
def test_nothing_older_than_an_event_is_drawn(stage, event, tmp_path):
    assert older_than(event, tmp_path) == set()


@pytest.mark.parametrize(
    "event", sorted({*SCENARIOS} - {"clear"})
)  # after which nothing has the number that it had before
def test_something_older_is_drawn_where_an_event_is_not_told(stage, event, tmp_path, monkeypatch):
    told = events if hasattr(events, event) else invalidation
    monkeypatch.setattr(told, event, lambda *_arguments, **_options: None)
    assert older_than(event, tmp_path)
