# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair can be duplicated, linked, appended, overridden, in two scenes, and in a file without the add-on."""

import dataclasses
import math
import sys
from types import ModuleType

import bpy
import numpy as np
import pytest

import hair_addon
from hair_addon.blender.data.strands import curves
from hair_addon.blender.host import running
from hair_addon.blender.host.caches import Cache
from hair_addon.blender.live import handlers, invalidation
from hair_addon.blender.render import hair_cache, offscreen
from hair_addon.core.imaging.pixel_sampling import PictureSettings
from tests.support.reading import points, snapshot, write_points


def select(*names):
    for other in bpy.context.view_layer.objects:
        other.select_set(other.name in names)
    bpy.context.view_layer.objects.active = bpy.data.objects[names[0]]


def comb(guides, amount):
    combed = points(guides)
    combed[:, -1] += amount
    write_points(guides, combed)


def test_a_duplicated_head_has_hair_of_its_own(hair):
    """A duplicated head has its own hair: combing one head leaves the other unchanged."""
    select("Sphere", "Guides", "Hair")
    bpy.ops.object.duplicate()
    bpy.context.view_layer.update()
    copy = bpy.data.objects["Hair.001"]
    assert copy.data.vellus.guide_curves == bpy.data.objects["Guides.001"].data
    assert copy.data.surface == copy.parent == bpy.data.objects["Sphere.001"]
    before = points(hair)
    comb(bpy.data.objects["Guides.001"], 0.2)
    assert np.array_equal(points(hair), before)
    assert not np.array_equal(points(copy), before)


def test_duplicated_hair_follows_the_same_guides(hair):
    select("Hair")
    bpy.ops.object.duplicate()
    bpy.context.view_layer.update()
    comb(bpy.data.objects["Guides"], 0.2)
    assert np.array_equal(points(bpy.data.objects["Hair.001"]), points(hair))
    bpy.data.objects["Hair.001"].data.vellus.hair.strand_count = 50
    bpy.context.view_layer.update()
    assert (len(hair.data.curves), len(bpy.data.objects["Hair.001"].data.curves)) == (500, 50)


def test_duplicated_hair_has_a_look_of_its_own(hair):
    """Duplicated hair has its own look, although Blender lets a duplicate share its material."""
    select("Hair")
    bpy.ops.object.duplicate()
    bpy.context.view_layer.update()
    copy = bpy.data.objects["Hair.001"]
    assert copy.data.materials[0] == hair.data.materials[0]
    before = tuple(hair.data.materials[0].diffuse_color)
    copy.data.vellus.appearance.melanin = 0.1
    bpy.context.view_layer.update()
    assert tuple(hair.data.materials[0].diffuse_color) == before
    assert tuple(copy.data.materials[0].diffuse_color) != before


def test_linked_duplicates_are_one_hair(hair):
    select("Sphere", "Guides", "Hair")
    bpy.ops.object.duplicate(linked=True)
    bpy.context.view_layer.update()
    assert bpy.data.objects["Hair.001"].data == hair.data
    comb(bpy.data.objects["Guides.001"], 0.2)
    assert len(bpy.data.hair_curves) == 2


def test_a_full_copy_of_the_scene_is_on_its_own(hair):
    bpy.ops.scene.new(type="FULL_COPY")
    bpy.context.view_layer.update()
    copy = next(o for o in bpy.context.scene.objects if o.type == "CURVES" and o.data.vellus.kind == "HAIR")
    assert copy.data != hair.data
    assert copy.data.vellus.guide_curves.surface == copy.data.surface == copy.parent
    assert copy.parent.name in bpy.context.scene.objects


@pytest.fixture
def groom_file(hair, tmp_path):
    """Return a .blend with hair, while another file is open."""
    path = tmp_path / "groom.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return path


def bring(path, is_linked):
    """Return the hair object of a file, linked or appended, in the scene."""
    with bpy.data.libraries.load(str(path), link=is_linked) as (_source, target):
        target.objects = ["Hair"]
    for brought in bpy.data.objects:
        bpy.context.scene.collection.objects.link(brought)
    bpy.context.view_layer.update()
    bpy.context.view_layer.objects.active = target.objects[0]
    return target.objects[0]


def test_appended_hair_brings_what_it_follows(groom_file):
    hair = bring(groom_file, is_linked=False)
    assert hair.data.vellus.guide_curves.name == "Guides"
    assert hair.data.surface.name == "Sphere"
    hair.data.vellus.hair.strand_count = 30
    bpy.context.view_layer.update()
    assert (len(hair.data.curves), hair.data.vellus.status) == (30, "")


