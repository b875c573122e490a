# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair that cannot be written or drawn does not affect other hair."""

from concurrent.futures import Future

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.groom import bindings, changed_weights
from hair_addon.blender.live import invalidation, live_hair
from hair_addon.blender.render import drawn_scene
from hair_addon.core.errors import HairError
from tests.support.dynamics.following import update
from tests.support.reading import points, write_points

SMALL = {"width": 24, "height": 18}


@pytest.fixture
def two(lit):
    """Return (bad, good) hair between the same guides; the bad hair comes first by name."""
    bpy.context.view_layer.objects.active = bpy.data.objects["Guides"]
    bpy.ops.vellus.interpolate_hair(strand_count=40, radius=0.004)
    lit.name = lit.data.name = "A bad one"
    return lit, bpy.data.objects["Hair.001"]


def unwritten(hair, growing):
    """Return hair whose computed points are not written yet."""
    bound = bindings.of(hair.data)
    bound.growing, bound.is_written, bound.has_moved_only = growing, False, True


def failed():
    growing = Future()
    growing.set_exception(HairError("This hair cannot grow."))
    return growing


def grown(array):
    growing = Future()
    growing.set_result(np.ascontiguousarray(array, np.float32))
    return growing


@pytest.mark.usefixtures("made_anew")
@pytest.mark.parametrize("reader", ["save", "render", "interaction", "points"])
def test_other_hair_is_written(two, reader, tmp_path, capfd):
    bad, good = two
    wanted = points(good) + np.float32(0.5)
    unwritten(bad, failed()), unwritten(good, grown(wanted))
    {
        "save": lambda: bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend")),
        "render": lambda: api.render(tmp_path / "a.png", engine="cycles", sample_count=1, **SMALL),
        "interaction": live_hair.write_after_pause,
        "points": lambda: api.points(good),
    }[reader]()
    np.testing.assert_array_equal(points(good), wanted)
    assert (bad.data.vellus.status, good.data.vellus.status) == ("This hair cannot grow.", "")
    reported = capfd.readouterr()
    assert reported.err.count("This hair cannot grow.") == 1 and "Traceback" not in reported.err + reported.out
    live_hair.write_all()
    assert "cannot grow" not in capfd.readouterr().err


def test_other_hair_follows_its_guides(two, monkeypatch, capfd):
    bad, good = two
    before = points(good)
    write = live_hair.writing.write_hair

    def write_some(hair):
        if hair == bad.data:
            raise HairError("This hair cannot be written.")
        write(hair)

    monkeypatch.setattr(live_hair.writing, "write_hair", write_some)
    guides = bpy.data.objects["Guides"]
    write_points(guides, points(guides) + np.float32((0.0, 0.0, 0.1)) * np.linspace(0.0, 1.0, 41)[None, :, None])
    assert np.abs(points(good) - before).max() > 0.05
    assert bad.data.vellus.status == "This hair cannot be written."
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.parametrize("changes", ["a setting", "the frame"])
def test_other_hair_follows_its_settings_where_one_mesh_was_deleted(hair, capfd, changes):
    api.set_styles(hair.data, [api.Frizz()])
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, location=(3.0, 0.0, 0.0))
    guides = api.distribute_guides(bpy.context.object, guide_count=5, length=0.2)
    good = api.interpolate_hair(guides, strand_count=20)
    update()
    bpy.data.objects.remove(hair.data.surface)
    update()
    for datablock, path, value in ((hair.data, "styles[0].frizz.amplitude", 0.02), (good, "hair.strand_count", 30)):
        group, name = datablock.path_resolve(f"vellus.{path.rpartition('.')[0]}"), path.rpartition(".")[2]
        if changes == "the frame":
            datablock.keyframe_insert(f"vellus.{path}", frame=1)
        setattr(group, name, value)
        if changes == "the frame":
            datablock.keyframe_insert(f"vellus.{path}", frame=10)
    update()
    bpy.context.scene.frame_set(10)
    assert changed_weights.rebound(hair.data, bpy.context.evaluated_depsgraph_get()) is None  # as a slider asks
    assert len(good.curves) == 30 and good.vellus.status == ""
    assert hair.data.vellus.status == "Hair needs a mesh object to grow on: select one."
    assert "Traceback" not in capfd.readouterr().err


def test_an_error_that_nobody_expects_is_reported_when_other_hair_is_done(two, monkeypatch, capfd):
    bad, good = two
    make = live_hair.regenerate

    def make_some(hair, depsgraph):
        if hair == bad.data:
            raise RuntimeError("Nobody expects this.")
        make(hair, depsgraph)

    monkeypatch.setattr(live_hair, "regenerate", make_some)
    bad.data.vellus.hair.strand_count = good.data.vellus.hair.strand_count = 25
    update()
    assert (len(bad.data.curves), len(good.data.curves)) == (500, 25)
    assert "Nobody expects this." in capfd.readouterr().err


def test_the_render_engine_draws_other_hair_and_reports_the_one(two, tmp_path, capfd):
    bad, _good = two
    scene = bpy.context.scene
    scene.render.engine, scene.vellus.sample_count = "VELLUS", 1
    scene.render.resolution_x, scene.render.resolution_y = 24, 18

    def rendered():
        bpy.ops.render.render(write_still=False)
        path = str(tmp_path / "a.exr")
        scene.render.image_settings.file_format = "OPEN_EXR"
        bpy.data.images["Render Result"].save_render(path)
        image = bpy.data.images.load(path)
        pixels = np.array(image.pixels[:], np.float32)
        bpy.data.images.remove(image)
        return pixels

    bad.hide_render = True
    without = rendered()
    bad.hide_render = False
    bad.data.vellus.appearance["roughness"] = 7.0  # out of range, as a driver can put it
    with pytest.raises(RuntimeError, match="Roughness must be between"):
        rendered()
    path = str(tmp_path / "b.exr")
    bpy.data.images["Render Result"].save_render(path)
    np.testing.assert_array_equal(np.array(bpy.data.images.load(path).pixels[:], np.float32), without)
    assert "Traceback" not in capfd.readouterr().err


def test_other_hair_is_drawn_in_a_viewport(two):
    bad, good = two
    bad.data.vellus.marschner.size = 16
    refused = []
    bad.data.vellus.appearance.roughness = np.nan
    update()
    invalidation.clear()
    context = bpy.context
    window = context.window_manager.windows[0]
    space = next(area.spaces.active for area in window.screen.areas if area.type == "VIEW_3D")
    drawn = drawn_scene.read(
        context.scene, context.view_layer, context.evaluated_depsgraph_get(), space, lambda *told: refused.append(told)
    )
    assert drawn.owners == (good.session_uid,)
    assert [datablock for datablock, _error in refused] == [bad.data]