def linked_guides(file):
    """Return the linked guides of a file, after Blender has evaluated their surface."""
    return bring(file, is_linked=True).data.vellus.guide_curves


def test_linked_guides_say_nothing_where_nothing_would_change(groom_file):
    guides = linked_guides(groom_file)
    assert guides.library is not None and guides.vellus.status == ""


def test_linked_guides_on_an_edited_surface_say_what_to_do(groom_file):
    guides = linked_guides(groom_file)
    before = curves.read_points(guides)
    surface = guides.surface
    surface.data.vertices[0].co *= 1.2  # as a change of the library's file, since these guides were written
    surface.data.update()
    bpy.context.view_layer.update()
    assert np.array_equal(curves.read_points(guides), before) and "make it local" in guides.vellus.status


def test_a_library_override_does_not_ask_for_one(groom_file):
    hair = bring(groom_file, is_linked=True)
    hair.override_hierarchy_create(bpy.context.scene, bpy.context.view_layer)
    bpy.context.view_layer.update()
    states = [made.vellus for made in bpy.data.hair_curves if made.override_library is not None]
    assert sorted((state.kind, state.status) for state in states) == [("GUIDES", ""), ("HAIR", "")]


LINKED = {
    "interpolate_hair": {"strand_count": 10},
    "distribute_guides": {"guide_count": 10},
    "apply_preset": {"preset": "BLOND"},
    "toggle_drawing": {},
    "delete_hair": {},
    "make_uv_map": {},
    "apply_scale": {},
    "use_uv_map": {},
}


@pytest.mark.parametrize("operator", LINKED)
def test_linked_hair_is_left_alone(groom_file, operator):
    """Linked hair is not changed, as Blender would lose the change on reload."""
    hair = bring(groom_file, is_linked=True)
    before, made = snapshot(), points(hair)
    with pytest.raises(RuntimeError, match="is linked from another file"):
        getattr(bpy.ops.vellus, operator)(**LINKED[operator])
    assert snapshot() == before and np.array_equal(points(hair), made)


def test_linked_hair_is_drawn_and_settings_change_nothing(groom_file):
    hair = bring(groom_file, is_linked=True)
    assert hair_cache.strands_on_gpu(hair.data).strand_count == 500
    hair.data.vellus.hair.radius = 0.001
    bpy.context.view_layer.update()
    assert "is linked from another file: make it local first" in hair.data.vellus.status
    hair.data.vellus.hair.strand_count = 30
    bpy.context.view_layer.update()
    assert len(hair.data.curves) == 500 and "keeps the 500 strands of its file" in hair.data.vellus.status


def test_linked_hair_keeps_the_materials_of_its_file(groom_file):
    """Linked hair keeps the materials of its file when undo frees materials of this file, which once made Blender
    crash.
    """
    hair = bring(groom_file, is_linked=True)
    linked = list(hair.data.materials)
    hair.data.vellus.appearance.roughness = 0.9
    bpy.context.view_layer.update()
    assert list(hair.data.materials) == linked and linked[0].library is not None


def test_overridden_hair_is_editable_or_reports_why_not(groom_file):
    linked = bring(groom_file, is_linked=True)
    local = linked.override_hierarchy_create(bpy.context.scene, bpy.context.view_layer, do_fully_editable=True)
    bpy.context.view_layer.update()
    assert local.library is None
    bpy.context.view_layer.objects.active = local
    before = points(local)
    local.data.vellus.hair.strand_count = 30
    bpy.context.view_layer.update()
    assert np.isfinite(points(local)).all()
    assert len(local.data.curves) == 30 or (np.array_equal(points(local), before) and local.data.vellus.status)


def test_hair_of_another_scene_is_drawn_there(hair):
    other = bpy.data.scenes.new("Other")
    other.collection.objects.link(hair)
    bpy.context.window.scene = other
    bpy.context.view_layer.update()
    comb(bpy.data.objects["Guides"], 0.2)
    for curves_object in (hair, bpy.data.objects["Guides"]):
        drawn = hair_cache.strands_on_gpu(curves_object.data).points
        assert np.array_equal(drawn, points(curves_object))


def test_hair_stays_in_the_file_while_the_addon_is_disabled(hair, tmp_path):
    path, made = str(tmp_path / "groom.blend"), points(hair)
    hair_addon.unregister()
    try:
        assert hair.display_type == "TEXTURED"  # as Blender draws it
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
    finally:
        hair_addon.register()
    hair = bpy.data.objects["Hair"]
    assert np.array_equal(points(hair), made)
    assert (hair.data.vellus.kind, hair.data.vellus.hair.strand_count) == ("HAIR", 500)
    assert hair.data.vellus.guide_curves == bpy.data.objects["Guides"].data
    hair.data.vellus.hair.strand_count = 40
    bpy.context.view_layer.update()
    assert len(hair.data.curves) == 40


def test_hair_is_drawn_once_when_the_addon_is_enabled_again(hair):
    shown = hair.display_type
    hair_addon.unregister()
    assert hair.display_type != shown
    hair_addon.register()
    assert bpy.app.timers.is_registered(handlers._take_over)
    handlers._take_over()  # as Blender does with its next redraw
    assert (hair.display_type, bpy.data.objects["Guides"].display_type) == (shown, "BOUNDS")


@pytest.mark.parametrize("is_enabled_again", [False, True])
def test_it_is_disabled_when_the_render_of_a_window_has_ended(hair, monkeypatch, capsys, is_enabled_again):
    wait = hair_addon.blender._unregister_after_render
    monkeypatch.setattr(running, "is_rendering", lambda: True)
    hair_addon.unregister()
    hair_addon.blender.unregister()  # somebody clicks again
    try:
        assert capsys.readouterr().err.count("Vellus is disabled when the render has ended") == 1
        assert bpy.app.timers.is_registered(wait) and wait() > 0.0
        assert hair.data.vellus.kind == "HAIR" and hair_addon.blender.engine.VellusRenderEngine.is_registered
        monkeypatch.setattr(running, "is_rendering", lambda: False)
        if is_enabled_again:
            hair_addon.register()
            assert not bpy.app.timers.is_registered(wait) and hair.data.vellus.kind == "HAIR"
        else:
            assert wait() is None and not hasattr(bpy.types.Curves, "vellus")
    finally:
        if bpy.app.timers.is_registered(wait):
            bpy.app.timers.unregister(wait)
        if not hasattr(bpy.types.Curves, "vellus"):
            hair_addon.register()


@pytest.mark.parametrize("how", ["factory", "homefile"])
def test_a_new_file_leaves_nothing_in_memory(hair, how):
    hair_cache.strands_on_gpu(hair.data)
    if how == "factory":
        bpy.ops.wm.read_factory_settings(use_empty=True)
    else:
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert not any(map(len, invalidation.COPIES + invalidation.OTHERS))
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
    assert bpy.ops.vellus.add_hair(guide_count=5, strand_count=10) == {"FINISHED"}


def test_a_removed_material_comes_back(hair):
    bpy.data.materials.remove(hair.data.materials[0])
    hair.data.vellus.appearance.melanin = 0.3
    bpy.context.view_layer.update()
    assert hair.data.vellus.shading_status == "" and hair.data.materials[0] is not None


def held(value, depth=3):
    """Yield a value and all that it refers to, through containers, caches and dataclasses."""
    yield value
    if depth == 0:
        return
    inside = ()
    if isinstance(value, Cache):
        inside = value.values()
    elif isinstance(value, dict):
        inside = [*value.keys(), *value.values()]
    elif isinstance(value, (list, tuple, set)):
        inside = list(value)
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        inside = [getattr(value, field.name) for field in dataclasses.fields(value)]
    for part in inside:
        yield from held(part, depth - 1)


def test_no_module_keeps_blenders_data(hair):
    """No module holds a reference to Blender's data after all had work to do, as a reference to freed data would
    crash.
    """
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location.z = 5.0
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    hair_cache.strands_on_gpu(bpy.data.objects["Guides"].data)
    small = PictureSettings(width=8, height=8, samples_per_side=1)
    offscreen.draw_picture(small)
    modules = {name: module for name, module in sys.modules.items() if name.startswith("hair_addon.")}
    for name, module in modules.items():
        for variable, value in vars(module).items():
            if variable.startswith("__") or isinstance(value, (type, ModuleType)):
                continue
            kept = [part for part in held(value) if isinstance(part, bpy.types.bpy_struct)]
            assert not kept, f"{name}.{variable} keeps {kept[:3]}"


def test_a_surface_without_faces_is_reported(hair):
    """A surface without faces is reported, for guides whose triangles no longer exist."""
    sphere = bpy.data.objects["Sphere"]
    before = points(hair)
    sphere.data.clear_geometry()
    sphere.data.update_tag()
    bpy.context.view_layer.update()
    assert "no faces" in bpy.data.objects["Guides"].data.vellus.status
    assert np.array_equal(points(hair), before)
    assert math.isfinite(before.sum())
